"""Threads, processes and memory: what works in a server or in a loader of data."""

import ctypes
import gc
import io
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
import zlib
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from conftest import VECTORS
from PIL import Image

import image_gip
import image_gip.pillow

#: After so many seconds, a process is taken to hang.
WATCHDOG = 60

FORK = """
import os, sys, threading, time
import numpy as np
import image_gip

picture = np.add.outer(np.arange(48), np.arange(64)).astype(np.uint8)

def work():
    files = [image_gip.encode(picture, effort=1, threads=threads) for threads in (1, 2)]
    samples = [image_gip.decode(files[0], threads=threads) for threads in (1, 3)]
    return files + [array.tobytes() for array in samples]

def threads():
    return len(os.listdir("/proc/self/task"))

before = threads()
first = work()
# A thread that was waited for may still be listed for a moment.
patience = time.monotonic() + 5
while threads() != before:
    assert time.monotonic() < patience, "a thread has outlived its call"
if "busy" in sys.argv:
    # Another thread is in the middle of its work.
    stop, started = threading.Event(), threading.Event()
    def progress(_):
        started.set()
        return not stop.is_set()
    def encode():
        try:
            image_gip.encode(picture, effort=7, threads=2, progress=progress)
        except image_gip.CancelledError:
            pass
    worker = threading.Thread(target=encode)
    worker.start()
    started.wait()
child = os.fork()
if child == 0:
    os._exit(0 if work() == first else 1)
_, status = os.waitpid(child, 0)
if "busy" in sys.argv:
    stop.set()
    worker.join()
sys.exit(os.waitstatus_to_exitcode(status))
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="it counts threads in /proc")
@pytest.mark.parametrize("when", ["idle", "busy"])
def test_fork_after_use(when: str) -> None:
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "PYTHONWARNINGS": "error"}
    if when == "busy":
        # Python warns of a fork beside any other thread.
        environment["PYTHONWARNINGS"] = "ignore"
    process = subprocess.Popen(
        [sys.executable, "-c", FORK, when], env=environment, start_new_session=True
    )
    try:
        assert process.wait(WATCHDOG) == 0
    except subprocess.TimeoutExpired:
        # The child of the fork as well.
        os.killpg(process.pid, signal.SIGKILL)
        pytest.fail("the child of the fork hangs")


def test_two_threads_at_once() -> None:
    lines = [line.split("\t") for line in (VECTORS / "index.tsv").read_text().splitlines()]
    whole = [(VECTORS / line[0], line[2]) for line in lines if line[1] == "whole"]

    def matches(vector: Any) -> bool:
        path, crc = vector
        samples = image_gip.decode(path)
        stored = samples.astype(">u2") if samples.dtype == np.uint16 else samples
        return bool(f"{zlib.crc32(stored.tobytes()):08x}" == crc)

    with ThreadPoolExecutor(2) as pool:
        assert all(pool.map(matches, whole * 20))


def test_the_interpreter_lock_is_released(file: bytes) -> None:
    started, done = threading.Event(), threading.Event()

    def decode() -> None:
        started.set()
        image_gip.decode(file, size=(6000, 4000))
        done.set()

    worker = threading.Thread(target=decode)
    worker.start()
    started.wait()
    ticks = 0
    while not done.is_set():
        time.sleep(0.001)
        ticks += 1
    worker.join()
    assert ticks > 10


def test_pickling(file: bytes) -> None:
    info = image_gip.info(file)
    assert pickle.loads(pickle.dumps(info)) == info
    limits = image_gip.Limits(max_width=5)
    assert pickle.loads(pickle.dumps(limits)) == limits
    with pytest.raises(image_gip.GipError) as raised:
        image_gip.decode(VECTORS / "xformat.gip")
    error = pickle.loads(pickle.dumps(raised.value))
    assert str(error).startswith("chunk H (header): unsupported")
    assert type(error) is image_gip.UnsupportedError
    assert (str(error), error.chunk) == (str(raised.value), "H")
    with pytest.raises(image_gip.LimitError) as limited:
        image_gip.decode(file, limits=limits)
    assert pickle.loads(pickle.dumps(limited.value)).wanted == 96


class _Mallinfo(ctypes.Structure):
    _fields_ = [
        (name, ctypes.c_size_t)
        for name in (
            *("arena", "ordblks", "smblks", "hblks", "hblkhd"),
            *("usmblks", "fsmblks", "uordblks", "fordblks", "keepcost"),
        )
    ]


def bytes_in_use() -> int:
    """What native code has allocated in all, in bytes; 0 where that is unknown."""
    try:
        mallinfo: Any = ctypes.CDLL(None).mallinfo2
    except (AttributeError, OSError):
        return 0
    mallinfo.restype = _Mallinfo
    found = mallinfo()
    return int(found.uordblks + found.hblkhd)


def assert_no_leak(work: Callable[[], object], times: int) -> None:
    """Calls of `work` leave nothing behind once the interpreter's caches are full.

    A leak shows in every round, a cache that fills up late in one or two.
    """
    for _ in range(500):
        work()
    growths = []
    for _ in range(4):
        gc.collect()
        before = sys.getallocatedblocks(), bytes_in_use()
        for _ in range(times):
            work()
        gc.collect()
        growths.append((sys.getallocatedblocks() - before[0], bytes_in_use() - before[1]))
        # Less than one block of Python's allocator, and less than one of malloc, for two calls.
        if growths[-1][0] < times / 2 and growths[-1][1] < times * 16:
            return
    raise AssertionError(f"blocks and bytes after {times} calls each: {growths}")


def test_1000_decodes_leak_nothing(file: bytes) -> None:
    out = np.empty((64, 96, 3), np.uint8)
    damaged = file[:-30] + bytes(30)

    def decode() -> None:
        image_gip.decode(file)
        image_gip.decode(bytearray(file), out=out)
        image_gip.decode(file, dtype=np.float32, region=(5, 5, 20, 20))
        with pytest.raises(image_gip.MalformedError):
            image_gip.decode(damaged)

    assert_no_leak(decode, 1000)


CUT_OUT = (VECTORS / "entropy-rgba8.gip").read_bytes()


def thumbnail(file: bytes) -> None:
    with Image.open(io.BytesIO(file)) as opened:
        opened.thumbnail((20, 20))


@pytest.mark.parametrize(
    "work",
    [
        image_gip.info,
        image_gip.gaussians,
        lambda file: image_gip.StreamDecoder().feed(file).image(threads=2),
        lambda file: image_gip.encode(
            np.zeros((8, 8, 3), np.uint8),
            effort=1,
            icc=file,
            texts={"Title": "a"},
            metadata="safe",
            progress=lambda _: None,
        ),
        lambda file: image_gip.decode(CUT_OUT, background=(1, 2, 3)),
        thumbnail,
    ],
    ids=["info", "gaussians", "stream", "encode", "background", "thumbnail"],
)
def test_nothing_else_leaks(work: Callable[[bytes], object], file: bytes) -> None:
    assert_no_leak(lambda: work(file), 300)


SHORT_OF_MEMORY = """
import resource, sys
import numpy as np
import image_gip

