"""Measures the module beside its native decoder, and beside other codecs in Pillow.

    cargo build --release --example native
    pip install image-gip pillow pillow-jxl-plugin
    python benchmarks/compare.py --native target/release/examples/native PICTURE.png

What `--wheel FILE` and `--large PICTURE` add is said by `--help`.

What is compared is measured in turns, and all figures are medians: other work on the machine slows
down both sides alike.
"""

import argparse
import io
import math
import os
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

import image_gip
import image_gip.pillow

#: Bits per pixel of the files that are compared.
RATE = 0.5
THUMBNAIL = (96, 64)
#: Encodings that are interrupted, at all of their stages.
INTERRUPTED: tuple[dict[str, Any], ...] = (
    {"effort": 1, "quality": 75},
    {"effort": 1, "bpp": 0.5},
    {"effort": 1, "psnr": 34, "tune": "psnr"},
)
#: Formats of Pillow, with the qualities that are tried for the rate, best first.
OTHERS: dict[str, dict[str, Any]] = {"WEBP": {"method": 6}, "AVIF": {"speed": 6}, "JXL": {}}

IMPORT = """
import time, numpy
start = time.perf_counter()
import image_gip
print(time.perf_counter() - start)
"""


def in_turns(rounds: int, **tasks: Callable[[], object]) -> dict[str, float]:
    """The median time of each task in milliseconds; a task that returns a float measures itself."""
    times: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(rounds):
        for name, task in tasks.items():
            start = time.perf_counter()
            result = task()
            elapsed = time.perf_counter() - start
            times[name].append(result if isinstance(result, float) else elapsed)
    return {name: statistics.median(list_) * 1e3 for name, list_ in times.items()}


def measure_import() -> None:
    def run() -> float:
        output = subprocess.run([sys.executable, "-c", IMPORT], check=True, capture_output=True)
        return float(output.stdout)

    print(f"import, beyond NumPy's: {in_turns(15, run=run)['run']:.1f} ms")


def measure_overhead(file: bytes, native: Path) -> None:
    with tempfile.NamedTemporaryFile(suffix=".gip") as stored:
        stored.write(file)
        stored.flush()
        with subprocess.Popen(
            [native, stored.name], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        ) as process:
            assert process.stdin is not None
            assert process.stdout is not None
            to, from_ = process.stdin, process.stdout

            def natively() -> float:
                to.write("\n")
                to.flush()
                return float(from_.readline()) / 1e9

            samples = image_gip.decode(file)
            times = in_turns(
                200,
                native=natively,
                new=lambda: image_gip.decode(file),
                out=lambda: image_gip.decode(file, out=samples),
            )
            to.close()
    print(
        f"decode: native {times['native']:.3f} ms, to a new array {times['new']:.3f} ms, "
        f"to an array that is there {times['out']:.3f} ms"
    )


def decode_many(file: bytes) -> None:
    for _ in range(30):
        image_gip.decode(file)


def measure_threads(file: bytes) -> None:
    """Two threads beside two processes, which have nothing to wait for but the machine."""
    with ThreadPoolExecutor(2) as threads, ProcessPoolExecutor(2) as processes:
        times = in_turns(
            15,
            one=lambda: decode_many(file),
            two=lambda: list(threads.map(decode_many, [file, file])),
            processes=lambda: list(processes.map(decode_many, [file, file])),
        )
    rates = {name: 2 * times["one"] / times[name] for name in ("two", "processes")}
    print(
        f"two Python threads: {rates['two']:.2f} times the rate of one; "
        f"two processes: {rates['processes']:.2f} times"
    )


def measure_thumbnail(file: bytes) -> None:
    def load() -> None:
        with Image.open(io.BytesIO(file)) as opened:
            opened.load()

    def thumbnail() -> None:
        with Image.open(io.BytesIO(file)) as opened:
            opened.thumbnail(THUMBNAIL)

    times = in_turns(100, load=load, thumbnail=thumbnail)
    print(
        f"Pillow: load {times['load']:.2f} ms, thumbnail({THUMBNAIL}) {times['thumbnail']:.2f} ms, "
        f"{times['load'] / times['thumbnail']:.1f} times as quick"
    )


