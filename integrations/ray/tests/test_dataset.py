"""The functions of image_gip.ray, on a cluster, and the recipes that use them."""

from __future__ import annotations

import logging
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import ray
from conftest import OPTIONS, contents, draw, make_pictures, run_serially
from ray.cluster_utils import Cluster

from image_gip._dataset import folder
from image_gip.ray import Summary, decode_dataset, encode_dataset, thumbnail_dataset

ROOT = Path(__file__).resolve().parents[3]
RECIPES = [
    code
    for page in ("docs/python.md", "integrations/ray/README.md")
    for code in re.findall(r"^```python\n(.*?)^```", (ROOT / page).read_text(), re.M | re.S)
    if "image_gip.ray" in code
]


@pytest.fixture
def connected(cluster: Cluster) -> Iterator[None]:
    ray.init(cluster.address, log_to_driver=False, logging_level=logging.ERROR)
    try:
        yield
    finally:
        ray.shutdown()


@pytest.mark.usefixtures("connected")
def test_there_and_back(tmp_path: Path) -> None:
    manifest = make_pictures(tmp_path, 12)
    encoded = tmp_path / "encoded"

    def encode() -> Summary:
        return encode_dataset(
            manifest, encoded.as_uri(), container="webdataset", shard_size=5, bpp=4, effort=1
        )

    assert encode() == Summary(shards=3, skipped=0, bad=2)
    serial = run_serially(manifest, tmp_path / "serial", container="webdataset", shard_size=5)
    assert contents(encoded) == contents(serial)
    assert encode() == Summary(shards=3, skipped=3, bad=2)

    tars = sorted(encoded.glob("*.tar"))
    assert decode_dataset(tars, tmp_path / "decoded") == Summary(3, 0, 0)
    serial = run_serially(
        tars, tmp_path / "serially", operation="decode", options={"format": "png"}
    )
    assert contents(tmp_path / "decoded") == contents(serial)

    # A manifest of shards.
    (tmp_path / "tars.txt").write_text("".join(f"{tar}\n" for tar in tars))
    out = tmp_path / "thumbnails"
    assert thumbnail_dataset(tmp_path / "tars.txt", out, size=(9, 9)) == Summary(3, 0, 0)
    options = {"size": [9, 9], "format": "png"}
    serial = run_serially(tars, tmp_path / "small", operation="thumbnail", options=options)
    assert contents(out) == contents(serial)


def test_wrong_arguments_are_refused_at_once(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with pytest.raises(ValueError, match="effort"):
        encode_dataset(["a.png"], out, effort=0)
    with pytest.raises((TypeError, ValueError), match=r"bpp|target"):
        encode_dataset(["a.png"], out, bpp=1, quality=50)
    with pytest.raises(ValueError, match="container"):
        encode_dataset(["a.png"], out, container="zip")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="format"):
        decode_dataset(["a.gip"], out, format="gif")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="size"):
        thumbnail_dataset(["a.gip"], out, size=(0, 5))
    with pytest.raises(ValueError, match="only paths and file:/// URIs"):
        encode_dataset(["a.png"], "s3://bucket/out")
    with pytest.raises(FileNotFoundError):
        encode_dataset(tmp_path / "missing.txt", out)
    assert not out.exists()
    assert not ray.is_initialized()


def test_other_options_need_another_folder(tmp_path: Path) -> None:
    draw(1).save(tmp_path / "a.png")
    out = tmp_path / "out"
    folder.begin(out, {"operation": "encode", "options": OPTIONS})
    with pytest.raises(ValueError, match="other image_gip, options, container"):
        encode_dataset([tmp_path / "a.png"], out, effort=2)


def test_the_module_is_light() -> None:
    code = (
        "import sys, image_gip, image_gip.pillow\n"
        "assert not {'ray', 'pyarrow', 'pandas'} & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_recipes_run(cluster: Cluster, tmp_path: Path) -> None:
    assert len(RECIPES) == 2
    environment = os.environ | {"RAY_ADDRESS": cluster.address}
    for number, code in enumerate(RECIPES):
        room = tmp_path / f"{number}"
        (room / "photos").mkdir(parents=True)
        names = [f"photos/{index}.png" for index in range(3)]
        for index, name in enumerate(names):
            draw(index).save(room / name)
        (room / "photos.txt").write_text("".join(f"{name}\n" for name in names))
        subprocess.run([sys.executable, "-c", code], cwd=room, env=environment, check=True)
        assert list((room / "encoded").glob("*.parquet"))
        assert list((room / "thumbnails").glob("*.tar"))
