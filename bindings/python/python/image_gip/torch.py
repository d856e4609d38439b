"""Reads ``.gip`` for training with PyTorch: any part at any size, as tensors.

    import image_gip.torch
    crop = image_gip.torch.RandomResizedCrop(224, flip=0.5)
    tensor = crop("photo.gip")  # 3 x 224 x 224 samples of uint8

A picture of Gaussians is rendered at the size of the result: what is outside of a crop is not
decoded, and no pixels are resampled. A smaller one is the average by area.

Transforms take a file: bytes or any other buffer, a path, or a binary file object. As in
torchvision, a size is (height, width), and tensors are channels x height x width: uint8 of 0 to
255, or float32 of 0.0 to 1.0. Random numbers are torch's, so that ``torch.manual_seed`` and the
seeds of a ``DataLoader``'s workers hold. Transforms can be pickled, and release the interpreter
lock while they decode. Pictures are as they are stored: `image_gip.info` has their orientation.
Tensors are in the memory of the CPU, whatever torch's default device is.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from operator import index
from os import PathLike
from typing import Any, Literal, NamedTuple, SupportsIndex

import torch

from image_gip import _crops
from image_gip._crops import Crop, Draws, Rendering, Size, Source
from image_gip._errors import GipError
from image_gip._types import Limits, Mode

__all__ = [
    "Batch",
    "CenterCrop",
    "Columns",
    "Crop",
    "Extension",
    "RandomResizedCrop",
    "Resize",
    "Transform",
    "decode_batch",
]

#: Channels of the modes.
_CHANNELS: dict[str, int] = {"L": 1, "LA": 2, "RGB": 3, "RGBA": 4}


class Transform:
    """What the transforms of this module have in common: from a file to a tensor.

    A class of your own overrides `crop`, and `draw` if it is random.

    Args:
        size: Height and width of the result in pixels, or one number for both.
        mode: "RGB", "RGBA", "L" or "LA", as for `image_gip.decode`: gray becomes RGB, and pictures
            with alpha are composed over the background; "L" and "LA" take gray pictures alone.
        background: What is behind a picture with alpha, in the units of the result: one number, or
            one for each channel. Default: white.
        dtype: torch.uint8, or torch.float32, clamped to 0.0 to 1.0.
        texture: Whether texture is rendered.
        limits: What a file may cost at most. Default: Limits().

    Raises:
        ValueError: An argument is out of range.
    """

    def __init__(
        self,
        size: SupportsIndex | Sequence[SupportsIndex],
        *,
        mode: Mode = "RGB",
        background: float | Sequence[float] | None = None,
        dtype: torch.dtype = torch.uint8,
        texture: bool = True,
        limits: Limits | None = None,
    ) -> None:
        if mode not in _CHANNELS:
            raise ValueError(f'mode is {mode!r}; it must be "L", "LA", "RGB" or "RGBA"')
        self.size = _crops.check_size(size)
        self.dtype = _checked(dtype)
        self.rendering = Rendering(mode, background, texture, limits)

    def draw(self) -> Draws:
        """The random numbers for one picture."""
        return ()

    def crop(self, stored: Size, draws: Draws) -> Crop:
        """The part that is shown of a picture of this stored height and width, inside of it."""
        return Crop(0, 0, *stored)

    def output_size(self, stored: Size) -> Size:
        """Height and width of the result for a picture of this stored height and width."""
        return self.size

    def __call__(self, src: Source, *, out: torch.Tensor | None = None) -> torch.Tensor:
        """The crop of a file.

        Args:
            src: The file.
            out: The tensor to decode into, of the shape of the result: uint8 or float32, in the
                memory of the CPU, pinned or not, contiguous or in ``torch.channels_last``.

        Raises:
            GipError: The file was refused; its subclasses say why.
            OSError: The file cannot be read.
            ValueError: `out` does not fit, the mode lacks a channel of the picture, or the crop is
                not inside of it.
        """
        return self._apply(src, self.draw(), out)

    def _apply(self, src: Source, draws: Draws, out: torch.Tensor | None) -> torch.Tensor:
        try:
            file = _crops.read(src)
            stored = _crops.stored_size(file, self.rendering.limits)
            crop, size = self.crop(stored, draws), self.output_size(stored)
            tensor = self._empty(size) if out is None else out
            planar = tensor.is_contiguous()
            # The memory of the tensor, in its order.
            memory = (tensor if planar else tensor.permute(1, 2, 0)).detach().numpy()
            _crops.render(file, stored, crop, size, self.rendering, out=memory, planar=planar)
        except GipError as error:
            _crops.name_source(error, src)
            raise
        return tensor.copy_(tensor.flip(-1)) if crop.flip else tensor

    def _empty(self, size: Size) -> torch.Tensor:
        shape = (_CHANNELS[self.rendering.mode], *size)
        return torch.empty(shape, dtype=self.dtype, device="cpu")


class RandomResizedCrop(Transform):
    """A part of random area, aspect and place, as torchvision's transform of that name has them.

    Args:
        size: Height and width of the result in pixels, or one number for both.
        scale: The least and the greatest share of the picture's area.
        ratio: The least and the greatest aspect of the part, width by height.
        flip: The probability that the result is mirrored, left to right: 0 to 1.
        generator: What makes the random numbers. Default: torch's own. The workers of a
            ``DataLoader`` have copies of it, which all make the same ones.
        **options: Those of `Transform`.

    Raises:
        ValueError: An argument is out of range.
    """

    def __init__(
        self,
        size: SupportsIndex | Sequence[SupportsIndex],
        scale: Sequence[float] = (0.08, 1.0),
        ratio: Sequence[float] = (3 / 4, 4 / 3),
        *,
        flip: float = 0.0,
        generator: torch.Generator | None = None,
        **options: Any,
    ) -> None:
        super().__init__(size, **options)
        self.scale = _crops.check_range("scale", scale, 1.0)
        self.ratio = _crops.check_range("ratio", ratio)
        if not 0 <= flip <= 1:
            raise ValueError(f"flip is {flip}; it must be 0 to 1")
        self.flip, self.generator = flip, generator

    def draw(self) -> Draws:
        numbers = torch.rand(_crops.DRAWS, generator=self.generator, device="cpu")
        drawn: list[float] = numbers.tolist()
        return drawn

    def crop(self, stored: Size, draws: Draws) -> Crop:
        return _crops.random_resized(stored, self.scale, self.ratio, self.flip, draws)


class CenterCrop(Transform):
    """The middle of a picture: torchvision's ``Resize(resize)`` and ``CenterCrop(size)``.

    Args:
        size: Height and width of the result in pixels, or one number for both.
        resize: The pixels of the picture's shorter side, of which `size` are shown: at least as
            many. Default: the larger number of `size`.
        **options: Those of `Transform`.

    Raises:
        ValueError: An argument is out of range.
    """

    def __init__(
        self,
        size: SupportsIndex | Sequence[SupportsIndex],
        resize: int | None = None,
        **options: Any,
    ) -> None:
        super().__init__(size, **options)
        self.resize = max(self.size) if resize is None else resize
        if self.resize < max(self.size):
            raise ValueError(f"resize is {resize}; it must be at least {max(self.size)}")

    def crop(self, stored: Size, draws: Draws) -> Crop:
        return _crops.centered(stored, self.size, self.resize)


class Resize(Transform):
    """The whole picture.

    Args:
        size: Height and width of the result in pixels; or one number for the shorter side, where
            the other one follows from the picture.
        **options: Those of `Transform`.

    Raises:
        ValueError: An argument is out of range.
    """

    def __init__(self, size: SupportsIndex | Sequence[SupportsIndex], **options: Any) -> None:
        super().__init__(size, **options)
        self.shorter = index(size) if isinstance(size, SupportsIndex) else None

    def output_size(self, stored: Size) -> Size:
        if self.shorter is None:
            return self.size
        height, width = (max(1, side * self.shorter // min(stored)) for side in stored)
        return height, width


class Batch(NamedTuple):
    """Pictures that were decoded together."""

    #: pictures x channels x height x width
    images: torch.Tensor
    #: Why pictures could not be decoded, by their index. They are zeros in `images`.
    errors: dict[int, GipError | OSError]


def decode_batch(
    sources: Iterable[Source],
    transform: Transform,
    *,
    out: torch.Tensor | None = None,
    threads: int = 1,
    errors: Literal["raise", "return"] = "raise",
) -> Batch:
    """Decodes files into one tensor.

    Random numbers are drawn in the order of the files, so that the result does not depend on the
    number of threads.

    Args:
        sources: The files.
        transform: The transform, whose results have one size.
        out: The tensor to decode into, of the shape of the result: uint8 or float32, in the memory
            of the CPU, pinned or not, contiguous or in ``torch.channels_last``.
        threads: The number of threads, at least 1. With 1, all is done on the caller's.
        errors: What to do with a file that is refused or cannot be read: "raise" its error, or
            "return" them all. Other errors are raised. All say which picture it is.

    Returns:
        The pictures, in a new tensor or `out`, and the errors.

    Raises:
        GipError: A file was refused, and `errors` is "raise".
        OSError: A file cannot be read, and `errors` is "raise".
        ValueError: `out` does not fit, results differ in size, a picture lacks what the mode has,
            or an argument is out of range.
        TypeError: A file is none.
    """
    if errors not in ("raise", "return"):
        raise ValueError(f'errors is {errors!r}; it must be "raise" or "return"')
    if threads < 1:
        raise ValueError(f"threads is {threads}; it must be at least 1")
    if _is_file(sources):
        raise TypeError("sources is one file; it must be several")
    files = list(sources)
    if isinstance(transform, Resize) and transform.shorter is not None:
        raise ValueError("the results of Resize with one number differ in size")
    if out is None:
        one = transform._empty(transform.size)
        out = torch.empty((len(files), *one.shape), dtype=one.dtype, device="cpu")
    elif out.ndim != 4 or len(out) != len(files):
        shape = tuple(out.shape)
        raise ValueError(f"out has shape {shape}; it must be that of {len(files)} pictures")
    elif _shares_memory(out):
        raise ValueError(
            "the pictures of out share memory; they need a tensor that is not expanded"
        )
    draws = [transform.draw() for _ in files]

    def one_of(number: int) -> GipError | OSError | None:
        try:
            transform._apply(files[number], draws[number], out[number])
        except Exception as error:
            error.add_note(f"picture {number} of {len(files)}")
            if not isinstance(error, GipError | OSError):
                raise
            out[number] = 0
            return error
        return None

    if threads == 1:
        found = list(map(one_of, range(len(files))))
    else:
        with ThreadPoolExecutor(threads) as pool:
            found = list(pool.map(one_of, range(len(files))))
    failed = {number: error for number, error in enumerate(found) if error is not None}
    if failed and errors == "raise":
        raise next(iter(failed.values()))
    return Batch(out, failed)


@dataclass(frozen=True)
class Extension:
    """Decodes the ``.gip`` members of a WebDataset: give it to its method ``decode``.

    ``webdataset.WebDataset("train-{0000..0099}.tar").decode(Extension(transform))``
    """

    #: What makes a tensor of a file.
    transform: Transform

    def __call__(self, key: str, data: bytes) -> torch.Tensor | None:
        """The tensor of a member; None if its extension is another."""
        extension = key.rpartition(".")[2].lower()
        return self.transform(data) if extension == "gip" else None


@dataclass(frozen=True)
class Columns:
    """Decodes columns of a Hugging Face data set: give it to its method ``set_transform``.

    A column holds files as the features ``Image(decode=False)``, ``Binary`` or strings of paths
    have them. ``dataset.cast_column("image", datasets.Image(decode=False))`` makes the first of
    what would be decoded by Pillow.
    """

    #: What makes a tensor of a file, by the name of the column.
    transforms: Mapping[str, Transform]

    def __call__(self, rows: Mapping[str, list[Any]]) -> dict[str, list[Any]]:
        """The rows, with tensors in these columns."""
        decoded = dict(rows)
        for name, transform in self.transforms.items():
            if name in rows:
                decoded[name] = [transform(_file(value)) for value in rows[name]]
        return decoded


def _file(value: Any) -> Source:
    """The file in a cell of a data set."""
    if isinstance(value, Mapping):
        return value["path"] if value.get("bytes") is None else value["bytes"]
    return value


def _is_file(sources: Any) -> bool:
    """Whether this is one file, of whose bytes or lines each would be taken for a file."""
    if isinstance(sources, str | PathLike) or hasattr(sources, "read"):
        return True
    try:
        return memoryview(sources).format in ("B", "b", "c")
    except TypeError:
        return False


def _shares_memory(pictures: torch.Tensor) -> bool:
    """Whether a picture begins before the end of the one before it."""
    samples = pictures.detach().numpy()
    return len(samples) > 1 and samples.strides[0] < samples[0].nbytes


def _checked(dtype: torch.dtype) -> torch.dtype:
    if dtype not in (torch.uint8, torch.float32):
        raise ValueError(f"dtype is {dtype}; it must be torch.uint8 or torch.float32")
    return dtype