def interrupt(picture: NDArray[Any], options: dict[str, Any], fraction: float) -> float:
    """The time in ms that Ctrl-C takes when that fraction of an encoding is done."""
    sent = math.nan
    arrived = threading.Event()

    def send() -> None:
        nonlocal sent
        arrived.wait()
        # Not at a call of `progress`, where the encoder was listening just now.
        time.sleep(random.uniform(0, 0.05))
        sent = time.perf_counter()
        os.kill(os.getpid(), signal.SIGINT)

    def look(progress: image_gip.Progress) -> None:
        if progress.fraction >= fraction:
            arrived.set()

    sender = threading.Thread(target=send)
    sender.start()
    try:
        image_gip.encode(picture, progress=look, **options)
        arrived.set()
        sender.join()
        time.sleep(1)
    except KeyboardInterrupt:
        return (time.perf_counter() - sent) * 1e3
    finally:
        sender.join()
    return math.nan


def measure_interrupt(picture: NDArray[Any]) -> None:
    height, width = picture.shape[:2]
    for options in INTERRUPTED:
        delays = [interrupt(picture, options, trial / 20) for trial in range(20)]
        print(
            f"Ctrl-C, {width} x {height}, {options}: {statistics.median(delays):.0f} ms, "
            f"at most {max(delays):.0f} ms"
        )


def encoded(image: Image.Image, form: str, options: dict[str, Any]) -> bytes:
    file = io.BytesIO()
    image.save(file, form, **options)
    return file.getvalue()


def at_rate(image: Image.Image, form: str) -> tuple[bytes, dict[str, Any]]:
    """The largest file of a format up to the rate, and its options."""
    if form == "GIP":
        return encoded(image, form, {"bpp": RATE}), {"bpp": RATE}
    most = RATE * image.width * image.height / 8
    least, best = 0, 100
    while best - least > 1:
        middle = (least + best) // 2
        size = len(encoded(image, form, OTHERS[form] | {"quality": middle}))
        least, best = (middle, best) if size <= most else (least, middle)
    options = OTHERS[form] | {"quality": least}
    return encoded(image, form, options), options


def measure_formats(image: Image.Image) -> None:
    forms = ["GIP", *(form for form in OTHERS if form in Image.SAVE)]
    files = {form: at_rate(image, form) for form in forms}

    def load(form: str) -> None:
        with Image.open(io.BytesIO(files[form][0])) as opened:
            opened.load()

    def thumbnail(form: str) -> None:
        with Image.open(io.BytesIO(files[form][0])) as opened:
            opened.thumbnail(THUMBNAIL)

    def header(form: str) -> None:
        with Image.open(io.BytesIO(files[form][0])):
            pass

    tasks: list[tuple[Callable[[str], object], int]] = [
        (header, 50),
        (load, 50),
        (thumbnail, 50),
        (lambda form: encoded(image, form, files[form][1]), 3),
    ]
    columns = [
        in_turns(rounds, **{form: lambda form=form, task=task: task(form) for form in forms})
        for task, rounds in tasks
    ]
    original = np.asarray(image).astype(float)
    print(f"{image.width} x {image.height} in Pillow, times in ms:")
    print(f"{'':5} {'bytes':>7} {'PSNR':>6} {'open':>7} {'load':>7} {'thumb':>7} {'save':>8}")
    for form in forms:
        with Image.open(io.BytesIO(files[form][0])) as opened:
            error = np.square(np.asarray(opened.convert("RGB")) - original).mean()
        psnr = 10 * np.log10(255**2 / error)
        opening, loading, thumb, saving = (column[form] for column in columns)
        print(
            f"{form:5} {len(files[form][0]):7} {psnr:6.2f} {opening:7.3f} {loading:7.2f} "
            f"{thumb:7.2f} {saving:8.0f}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--native", type=Path, required=True)
    parser.add_argument("--wheel", type=Path, help="a wheel to tell the size of")
    parser.add_argument("--large", type=Path, help="a picture to interrupt the encoding of")
    arguments = parser.parse_args()
    if "JXL" not in Image.SAVE:
        try:
            __import__("pillow_jxl")
        except ImportError:
            print("without JPEG XL: there is no pillow_jxl")
    Image.init()
    image = Image.open(arguments.picture).convert("RGB")
    samples = np.asarray(image)
    file = image_gip.encode(samples, bpp=RATE)
    if arguments.wheel:
        print(f"wheel: {arguments.wheel.stat().st_size / 1e6:.2f} MB")
    measure_import()
    measure_overhead(file, arguments.native)
    measure_threads(file)
    measure_thumbnail(file)
    measure_interrupt(np.asarray(Image.open(arguments.large or arguments.picture).convert("RGB")))
    measure_formats(image)


if __name__ == "__main__":
    main()
