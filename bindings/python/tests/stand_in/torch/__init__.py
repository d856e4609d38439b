"""As much of torch as `image_gip.torch` needs, in NumPy: for machines without torch."""

from collections.abc import Sequence
from typing import Any

import numpy as np

uint8, int32, float32 = np.dtype(np.uint8), np.dtype(np.int32), np.dtype(np.float32)
contiguous_format, channels_last = "contiguous", "channels last"


class Generator:
    def __init__(self) -> None:
        self.numbers = np.random.default_rng(0)

    def manual_seed(self, seed: int) -> "Generator":
        self.numbers = np.random.default_rng(seed)
        return self


class Tensor(np.ndarray):  # type: ignore[type-arg]
    def is_contiguous(self) -> bool:
        return self.flags.c_contiguous

    def permute(self, *axes: int) -> "Tensor":
        return self.transpose(axes)

    def detach(self) -> "Tensor":
        return self

    def numpy(self) -> Any:
        return self.view(np.ndarray)

    def flip(self, axis: int) -> "Tensor":
        return np.flip(self, axis).copy().view(Tensor)

    def copy_(self, other: "Tensor") -> "Tensor":
        self[...] = other
        return self


_default = Generator()
manual_seed = _default.manual_seed


def empty(
    shape: Sequence[int],
    dtype: Any,
    device: str = "cpu",
    memory_format: str = contiguous_format,
) -> Tensor:
    if memory_format == channels_last:
        pictures, channels, height, width = shape
        samples = np.empty((pictures, height, width, channels), dtype)
        return samples.transpose(0, 3, 1, 2).view(Tensor)
    return np.empty(shape, dtype).view(Tensor)


def rand(count: int, generator: Generator | None = None, device: str = "cpu") -> Any:
    return (generator or _default).numbers.random(count)


def equal(first: Any, second: Any) -> bool:
    return np.array_equal(first, second)


def stack(tensors: Sequence[Any]) -> Tensor:
    return np.stack(tensors).view(Tensor)
