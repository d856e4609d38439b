"""Every line of `spec/vectors/index.tsv`."""

import re
import zlib
from typing import Any, NamedTuple

import numpy as np
import pytest
from conftest import VECTORS
from numpy.typing import NDArray

import image_gip
from image_gip import StreamDecoder

MODES = {"GrayAlpha": "LA", "Rgb": "RGB", "Rgba": "RGBA"}
KINDS = {
    "signature": image_gip.SignatureError,
    "malformed": image_gip.MalformedError,
    "unsupported": image_gip.UnsupportedError,
    "unexpected end": image_gip.UnexpectedEndError,
}


class Line(NamedTuple):
    """A line of the index."""

    name: str
    rendering: str
    result: str

    @property
    def file(self) -> bytes:
        return (VECTORS / self.name).read_bytes()


LINES = [
    Line(*line.split("\t")[:3]) for line in (VECTORS / "index.tsv").read_text().splitlines()[1:]
]
SOUND = [line for line in LINES if line.rendering not in ("error", "skips")]
SKIPPING = [line for line in LINES if line.rendering == "skips"]
REFUSED = [line for line in LINES if line.rendering == "error"]


def crc(samples: NDArray[Any]) -> str:
    """The CRC of the index: 16-bit samples have their more significant byte first."""
    stored = samples.astype(">u2") if samples.dtype == np.uint16 else samples
    return f"{zlib.crc32(stored.tobytes()):08x}"


def options(rendering: str) -> dict[str, Any]:
    """The keywords for a rendering."""
    found: dict[str, Any] = {}
    if size := re.search(r"size (\d+)x(\d+)", rendering):
        found["size"] = (int(size[1]), int(size[2]))
    if region := re.search(r"region (\d+)x(\d+) at (\d+),(\d+)", rendering):
        width, height, x, y = map(int, region.groups())
        found["region"] = (x, y, width, height)
    if model := re.fullmatch(r"as (\w+)", rendering):
        found["mode"] = MODES[model[1]]
    if first := re.fullmatch(r"first (\d+)", rendering):
        found["prefix"] = int(first[1])
    if rendering == "without texture":
        found["texture"] = False
    assert found or rendering == "whole", rendering
    return found


def test_the_index_is_read() -> None:
    assert len(SOUND) > 60
    assert len(SKIPPING) > 40
    assert len(REFUSED) > 60


@pytest.mark.parametrize("line", SOUND, ids=lambda line: f"{line.name}-{line.rendering}")
def test_samples(line: Line) -> None:
    keywords = options(line.rendering)
    stream = StreamDecoder()
    for byte in line.file:
        stream.feed(bytes([byte]))
    stream.finish()
    for threads in (1, 2):
        assert crc(stream.image(**keywords, threads=threads)) == line.result
    if "prefix" in keywords:
        return
    samples = image_gip.decode(line.file, **keywords)
    assert crc(samples) == line.result
    assert crc(image_gip.decode(line.file, **keywords, threads=2)) == line.result
    out = np.full_like(samples, 7)
    assert image_gip.decode(line.file, **keywords, out=out) is out
    assert crc(out) == line.result


@pytest.mark.parametrize("line", SKIPPING, ids=lambda line: line.name)
def test_what_is_skipped(line: Line) -> None:
    found = image_gip.info(line.file).skipped
    assert " ".join(chunk for chunk, _ in found) == line.result


@pytest.mark.parametrize("line", REFUSED, ids=lambda line: line.name)
def test_errors(line: Line) -> None:
    what, kept = line.result.split("; ")
    kind = next(kind for kind in KINDS if what.startswith(kind))
    chunk = what.removeprefix(kind).strip() or None
    stream = StreamDecoder()
    for read in (
        lambda: image_gip.decode(line.file),
        lambda: image_gip.info(line.file),
        lambda: image_gip.gaussians(line.file),
        lambda: stream.feed(line.file).finish(),
    ):
        with pytest.raises(KINDS[kind]) as raised:
            read()
        assert raised.value.chunk == chunk
    assert f"{stream.arrived} kept" == kept
