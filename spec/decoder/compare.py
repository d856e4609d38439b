"""python -m decoder.compare [--seconds N] PATH...: what this decoder makes of files, to compare with another program.

A PATH is a file or a folder, of which all files are taken in the order of their names. For each one there is a line of
four columns, separated by tabs:

- the name,
- `whole`, `error` or `time`,
- the result as the index of the test vectors has it: the CRC-32 of the samples at the stored size; or the kind of
  error, its chunk (a limit has none) and how many Gaussians are kept; or nothing if the time was over,
- the types of the chunks that are skipped as they break a rule, in their order, separated by spaces.

In types that are not of letters, bytes other than printable ones of ASCII are written as in Python: `\\t`, `\\xff`.
"""

import argparse
import signal
from pathlib import Path

from .check import outcome
from .decode import decode


class OutOfTime(BaseException):
    """No `Exception`, so that nothing on the way takes it for an error of its own."""


def out_of_time(*_):
    raise OutOfTime


def line_of(path, seconds):
    """The columns for a file."""
    skipped = []
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        picture, error = decode(path.read_bytes())
        skipped = picture.skipped if picture else []
        result = outcome(picture, error, "whole")
        rendering = "error" if ";" in result else "whole"  # a limit may show only in the rendering
    except OutOfTime:
        rendering, result = "time", ""
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
    return path.name, rendering, result, " ".join(skipped)


def main():
    parser = argparse.ArgumentParser(prog="python -m decoder.compare")
    parser.add_argument("paths", nargs="+", type=Path)
    parser.add_argument("--seconds", type=float, default=10, help="for each file (default: 10)")
    options = parser.parse_args()
    signal.signal(signal.SIGALRM, out_of_time)
    for path in options.paths:
        for file in sorted(p for p in path.iterdir() if p.is_file()) if path.is_dir() else [path]:
            print(*line_of(file, options.seconds), sep="\t", flush=True)


if __name__ == "__main__":
    main()
