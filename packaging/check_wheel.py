"""Prints what the installed module decodes and encodes, to be compared with other machines: `check_wheel.py`.

The samples of all test vectors and the bytes of files are the same everywhere. It needs NumPy and nothing else, and
without a lock of the interpreter it makes sure that there still is none.
"""

import sys
import threading
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np

import image_gip

VECTORS = Path(__file__).resolve().parents[1] / "spec" / "vectors"


def picture() -> np.ndarray:
    """A ramp with a soft blob, 64 x 48 pixels of RGB."""
    y, x = np.mgrid[:48, :64].astype(np.int32)
    blob = 180 * 200 // (200 + (x - 40) ** 2 + (y - 21) ** 2)
    return np.stack([blob, x + 40, y * 2 + 60], axis=-1).astype(np.uint8)


def decoded() -> list[str]:
    """A line for each vector."""
    lines = []
    for path in sorted(VECTORS.glob("*.gip")):
        try:
            samples = image_gip.decode(path)
        except image_gip.GipError as error:
            told = type(error).__name__
        else:
            told = f"{samples.shape} {samples.dtype} {zlib.crc32(samples.tobytes()):08x}"
        lines.append(f"{path.name}: {told}")
    return lines


def encoded() -> list[str]:
    """A line for each file, with what comes back."""
    source = picture()
    lines = []
    for options in ({"gaussians": 60}, {"quality": 60}, {"bpp": 1.0, "precision": "packed"}):
        file = image_gip.encode(source, effort=1, **options)
        error = np.abs(image_gip.decode(file).astype(np.int32) - source).max()
        lines.append(f"{options}: {len(file)} bytes {zlib.crc32(file):08x}, off by {error}")
    return lines


def at_once(*tasks: Callable[[], list[str]]) -> list[list[str]]:
    """The results of tasks on threads of their own."""
    results: list[list[str]] = [[] for _ in tasks]

    def run(at: int) -> None:
        results[at] = tasks[at]()

    threads = [threading.Thread(target=run, args=(at,)) for at in range(len(tasks))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return results


def main() -> None:
    locked = getattr(sys, "_is_gil_enabled", lambda: True)
    was_locked = locked()
    first, second = at_once(decoded, encoded)
    again = at_once(encoded, decoded)
    assert again == [second, first], "threads change what comes out"
    assert sum("(" in line for line in first) > 60, first
    assert locked() == was_locked, "the module brought the lock back"
    print(*first, *second, sep="\n")
    print("with" if was_locked else "without", "a lock", file=sys.stderr)


if __name__ == "__main__":
    # The lock would come back when the module is imported.
    main()
