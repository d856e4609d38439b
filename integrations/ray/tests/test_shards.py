"""Manifests, keys, files and folders: what does not need a cluster."""

from __future__ import annotations

import io
import json
import os
import tarfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet
import pytest
from conftest import OPTIONS, contents, draw, make_pictures, run_serially
from PIL import Image, ImageOps

import image_gip
from image_gip._dataset import containers, folder, shards
from image_gip._dataset.work import Container, Job


@pytest.fixture
def manifest(tmp_path: Path) -> Path:
    """Of ten pictures, and one that is missing."""
    return make_pictures(tmp_path, 10)


def read(pictures: shards.Pictures, shard_size: int = 4) -> list[shards.Shard]:
    return shards.read(pictures, shard_size, may_be_packed=True).shards


def test_manifests(tmp_path: Path) -> None:
    text = tmp_path / "list.txt"
    text.write_bytes(b"a.png\r\n\nsub/b c.jpg\n/d.v2.png\n../e.png")
    found = read(text, 3)
    assert [shard["name"] for shard in found] == ["shard-000000", "shard-000001"]
    assert [shard["keys"] for shard in found] == [["a", "sub/b c", "d_v2"], ["e"]]
    assert found[0]["paths"] == [
        str(tmp_path / "a.png"),
        str(tmp_path / "sub/b c.jpg"),
        "/d.v2.png",
    ]
    assert read(text.as_uri(), 3) == found

    lines = tmp_path / "list.jsonl"
    lines.write_text(
        '{"path": "a.png", "width": 5}\n{"path": "file:///x/b%20c.png", "key": "2/\N{SNOWMAN}"}\n'
    )
    (shard,) = read(lines)
    assert shard["keys"] == ["a", "2/\N{SNOWMAN}"]
    assert shard["paths"] == [str(tmp_path / "a.png"), "/x/b c.png"]

    (shard,) = read([Path("a.png"), "b.png"])
    assert shard["paths"] == [str(Path.cwd() / "a.png"), str(Path.cwd() / "b.png")]


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("", "there are no pictures"),
        (
            '{"path": "a.png"}\n{"path": "b/../a.png", "key": "a"}',
            "line 2: the key a is there twice",
        ),
        ('{"path": "a.png"}\n{"path": "a.jpg"}', 'line 2: .* "key"'),
        ("a.png", "Expecting value"),
        ('["a.png"]', "not a JSON object"),
        ('{"key": "a"}', "no string `path`"),
        ('{"path": "a.png", "key": 5}', "`key`"),
        ('{"path": "a.png", "key": "../a"}', "line 1: '../a' cannot be a key"),
        ('{"path": "a.png", "key": "a.b"}', "without a dot"),
        ('{"path": "a.png", "key": "/a"}', "relative"),
        ('{"path": "a.png", "key": ""}', "relative"),
        ('{"path": "a.png", "key": "a\\nb"}', "control"),
        ('{"path": "a\\u0000", "key": "a"}', "cannot be a path"),
        ('{"path": "s3://bucket/a.png"}', "only paths and file:/// URIs are supported"),
        ('{"path": "file://host/a.png"}', "only paths"),
        ('{"path": "a.tar"}\n{"path": "b.png"}', "is not a shard"),
        ('{"path": "a.tar"}\n{"path": "b/a.parquet"}', "two shards of the name a"),
    ],
)
def test_bad_manifests(lines: str, message: str, tmp_path: Path) -> None:
    manifest = tmp_path / "list.jsonl"
    manifest.write_text(lines)
    with pytest.raises(ValueError, match=message):
        read(manifest)


def test_a_shard_has_a_size() -> None:
    with pytest.raises(ValueError, match="shard_size is 0"):
        read(["a.png"], 0)


