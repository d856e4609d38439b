"""Parts of pictures at the size that a network takes, as arrays: what `image_gip.torch` draws."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from operator import index
from os import PathLike, fspath
from typing import Any, NamedTuple, SupportsIndex, TypeAlias

import numpy as np
from numpy.typing import DTypeLike, NDArray

from image_gip._errors import GipError
from image_gip._native import decode, read_header
from image_gip._types import Limits, Mode

#: A file: bytes or any other buffer, a path, or a binary file object.
Source: TypeAlias = Any
#: Random numbers.
Draws: TypeAlias = Sequence[float] | NDArray[np.float64]
#: Height and width in pixels.
Size: TypeAlias = tuple[int, int]

#: How often a random crop is drawn anew that does not fit into its picture.
_TRIES = 10
#: Random numbers that a random crop takes: area and ratio of each try, place, flip.
DRAWS = 2 * _TRIES + 3


class Crop(NamedTuple):
    """A part of a picture, in pixels of its stored size, which may have fractions."""

    top: float
    left: float
    height: float
    width: float
    #: Whether the result is mirrored, left to right.
    flip: bool = False


class Rendering(NamedTuple):
    """What of a crop is the same for all pictures."""

    mode: Mode
    background: float | Sequence[float] | None
    texture: bool
    limits: Limits | None


def check_size(size: SupportsIndex | Sequence[SupportsIndex]) -> Size:
    """Height and width; one number is both.

    Raises:
        ValueError: It is not one or two whole numbers of at least 1.
    """
    sides = (size, size) if isinstance(size, SupportsIndex) else tuple(size)
    if len(sides) != 2 or not all(isinstance(s, SupportsIndex) and index(s) >= 1 for s in sides):
        raise ValueError(f"size is {size}; it must be one or two whole numbers of at least 1")
    return index(sides[0]), index(sides[1])


def check_range(name: str, values: Sequence[float], most: float = math.inf) -> tuple[float, float]:
    """A range of positive numbers, from the least to the greatest."""
    if len(values) != 2 or not 0 < values[0] <= values[1] <= most:
        raise ValueError(f"{name} is {values}; it must be two numbers over 0, the lesser one first")
    return values[0], values[1]


def random_resized(
    stored: Size,
    scale: tuple[float, float],
    ratio: tuple[float, float],
    flip: float,
    draws: Draws,
) -> Crop:
    """A crop of random area, aspect and place.

    The distribution is that of torchvision's ``RandomResizedCrop``: area uniform, logarithm of the
    aspect uniform, and after ten that do not fit the largest one in the middle whose aspect is
    allowed.

    Args:
        stored: Height and width of the picture.
        scale: The least and the greatest area, as a share of the picture's.
        ratio: The least and the greatest aspect, width by height.
        flip: The probability that it is mirrored.
        draws: `DRAWS` random numbers, each 0 to 1.
    """
    height, width = stored
    mirrored = draws[-1] < flip
    low, high = (math.log(aspect) for aspect in ratio)
    for attempt in range(_TRIES):
        area = height * width * (scale[0] + (scale[1] - scale[0]) * draws[2 * attempt])
        aspect = math.exp(low + (high - low) * draws[2 * attempt + 1])
        columns, rows = round(math.sqrt(area * aspect)), round(math.sqrt(area / aspect))
        if 0 < columns <= width and 0 < rows <= height:
            top, left = (height - rows) * draws[-3], (width - columns) * draws[-2]
            return Crop(top, left, rows, columns, mirrored)
    aspect = min(max(width / height, ratio[0]), ratio[1])
    wide, tall = min(width, height * aspect), min(height, width / aspect)
    return Crop((height - tall) / 2, (width - wide) / 2, tall, wide, mirrored)


def centered(stored: Size, size: Size, resize: int) -> Crop:
    """The middle of a picture: `size` pixels of it where its shorter side has `resize`."""
    height, width = stored
    pixel = min(height, width) / resize
    tall, wide = size[0] * pixel, size[1] * pixel
    return Crop((height - tall) / 2, (width - wide) / 2, tall, wide)


def read(src: Source) -> Any:
    """The bytes of a file: of a path or a file object, or the buffer itself.

    Raises:
        TypeError: It is none of these.
    """
    if isinstance(src, str | PathLike):
        with open(fspath(src), "rb") as file:  # noqa: PTH123
            return file.read()
    contents = src.read() if hasattr(src, "read") else src
    try:
        memoryview(contents)
    except TypeError:
        found = type(src).__name__
        message = f"a file must be bytes, a path or a binary file object, not {found}"
        raise TypeError(message) from None
    return contents


def stored_size(file: Any, limits: Limits | None) -> Size:
    """Height and width of the picture in a file, of which no more than the header is read."""
    header = read_header(io.BytesIO(file), limits=limits)
    assert header is not None, "it is there, or there was an error"
    return header.height, header.width


def _axis(start: float, length: float, stored: int, pixels: int) -> tuple[int, int]:
    """One side of a crop: pixels of the whole picture, and the first one of the crop among them.

    Both are whole numbers, so that a crop is off by less than a pixel of the result.
    """
    whole = max(pixels, round(stored * pixels / length))
    return whole, min(max(round(start * whole / stored), 0), whole - pixels)


def render(
    file: Any,
    stored: Size,
    crop: Crop,
    size: Size,
    rendering: Rendering,
    *,
    dtype: DTypeLike | None = None,
    out: NDArray[Any] | None = None,
    planar: bool = True,
) -> NDArray[Any]:
    """A crop with `size` pixels, as `image_gip.decode` returns or fills it, but not yet mirrored.

    Raises:
        GipError: The file was refused.
        ValueError: `out` does not fit, or the crop is not inside the picture.
    """
    for start, length, side in zip(crop[:2], crop[2:4], stored, strict=True):
        # Sums of floats may be off by their last digit.
        slack = 1e-9 * side
        if not (length > 0 and start >= -slack and start + length <= side + slack):
            raise ValueError(f"{crop} is not inside the picture of height and width {stored}")
    (height, top), (width, left) = (
        _axis(start, length, side, pixels)
        for start, length, side, pixels in zip(crop[:2], crop[2:4], stored, size, strict=True)
    )
    samples = decode(
        file,
        size=(width, height),
        region=(left, top, size[1], size[0]),
        mode=rendering.mode,
        background=rendering.background,
        planar=planar,
        dtype=dtype,
        out=out,
        texture=rendering.texture,
        limits=rendering.limits,
    )
    if samples.dtype == np.float32:
        # What is outside shows nowhere, and networks are trained on what shows.
        samples.clip(0, 1, out=samples)
    return samples


def name_source(error: GipError, src: Source) -> None:
    """Adds to an error in which file it is, where that is known."""
    if isinstance(src, str | PathLike):
        error.add_note(f"in {fspath(src)!r}")
