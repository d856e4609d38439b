"""Measures the C library beside the crate that it is made of, on one thread.

    make benchmark
    python3 benchmarks/compare.py target/release PICTURE.ppm

They are measured in turns, and all figures are medians: other work on the machine slows down
both alike.
"""

import argparse
import statistics
import subprocess
from pathlib import Path
from typing import Any

ROUNDS = {"decode": 300, "encode": 15}


def start(program: Path, picture: Path) -> "subprocess.Popen[str]":
    pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    return subprocess.Popen([program, picture], **pipes)


def measure(process: "subprocess.Popen[str]", task: str) -> float:
    """The time of a task in milliseconds."""
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write(task + "\n")
    process.stdin.flush()
    return float(process.stdout.readline()) / 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("built", type=Path, help="the folder release of cargo")
    parser.add_argument("picture", type=Path, help="a picture as PPM of 8 bits, without comments")
    options = parser.parse_args()
    with (
        start(options.built / "examples/native", options.picture) as native,
        start(options.built / "c/library", options.picture) as library,
    ):
        for task, rounds in ROUNDS.items():
            times: dict[str, list[float]] = {"native": [], "library": []}
            for round_ in range(rounds):
                both = [("native", native), ("library", library)]
                # Neither always comes first.
                for name, process in both if round_ % 2 else reversed(both):
                    times[name].append(measure(process, task))
            medians = {name: statistics.median(of) for name, of in times.items()}
            ratios = [b / a for a, b in zip(times["native"], times["library"], strict=True)]
            print(
                f"{task}: native {medians['native']:.2f} ms, "
                f"C library {medians['library']:.2f} ms, "
                f"{100 * (medians['library'] / medians['native'] - 1):+.1f} %; "
                f"in turns {100 * (statistics.median(ratios) - 1):+.1f} %"
            )
        for process in (native, library):
            assert process.stdin is not None
            process.stdin.close()


if __name__ == "__main__":
    main()
