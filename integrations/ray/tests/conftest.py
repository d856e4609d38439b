"""A data set, what a serial run makes of it, and a cluster on this machine."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

# Before Ray is imported. Nothing is reported, and nothing listens but on this machine.
os.environ |= {
    "OPENBLAS_NUM_THREADS": "1",
    "RAY_DATA_DISABLE_PROGRESS_BARS": "1",
    "RAY_DISABLE_DOCKER_CPU_WARNING": "1",
    "RAY_DISABLE_IMPORT_WARNING": "1",
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",
    # As by default on Windows and macOS: no name but that of the loopback address.
    "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0",
    "RAY_USAGE_STATS_ENABLED": "0",
}

from ray.cluster_utils import Cluster

from image_gip._dataset import folder, shards
from image_gip._dataset.work import Container, Job, Operation

#: Of the data set of the recovery tests.
PICTURES = 2000
SHARD_SIZE = 40
#: Pictures that cannot be decoded, and one whose file is missing.
BAD = {"photos/00007", "photos/00400", "photos/01999", "photos/missing"}
OPTIONS: dict[str, Any] = {"bpp": 4.0, "effort": 1, "tune": "visual", "seed": 0}
_OBJECT_STORE = 80 << 20


def draw(index: int) -> Image.Image:
    """A picture of 24 x 16 pixels that no other index has."""
    y, x = np.mgrid[0:16, 0:24]
    waves = [
        np.sin(x / (3 + index % 7) + index) + np.cos(y / (2 + index % 5) + c) for c in range(3)
    ]
    return Image.fromarray((128 + 60 * np.stack(waves, axis=-1)).astype(np.uint8))


def make_pictures(directory: Path, count: int) -> Path:
    """Writes pictures and, last, their manifest, which names a file that is missing."""
    (directory / "photos").mkdir()
    names = [f"photos/{index:05}.png" for index in range(count)]
    for index, name in enumerate(names):
        draw(index).save(directory / name, compress_level=1)
    for key in BAD:
        path = directory / f"{key}.png"
        if path.exists():
            path.write_bytes(path.read_bytes()[:90])
    names.insert(count // 3, "photos/missing.png")
    manifest = directory / "photos.txt"
    manifest.write_text("".join(f"{name}\n" for name in names))
    return manifest


def contents(result: Path) -> dict[str, bytes]:
    """All files below a folder, but for the plan, which only a run of Ray writes."""
    return {
        path.relative_to(result).as_posix(): path.read_bytes()
        for path in result.rglob("*")
        if path.is_file() and path.name != "_dataset.json"
    }


def run_serially(
    pictures: shards.Pictures,
    out: Path,
    *,
    operation: Operation = "encode",
    options: dict[str, Any] = OPTIONS,
    container: Container = "parquet",
    shard_size: int = SHARD_SIZE,
) -> Path:
    """Makes one shard after the other in this process."""
    found = shards.read(pictures, shard_size, may_be_packed=operation != "encode")
    folder.begin(out, {"serial": True})
    job = Job(operation, options, out, container, found.packed)
    for shard in found.shards:
        job.perform(shard)
    return out


@dataclass(frozen=True)
class DataSet:
    """Pictures, and what a serial run makes of them."""

    manifest: Path
    keys: list[str]
    expected: dict[str, bytes]


@pytest.fixture(scope="session")
def data_set(tmp_path_factory: pytest.TempPathFactory) -> DataSet:
    directory = tmp_path_factory.mktemp("data")
    manifest = make_pictures(directory, PICTURES)
    keys = [line.removesuffix(".png") for line in manifest.read_text().splitlines()]
    return DataSet(manifest, keys, contents(run_serially(manifest, directory / "serial")))


def add_worker(cluster: Cluster) -> Any:
    """A worker node with one core."""
    return cluster.add_node(
        num_cpus=1, object_store_memory=_OBJECT_STORE, node_ip_address="127.0.0.1"
    )


@pytest.fixture(scope="session")
def cluster() -> Iterator[Cluster]:
    """A head without cores, and two workers. A test that takes one away adds another."""
    cluster = Cluster(
        initialize_head=True,
        head_node_args={
            "num_cpus": 0,
            "object_store_memory": _OBJECT_STORE,
            "node_ip_address": "127.0.0.1",
            "include_dashboard": False,
        },
    )
    try:
        add_worker(cluster)
        add_worker(cluster)
        yield cluster
    finally:
        cluster.shutdown()  # type: ignore[no-untyped-call]