def test_parquet(manifest: Path, tmp_path: Path) -> None:
    out = run_serially(manifest, tmp_path / "out", shard_size=4)
    table = pyarrow.parquet.read_table(out / "shard-000000.parquet")
    assert table.column_names == ["key", "width", "height", "bytes"]
    rows = table.to_pylist()
    # Of the four, one is missing.
    assert [row["key"] for row in rows] == [f"photos/{index:05}" for index in range(3)]
    for index, row in enumerate(rows):
        assert row["bytes"] == image_gip.encode(np.asarray(draw(index)), **OPTIONS)
        assert (row["width"], row["height"]) == (24, 16)


def test_webdataset(manifest: Path, tmp_path: Path) -> None:
    out = run_serially(manifest, tmp_path / "out", shard_size=4, container="webdataset")
    with tarfile.open(out / "shard-000000.tar") as tar:
        members = tar.getmembers()
        assert [member.name for member in members] == [
            f"photos/0000{index}.gip" for index in range(3)
        ]
        for index, member in enumerate(members):
            assert (member.mtime, member.uid, member.gid, member.mode) == (0, 0, 0, 0o644)
            assert member.uname == member.gname == ""
            file = tar.extractfile(member)
            assert file is not None
            assert file.read() == image_gip.encode(np.asarray(draw(index)), **OPTIONS)


@pytest.mark.parametrize("container", ["parquet", "webdataset"])
def test_a_second_run_writes_the_same_bytes(
    container: Container, manifest: Path, tmp_path: Path
) -> None:
    first = run_serially(manifest, tmp_path / "first", shard_size=4, container=container)
    # At another time, and by another name.
    os.utime(manifest.parent / "photos" / "00003.png", (1, 1))
    second = run_serially(manifest, tmp_path / "second", shard_size=4, container=container)
    assert contents(first) == contents(second)


def test_row_groups_are_bounded(tmp_path: Path) -> None:
    path = tmp_path / "shard.parquet"
    with path.open("wb") as file:
        writer = containers.ParquetWriter(file)
        for index in range(5):
            writer.add(f"{index}", containers.Picture(bytes(20 << 20), 1, 1))
        writer.close()
    assert pyarrow.parquet.ParquetFile(path).num_row_groups == 3
    assert [key for key, _ in containers.pictures(path)] == list("01234")


def test_bad_pictures(tmp_path: Path) -> None:
    photo = io.BytesIO()
    draw(1).save(photo, "PNG")
    pictures = {
        "cut.png": photo.getvalue()[:90],
        "empty.png": b"",
        # A format for which Pillow would start Ghostscript.
        "page.eps": b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n%%EndComments\n",
        "text.png": b"text",
        "good.png": photo.getvalue(),
    }
    for name, data in pictures.items():
        (tmp_path / name).write_bytes(data)
    (tmp_path / "folder.png").mkdir()
    os.mkfifo(tmp_path / "pipe.png")
    bad = [*list(pictures)[:-1], "folder.png", "pipe.png", "missing.png"]
    paths = [tmp_path / name for name in [*bad, "good.png"]]
    runs = [run_serially(paths, tmp_path / name) for name in ("first", "second")]
    assert contents(runs[0]) == contents(runs[1])
    errors = (runs[0] / "_errors" / "shard-000000.jsonl").read_text().splitlines()
    assert [json.loads(line)["path"] for line in errors] == [str(path) for path in paths[:-1]]
    assert [key for key, _ in containers.pictures(runs[0] / "shard-000000.parquet")] == [
        (tmp_path / "good").as_posix().lstrip("/")
    ]


def test_a_failing_file_system_is_no_bad_picture(
    manifest: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_: Path) -> bytes:
        raise OSError(5, "Input/output error")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "read_bytes", fail)
        found = read(manifest)
        job = Job("encode", OPTIONS, tmp_path, "parquet", False)
        with pytest.raises(OSError, match="Input/output"):
            job.perform(found[0])
    assert not list(tmp_path.glob("*shard*"))


def test_a_list_of_errors_goes_with_its_errors(manifest: Path, tmp_path: Path) -> None:
    out = run_serially(manifest, tmp_path / "out")
    assert folder.count_errors(out) == 2
    for name in ("missing", "00007"):
        draw(3).save(manifest.parent / "photos" / f"{name}.png")
    (out / "shard-000000.parquet").unlink()
    run_serially(manifest, out)
    assert folder.count_errors(out) == 0


