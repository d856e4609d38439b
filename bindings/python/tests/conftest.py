"""What the tests share: the test vectors, a picture, a file of it, the tool."""

import importlib.util
import io
import os
import sys
import zlib
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import image_gip
import image_gip.pillow

ROOT = Path(__file__).resolve().parents[3]
VECTORS = ROOT / "spec" / "vectors"
#: Where there is as much of torch as is needed, for machines without it.
STAND_IN = Path(__file__).parent / "stand_in"
HAS_TORCH = importlib.util.find_spec("torch") is not None

if not HAS_TORCH:
    sys.path.append(str(STAND_IN))

Picture = NDArray[np.uint8]

#: Bytes of the signature of a file, and of its last chunk.
SIGNATURE = 8
LEAST_CHUNK = 6


class Chunk(NamedTuple):
    """A chunk of a file (specification, section 4.2)."""

    kind: str
    payload: bytes

    @property
    def bytes(self) -> bytes:
        length, rest = bytearray(), len(self.payload)
        while rest > 127:
            length.append(rest % 128 + 128)
            rest //= 128
        body = self.kind.encode() + bytes([*length, rest]) + self.payload
        return body + zlib.crc32(body).to_bytes(4, "little")


def chunks(file: bytes) -> list[Chunk]:
    """The chunks of a file."""
    found, at = [], SIGNATURE
    while at < len(file):
        letters = 4 if file[at : at + 1].islower() else 1
        kind, at = file[at : at + letters].decode(), at + letters
        length = shift = 0
        while file[at] > 127:
            length, shift, at = length + (file[at] % 128 << shift), shift + 7, at + 1
        length, at = length + (file[at] << shift), at + 1
        found.append(Chunk(kind, file[at : at + length]))
        at += length + 4
    assert joined(found) == file
    return found


def joined(parts: list[Chunk]) -> bytes:
    """The file of these chunks."""
    return b"\xc7GIP\r\n\x01\n" + b"".join(part.bytes for part in parts)


def moved(file: bytes, *kinds: str) -> bytes:
    """The file with its chunks of these types behind the last layer."""
    parts = chunks(file)
    late = [part for part in parts if part.kind in kinds]
    assert late
    return joined([part for part in parts[:-1] if part not in late] + late + parts[-1:])


def draw(width: int, height: int, channels: int) -> Picture:
    """A picture with smooth and with sharp parts: height x width x channels."""
    y, x = np.mgrid[0:height, 0:width]
    samples = np.empty((height, width, channels), np.uint8)
    for channel in range(channels):
        waves = np.sin(x / (7 + channel)) * np.cos(y / (5 + 2 * channel))
        disc = np.hypot(x - width / 2, y - height / 3) < height / 5
        samples[..., channel] = np.clip(128 + 70 * waves + 40 * disc - 20 * channel, 0, 255)
    return samples


def saved(image: Image.Image, **options: Any) -> io.BytesIO:
    """The file that Pillow's plug-in makes of a picture, quickly."""
    file = io.BytesIO()
    image.save(file, "GIP", **{"effort": 1} | options)
    file.seek(0)
    return file


def unaligned(samples: NDArray[Any]) -> NDArray[Any]:
    """A copy of an array, at an odd address."""
    memory = np.zeros(samples.nbytes + samples.itemsize, np.uint8)
    copy = memory[1 : 1 + samples.nbytes].view(samples.dtype).reshape(samples.shape)
    copy[:] = samples
    return copy


@pytest.fixture(scope="session")
def photo() -> Picture:
    """64 x 96 x 3 samples."""
    return draw(96, 64, 3)


@pytest.fixture(scope="session")
def file(photo: Picture) -> bytes:
    """A file of `photo` with several layers."""
    return image_gip.encode(photo, bpp=4, effort=1)


@pytest.fixture(scope="session")
def textured() -> bytes:
    """A file with texture, in several layers."""
    noise = np.random.default_rng(1).normal(0, 20, (128, 192, 1))
    samples = np.clip(80 + 0.3 * draw(192, 128, 3) + noise, 0, 255).astype(np.uint8)
    file = image_gip.encode(samples, bpp=0.6, effort=1)
    assert [part.kind for part in chunks(file)].count("tXTR") == 1
    return file


@pytest.fixture(scope="session")
def tool() -> Path:
    """The command line tool: the one that GIP names, or that of a release build."""
    named = os.environ.get("GIP")
    path = Path(named) if named else ROOT / "target" / "release" / "gip"
    if not named and not path.exists():
        pytest.skip("there is no gip: cargo build --release --features cli")
    return path
