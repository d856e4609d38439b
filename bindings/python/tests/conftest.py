"""What the tests share: the test vectors, a picture, a file of it, the tool."""

import io
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import image_gip
import image_gip.pillow

ROOT = Path(__file__).resolve().parents[3]
VECTORS = ROOT / "spec" / "vectors"

Picture = NDArray[np.uint8]


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
def tool() -> Path:
    """The command line tool: the one that GIP names, or that of a release build."""
    named = os.environ.get("GIP")
    path = Path(named) if named else ROOT / "target" / "release" / "gip"
    if not named and not path.exists():
        pytest.skip("there is no gip: cargo build --release --features cli")
    return path