def turned(exif_orientation: int) -> bytes:
    """A file of a picture of 24 x 16 pixels that is to be shown turned."""
    exif = Image.Exif()
    exif[0x0112] = exif_orientation
    file = io.BytesIO()
    draw(1).save(file, "GIP", exif=exif, effort=1)
    return file.getvalue()


@pytest.mark.parametrize("container", ["parquet", "webdataset"])
def test_decoding_shards(container: Container, manifest: Path, tmp_path: Path) -> None:
    encoded = run_serially(manifest, tmp_path / "encoded", container=container)
    inputs = sorted(encoded.glob("shard-*"))
    arguments: dict[str, Any] = {"operation": "decode", "options": {"format": "png"}}
    out = run_serially(inputs, tmp_path / "out", **arguments)
    (name,) = contents(out)
    rows = pyarrow.parquet.read_table(out / name).to_pylist()
    decoded = {row["key"]: row["bytes"] for row in rows}
    files = dict(containers.pictures(inputs[0]))
    assert list(files) == list(decoded)
    assert len(files) == 9
    for key, file in files.items():
        with Image.open(io.BytesIO(decoded[key])) as image:
            assert np.array_equal(np.asarray(image), image_gip.decode(file))


@pytest.mark.parametrize("operation", ["decode", "thumbnail"])
def test_decoded_pictures_are_upright(operation: Any, tmp_path: Path) -> None:
    (tmp_path / "a.gip").write_bytes(turned(6))
    (tmp_path / "b.gip").write_bytes(turned(1))
    (tmp_path / "c.gip").write_bytes(turned(1)[:-40])
    options: dict[str, Any] = {"format": "jpeg"}
    if operation == "thumbnail":
        options["size"] = [12, 12]
    inputs = [tmp_path / f"{name}.gip" for name in "abc"]
    out = run_serially(inputs, tmp_path / "out", operation=operation, options=options)
    rows = pyarrow.parquet.read_table(out / "shard-000000.parquet").to_pylist()
    sizes = [(16, 24), (24, 16)] if operation == "decode" else [(8, 12), (12, 8)]
    assert [(row["width"], row["height"]) for row in rows[:2]] == sizes
    for row, size in zip(rows, sizes, strict=False):
        with Image.open(io.BytesIO(row["bytes"])) as image:
            assert (image.format, image.size) == ("JPEG", size)
            assert image.getexif().get(0x0112, 1) == 1
    if operation == "decode":
        assert folder.count_errors(out) == 1


@pytest.mark.parametrize("format", ["png", "jpeg"])
def test_gray_pictures_of_16_bits(format: str, tmp_path: Path) -> None:
    gray = np.asarray(draw(1).convert("L")).astype(np.uint16) * 257
    Image.fromarray(gray).save(tmp_path / "gray.png")
    encoded = run_serially([tmp_path / "gray.png"], tmp_path / "encoded")
    ((_, file),) = containers.pictures(encoded / "shard-000000.parquet")
    assert image_gip.info(file).depth == 16
    inputs = [encoded / "shard-000000.parquet"]
    options: dict[str, Any] = {"format": format}
    out = run_serially(inputs, tmp_path / "out", operation="decode", options=options)
    (row,) = pyarrow.parquet.read_table(out / "shard-000000.parquet").to_pylist()
    with Image.open(io.BytesIO(row["bytes"])) as image:
        assert image.mode == "L"
        error = np.asarray(image).astype(int) - image_gip.decode(file, dtype=np.uint8)
    assert np.abs(error).mean() < 3


