from collections.abc import Callable, Iterable, Mapping
from os import PathLike
from typing import Any, Protocol, Self, SupportsIndex, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray
from typing_extensions import Buffer

from image_gip._types import (
    Info,
    Kernel,
    Limits,
    MetadataPolicy,
    Mode,
    Parameterization,
    Precision,
    Prefix,
    Progress,
    Quantizer,
    Tune,
)

_Size: TypeAlias = tuple[SupportsIndex, SupportsIndex]
_Point: TypeAlias = tuple[float, float]
# Named tuples are such tuples.
_Display: TypeAlias = tuple[_Point, _Point, _Point, _Point, float, float]
_Light: TypeAlias = tuple[float, float]
_Region: TypeAlias = tuple[SupportsIndex, SupportsIndex, SupportsIndex, SupportsIndex]
# NumPy declares its arrays as buffers from Python 3.12 on only.
_Buffer: TypeAlias = Buffer | NDArray[Any]

class _Readable(Protocol):
    def read(self, size: int = ..., /) -> _Buffer: ...

# A structured array, or arrays by name.
_Gaussians: TypeAlias = NDArray[Any] | Mapping[str, ArrayLike]
_Source: TypeAlias = _Buffer | str | PathLike[str] | _Readable

__all__ = [
    "StreamDecoder",
    "__version__",
    "decode",
    "encode",
    "gaussians",
    "info",
    "pack",
    "prefix",
    "prefixes",
    "read_header",
    "render",
]

__version__: str

def decode(
    src: _Source,
    *,
    size: _Size | None = None,
    scale: float | None = None,
    region: _Region | None = None,
    mode: Mode | None = None,
    background: float | Iterable[float] | None = None,
    planar: bool = False,
    dtype: DTypeLike | None = None,
    out: NDArray[Any] | None = None,
    texture: bool = True,
    threads: int = 1,
    limits: Limits | None = None,
) -> NDArray[Any]: ...
def encode(
    array: NDArray[Any],
    *,
    bpp: float | None = None,
    bytes: int | None = None,
    quality: float | None = None,
    psnr: float | None = None,
    gaussians: int | None = None,
    effort: int = 4,
    tune: Tune = "visual",
    texture: int = 50,
    first_layer: int | None = None,
    precision: Precision = "entropy",
    threads: int = 1,
    seed: int = 0,
    keep_invisible: bool = False,
    cicp: tuple[int, int] | None = None,
    mastering_display: _Display | None = None,
    content_light: _Light | None = None,
    icc: _Buffer | None = None,
    exif: _Buffer | None = None,
    xmp: _Buffer | None = None,
    texts: Mapping[str, str] | Iterable[tuple[str, str]] | None = None,
    metadata: MetadataPolicy = "all",
    limits: Limits | None = None,
    importance: NDArray[np.float32] | None = None,
    fitted: _Gaussians | None = None,
    base_color: SupportsIndex | Iterable[SupportsIndex] | None = None,
    progress: Callable[[Progress], object] | None = None,
) -> bytes: ...
def gaussians(
    src: _Source, *, cholesky: bool = False, limits: Limits | None = None
) -> NDArray[Any]: ...
def render(
    gaussians: _Gaussians,
    *,
    like: Info | None = None,
    width: SupportsIndex | None = None,
    height: SupportsIndex | None = None,
    depth: SupportsIndex | None = None,
    kernel: Kernel | None = None,
    cutoff: float | None = None,
    base_color: SupportsIndex | Iterable[SupportsIndex] | None = None,
    size: _Size | None = None,
    scale: float | None = None,
    region: _Region | None = None,
    mode: Mode | None = None,
    background: float | Iterable[float] | None = None,
    planar: bool = False,
    dtype: DTypeLike | None = None,
    out: NDArray[Any] | None = None,
    threads: int = 1,
    limits: Limits | None = None,
) -> NDArray[Any]: ...
def pack(
    gaussians: _Gaussians,
    *,
    like: Info | None = None,
    width: SupportsIndex | None = None,
    height: SupportsIndex | None = None,
    depth: SupportsIndex | None = None,
    kernel: Kernel | None = None,
    cutoff: float | None = None,
    base_color: SupportsIndex | Iterable[SupportsIndex] | None = None,
    precision: Precision = "f32",
    parameterization: Parameterization | None = None,
    bits: tuple[int, int, int] | None = None,
    quantizers: Iterable[Quantizer | None] | None = None,
    color_step: float | None = None,
    first_layer: int | None = None,
    threads: int = 1,
    cicp: tuple[int, int] | None = None,
    mastering_display: _Display | None = None,
    content_light: _Light | None = None,
    icc: _Buffer | None = None,
    exif: _Buffer | None = None,
    xmp: _Buffer | None = None,
    texts: Mapping[str, str] | Iterable[tuple[str, str]] | None = None,
    metadata: MetadataPolicy = "all",
    limits: Limits | None = None,
) -> bytes: ...
def info(
    src: _Source, *, metadata: MetadataPolicy = "all", limits: Limits | None = None
) -> Info: ...
def prefixes(src: _Source) -> list[Prefix]: ...
def prefix(src: _Source, max_bytes: int) -> bytes: ...
def read_header(file: _Readable, *, limits: Limits | None = None) -> Info: ...

@final
class StreamDecoder:
    def __new__(cls, *, limits: Limits | None = None) -> Self: ...
    def feed(self, data: _Buffer) -> Self: ...
    def finish(self) -> None: ...
    def image(
        self,
        *,
        size: _Size | None = None,
        scale: float | None = None,
        region: _Region | None = None,
        mode: Mode | None = None,
        background: float | Iterable[float] | None = None,
        planar: bool = False,
        dtype: DTypeLike | None = None,
        out: NDArray[Any] | None = None,
        prefix: int | None = None,
        texture: bool = True,
        threads: int = 1,
    ) -> NDArray[Any]: ...
    def gaussians(self, *, cholesky: bool = False) -> NDArray[Any]: ...
    def gaussians_for(self, width: int, height: int) -> int: ...
    @property
    def arrived(self) -> int: ...
    @property
    def is_complete(self) -> bool: ...
    @property
    def info(self) -> Info | None: ...
