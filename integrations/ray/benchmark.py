"""Measures how long image_gip.ray takes beside `gip batch`, with the same number of cores.

    python benchmark.py PICTURE... [--gip ../../target/release/gip] [--cores 2] [--rounds 3]

Both encode the pictures with as many cores, in turns. The cluster runs before, with its workers
warmed up by a run that is not counted; what it takes to start is reported by itself.
"""

from __future__ import annotations

import argparse
import logging
import os
import shutil
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pyarrow.parquet
import ray
import ray.data

import image_gip.ray

SHARD_SIZE = 4


def seconds(task: Callable[[], object]) -> float:
    start = time.perf_counter()
    task()
    return time.perf_counter() - start


def connect(cores: int) -> None:
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    ray.init(
        num_cpus=cores,
        include_dashboard=False,
        object_store_memory=80 << 20,
        log_to_driver=False,
        logging_level=logging.ERROR,
        _node_ip_address="127.0.0.1",
    )
    ray.data.DataContext.get_current().enable_progress_bars = False


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pictures", nargs="+", type=Path)
    parser.add_argument("--gip", type=Path, default=Path("../../target/release/gip"))
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument("--copies", type=int, default=1)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--effort", type=int, default=1)
    arguments = parser.parse_args()

    with tempfile.TemporaryDirectory() as name:
        scratch = Path(name)
        photos = scratch / "photos"
        photos.mkdir()
        for copy in range(arguments.copies):
            for picture in arguments.pictures:
                shutil.copy(picture, photos / f"{copy}-{picture.name}")
        pictures = sorted(photos.iterdir())

        def batch(out: Path) -> None:
            options = ["--jobs", f"{arguments.cores}", "--effort", f"{arguments.effort}"]
            command = [arguments.gip, "batch", photos, "--out", out, "--bpp", "0.5", *options]
            subprocess.run(command, check=True, capture_output=True)

        def on_ray(out: Path, pictures: list[Path] = pictures) -> None:
            image_gip.ray.encode_dataset(
                pictures, out, shard_size=SHARD_SIZE, bpp=0.5, effort=arguments.effort
            )

        print(f"start of a node: {seconds(partial(connect, arguments.cores)):.1f} s")
        few = pictures[: arguments.cores * SHARD_SIZE]
        print(f"first {len(few)} pictures: {seconds(partial(on_ray, scratch / 'few', few)):.1f} s")
        ratios = []
        for turn in range(arguments.rounds):
            times = [
                seconds(partial(batch, scratch / f"batch-{turn}")),
                seconds(partial(on_ray, scratch / f"ray-{turn}")),
            ]
            ratios.append(times[1] / times[0])
            print(f"{len(pictures)} pictures: gip batch {times[0]:.1f} s, Ray {times[1]:.1f} s")
        print(f"overhead: {100 * (statistics.median(ratios) - 1):+.1f} % (median of {len(ratios)})")
        compare(scratch / "batch-0", scratch / "ray-0")


def compare(batch: Path, on_ray: Path) -> None:
    """Makes sure that both have made the same files."""
    rows = pyarrow.parquet.read_table(sorted(on_ray.glob("*.parquet"))).to_pylist()
    files = {path.stem: path.read_bytes() for path in batch.glob("*.gip")}
    found = {row["key"].rpartition("/")[2]: row["bytes"] for row in rows}
    same = sum(files[name] == data for name, data in found.items())
    print(f"{same} of {len(files)} files are the same, byte for byte")


if __name__ == "__main__":
    main()