@pytest.mark.parametrize(("policy", "tags"), [("all", 2), ("safe", 1), ("none", 0)])
def test_metadata(policy: str, tags: int, tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[0x8298] = "Copyright"
    exif[0xA431] = "serial number"
    draw(1).save(tmp_path / "photo.jpg", exif=exif)
    options = OPTIONS | {"metadata": policy}
    out = run_serially([tmp_path / "photo.jpg"], tmp_path / "out", options=options)
    ((_, file),) = containers.pictures(out / "shard-000000.parquet")
    with Image.open(io.BytesIO(file)) as image:
        assert len(image.getexif()) == tags


@pytest.mark.parametrize("policy", ["all", "safe", "none"])
def test_pictures_stay_upright_without_metadata(policy: str, tmp_path: Path) -> None:
    for orientation in range(1, 9):
        exif = Image.Exif()
        exif[0x0112] = orientation
        for suffix in ("jpg", "png", "webp", "tif"):
            draw(1).save(tmp_path / f"{orientation}_{suffix}.{suffix}", exif=exif)
    # Exif that cannot be read, and some of which only the orientation can.
    draw(1).save(tmp_path / "damaged.jpg", exif=b"Exif\0\0II*\0")
    cut = b"MM\0*\0\0\0\x08\0\x02\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\x82\x98\0\x02\0\0\0\x99"
    draw(1).save(tmp_path / "cut.jpg", exif=b"Exif\0\0" + cut)
    # Pillow turns no file of which it cannot read the Exif at all.
    readable = "cut.jpg" if policy != "none" else "[cd]*.jpg"
    photos = sorted([*tmp_path.glob("[1-8]_*"), *tmp_path.glob(readable)])
    options = {"psnr": 32.0, "effort": 1, "metadata": policy}
    with warnings.catch_warnings():
        # Of the damaged Exif, and of a PSNR that is out of reach.
        warnings.simplefilter("ignore")
        encoded = run_serially(photos, tmp_path / "encoded", options=options)
        assert folder.count_errors(encoded) == 0
        files = dict(containers.pictures(encoded / "shard-000000.parquet"))
        for photo in photos:
            file = files[photo.with_suffix("").as_posix().lstrip("/")]
            with Image.open(photo) as source, Image.open(io.BytesIO(file)) as found:
                expected = ImageOps.exif_transpose(source).convert("RGB")
                shown = found if policy == "none" else ImageOps.exif_transpose(found)
                assert "exif" not in found.info or policy != "none"
                assert shown.size == expected.size, photo
                error = np.asarray(shown).astype(int) - np.asarray(expected)
                assert np.abs(error).mean() < 9, photo


@pytest.mark.parametrize("keep", [False, True])
def test_colours_that_do_not_show(keep: bool, tmp_path: Path) -> None:
    pixels = np.full((16, 24, 4), (200, 40, 90, 0), np.uint8)
    pixels[:, :12, 3] = 255
    pixels[:, 12:, :3] = (0, 250, 0)
    Image.fromarray(pixels).save(tmp_path / "photo.png")
    options = OPTIONS | {"keep_invisible": keep}
    out = run_serially([tmp_path / "photo.png"], tmp_path / "out", options=options)
    ((_, file),) = containers.pictures(out / "shard-000000.parquet")
    hidden = image_gip.decode(file, dtype=np.uint8)[8, 20]
    assert (hidden[1] > 150) == keep


def test_folders(tmp_path: Path) -> None:
    out = tmp_path / "new" / "out"
    folder.begin(out, {"effort": 1, "seed": 0})
    folder.begin(out, {"effort": 1, "seed": 0})
    with pytest.raises(ValueError, match="with other seed; choose another folder"):
        folder.begin(out, {"effort": 1, "seed": 1})
    (out / "_dataset.json").write_text("{")
    with pytest.raises(ValueError, match=r"_dataset\.json"):
        folder.begin(out, {})
    other = tmp_path / "other"
    other.mkdir()
    (other / "photo.png").touch()
    with pytest.raises(ValueError, match="not empty"):
        folder.begin(other, {})
    assert [entry.name for entry in other.iterdir()] == ["photo.png"]


def test_an_incomplete_file_leaves_nothing(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"old")

    def write() -> None:
        with folder.replacing(path) as file:
            file.write(b"new")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write()
    assert contents(tmp_path) == {"file": b"old"}
