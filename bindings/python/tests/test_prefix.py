"""Small files of the first layers of others, and the option that makes the first one small."""

import io
import subprocess
from pathlib import Path
from typing import Any

import pytest
from conftest import Chunk, Picture, chunks, joined, saved
from PIL import Image

import image_gip
from image_gip import Prefix


def test_each_prefix_is_a_file_of_the_first_layers(file: bytes) -> None:
    layers = image_gip.info(file).layers
    found = image_gip.prefixes(file)
    assert [prefix.layers for prefix in found] == list(range(1, len(layers) + 1))
    for prefix in found:
        small = image_gip.prefix(file, prefix.bytes)
        assert len(small) == prefix.bytes
        assert image_gip.info(small).layers == layers[: prefix.layers]
        assert image_gip.info(small).gaussians == prefix.gaussians
        # The beginning of the file is enough, and not one byte less.
        assert image_gip.prefixes(file[: prefix.end])[-1] == prefix
        assert prefix not in image_gip.prefixes(file[: prefix.end - 1])
    assert found[0] == Prefix(layers=1, gaussians=layers[0], bytes=found[0].bytes, end=found[0].end)
    longest = image_gip.prefix(file, 2**40)
    assert image_gip.gaussians(longest).tobytes() == image_gip.gaussians(file).tobytes()


def test_any_source(file: bytes, tmp_path: Path) -> None:
    path = tmp_path / "a.gip"
    path.write_bytes(file)
    expected = image_gip.prefixes(file)
    sources: list[Any] = [memoryview(file), path, str(path), io.BytesIO(file)]
    assert all(image_gip.prefixes(source) == expected for source in sources)
    sources[-1] = io.BytesIO(file)
    small = image_gip.prefix(file, expected[1].bytes)
    assert all(image_gip.prefix(source, len(small)) == small for source in sources)


def test_the_tools_bytes(photo: Picture, tool: Path, tmp_path: Path) -> None:
    file = image_gip.encode(photo, bpp=4, effort=1, first_layer=200, exif=b"II*\0", cicp=(12, 13))
    first = image_gip.prefixes(file)[0]
    assert 150 < first.bytes <= 200
    # Exif that does not turn the picture stands after it.
    assert [part.kind for part in chunks(file[: first.end])] == ["H", "cICP", "L"]
    small = image_gip.prefix(file, 200)
    (tmp_path / "a.gip").write_bytes(file)
    names = [str(tmp_path / name) for name in ("a.gip", "small.gip")]
    subprocess.run([tool, "prefix", names[0], "200", names[1]], check=True, capture_output=True)
    assert Path(names[1]).read_bytes() == small
    assert image_gip.info(small).cicp == (12, 13)


def test_a_first_layer_in_pillow(photo: Picture) -> None:
    file = saved(Image.fromarray(photo), first_layer=150).getvalue()
    small = image_gip.prefix(file, 150)
    with Image.open(io.BytesIO(small)) as image:
        assert image.size == (96, 64)


@pytest.mark.parametrize(
    ("size", "message"),
    [
        (79, "first_layer 79; it must be 80 to 65536"),
        (65_537, "first_layer 65537; it must be 80 to 65536"),
        (80, "a first layer that makes a file of 80 bytes; .* takes at least "),
    ],
)
def test_first_layers_that_are_refused(photo: Picture, size: int, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        image_gip.encode(photo, effort=1, first_layer=size, icc=b"a profile of more than 9 bytes")


def test_sizes_that_are_refused(file: bytes) -> None:
    least = image_gip.prefixes(file)[0].bytes
    message = f"the first layer has {least} bytes; max_bytes {least - 1} must be {least} at least"
    with pytest.raises(ValueError, match=message):
        image_gip.prefix(file, least - 1)
    with pytest.raises(ValueError, match="max_bytes -1; it must be 0 to "):
        image_gip.prefix(file, -1)
    with pytest.raises(TypeError, match="integer"):
        image_gip.prefix(file, 300.0)  # type: ignore[arg-type]


def test_files_that_are_refused(file: bytes) -> None:
    first = image_gip.prefixes(file)[0]
    header = file[: first.end - 1]
    assert image_gip.prefixes(header) == []
    with pytest.raises(image_gip.GipError, match="has no complete layer"):
        image_gip.prefix(header, 1000)
    with pytest.raises(image_gip.UnexpectedEndError):
        image_gip.prefixes(file[:20])
    with pytest.raises(image_gip.SignatureError):
        image_gip.prefix(b"GIF89a", 1000)
    # What comes after the first layer does not take it away.
    parts = chunks(file)
    layers = [part for part in parts if part.kind == "L"]
    damaged = joined([*parts[: 1 + parts.index(layers[0])], Chunk("X", b""), *parts])
    assert image_gip.prefixes(damaged) == [first]
    with pytest.raises(TypeError, match="src must be bytes-like, a path"):
        image_gip.prefixes(12)  # type: ignore[arg-type]
