"""A cluster that loses a node, and a driver that is killed: the result is that of a serial run."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pyarrow.parquet
from conftest import BAD, OPTIONS, SHARD_SIZE, DataSet, add_worker, contents
from ray.cluster_utils import Cluster

#: After so many seconds, a run is taken to hang.
PATIENCE = 100

DRIVER = """
import json, sys
import ray, ray.data
import image_gip.ray

address, manifest, out, arguments = sys.argv[1:]
ray.init(address, log_to_driver=False, logging_level="error")
ray.data.DataContext.get_current().enable_progress_bars = False
summary = image_gip.ray.encode_dataset(manifest, out, **json.loads(arguments))
print("\\nsummary", summary.shards, summary.skipped, summary.bad)
"""


def start(cluster: Cluster, data_set: DataSet, out: Path) -> subprocess.Popen[str]:
    arguments = json.dumps(OPTIONS | {"shard_size": SHARD_SIZE})
    command = [sys.executable, "-c", DRIVER, cluster.address, data_set.manifest, out, arguments]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


def finish(driver: subprocess.Popen[str]) -> tuple[int, int, int]:
    """The shards, those that were skipped, and the bad pictures."""
    output, _ = driver.communicate(timeout=PATIENCE)
    assert driver.returncode == 0
    # Ray prints as well.
    (line,) = [line for line in output.splitlines() if line.startswith("summary ")]
    shards, skipped, bad = map(int, line.split()[1:])
    return shards, skipped, bad


def wait_until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def done(out: Path) -> int:
    return len(list(out.glob("*.parquet")))


def total(data_set: DataSet) -> int:
    return sum(name.endswith(".parquet") for name in data_set.expected)


def assert_complete(out: Path, data_set: DataSet) -> None:
    found = contents(out)
    assert not [name for name in found if name.endswith(".tmp")]
    # Byte for byte; and names first, for a report that can be read.
    assert sorted(found) == sorted(data_set.expected)
    assert found == data_set.expected
    # The keys of the input, each once.
    keys = [
        key
        for path in sorted(out.glob("*.parquet"))
        for key in pyarrow.parquet.read_table(path, columns=["key"])["key"].to_pylist()
    ]
    errors = [
        json.loads(line)
        for path in (out / "_errors").iterdir()
        for line in path.read_text().splitlines()
    ]
    assert {error["key"] for error in errors} == BAD
    assert all(error["path"].endswith(f"{error['key']}.png") for error in errors)
    assert all(error["error"] for error in errors)
    assert sorted(keys + [error["key"] for error in errors]) == sorted(data_set.keys)
    assert len(set(keys)) == len(keys) == len(data_set.keys) - len(BAD)


def test_a_node_is_lost_and_another_comes(
    cluster: Cluster, data_set: DataSet, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    driver = start(cluster, data_set, out)
    try:
        wait_until(lambda: done(out) >= total(data_set) / 3)
        lost = min(cluster.worker_nodes, key=lambda node: str(node.unique_id))
        cluster.remove_node(lost, allow_graceful=False)
        at_loss = done(out)
        add_worker(cluster)
        summary = finish(driver)
    finally:
        driver.kill()
    # Otherwise, this was no test.
    assert at_loss < total(data_set)
    assert summary == (total(data_set), 0, len(BAD))
    assert_complete(out, data_set)


def test_the_driver_is_killed_and_runs_again(
    cluster: Cluster, data_set: DataSet, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    driver = start(cluster, data_set, out)
    try:
        wait_until(lambda: done(out) >= total(data_set) / 3)
    finally:
        driver.send_signal(signal.SIGKILL)
        driver.communicate()
    at_death = done(out)
    assert at_death < total(data_set)
    # What a task leaves that dies in the middle of writing.
    leftover = out / ".shard-000049.parquet.0123456789abcdef.gip.tmp"
    leftover.write_bytes(b"PAR1")
    shards, skipped, bad = finish(start(cluster, data_set, out))
    assert (shards, bad) == (total(data_set), len(BAD))
    assert at_death <= skipped < total(data_set)
    assert_complete(out, data_set)
    # Again, with nothing left to do.
    before = {path: path.stat().st_mtime_ns for path in out.glob("*.parquet")}
    assert finish(start(cluster, data_set, out)) == (total(data_set), total(data_set), len(BAD))
    assert before == {path: path.stat().st_mtime_ns for path in out.glob("*.parquet")}