cut_out, work = sys.argv[1], sys.argv[2]
colors = np.zeros((3000, 4000, 3), np.float32)  # no memory is touched
with open("/proc/self/statm") as statm:
    used = int(statm.read().split()[0]) * resource.getpagesize()
stream = image_gip.StreamDecoder().feed(open(cut_out, "rb").read())
# The result fits, and not what is needed beside it.
room = {"encode": 50, "floats": 240, "over": 150, "stream": 150}[work] << 20
resource.setrlimit(resource.RLIMIT_AS, (used + room, used + room))
try:
    if work == "encode":
        image_gip.encode(colors, effort=1)
    elif work == "floats":
        image_gip.decode(cut_out, size=(4000, 2500), dtype="f4")
    elif work == "over":
        image_gip.decode(cut_out, size=(6000, 5000), mode="RGB")
    else:
        stream.image(size=(6000, 5000), mode="RGB")
except MemoryError:
    sys.exit(7)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="it reads /proc")
@pytest.mark.parametrize("work", ["encode", "floats", "over", "stream"])
def test_without_memory_there_is_a_memory_error(work: str) -> None:
    path = VECTORS / "entropy-rgba8.gip"
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
    process = subprocess.run(
        [sys.executable, "-c", SHORT_OF_MEMORY, path, work],
        env=environment,
        stderr=subprocess.PIPE,
        check=False,
    )
    assert process.returncode == 7, process.stderr
