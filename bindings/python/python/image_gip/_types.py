"""What functions of the module take and return besides arrays."""

from dataclasses import dataclass, fields
from operator import index
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

#: The channels of a picture, as Pillow names them.
Mode: TypeAlias = Literal["L", "LA", "RGB", "RGBA"]
#: What an encoding minimizes: the error that a person sees, or the squared error.
Tune: TypeAlias = Literal["visual", "psnr"]
#: How the Gaussians of a file are stored, as the tool names it.
Precision: TypeAlias = Literal["entropy", "packed", "f32"]
#: The weight of a Gaussian around its centre.
Kernel: TypeAlias = Literal["quartic", "exponential"]
#: What is stored of a Gaussian's shape.
Parameterization: TypeAlias = Literal["cholesky", "covariance", "rotation-scale"]
#: What of a picture's metadata is kept.
MetadataPolicy: TypeAlias = Literal["all", "safe", "none"]


#: The largest value of each limit.
_MOST = {
    "max_width": 2**32 - 1,
    "max_height": 2**32 - 1,
    "max_pixels": 2**64 - 1,
    "max_gaussians": 2**32 - 1,
    "max_memory": 2**64 - 1,
    "max_work": 2**64 - 1,
}


@dataclass(frozen=True, kw_only=True, slots=True)
class Limits:
    """What decoding a file may cost at most: each an integer from 0.

    A width, a height or a number of Gaussians is at most 2**32 - 1, and the others 2**64 - 1. The
    defaults accept every ordinary picture, and bound what a hostile file costs to a few hundred
    megabytes and a few seconds more than an ordinary picture of its size.
    """

    #: Largest width in pixels, of the file and of what is rendered.
    max_width: int = 1 << 16
    #: Largest height in pixels, of the file and of what is rendered.
    max_height: int = 1 << 16
    #: Most pixels, of the file and of what is rendered.
    max_pixels: int = 1 << 28
    #: Most Gaussians.
    max_gaussians: int = 1 << 22
    #: Most bytes that the decoder holds. The output array does not count, nor does another one,
    #: which is needed to compose, and for float32 of several channels.
    max_memory: int = 512 << 20
    #: Most evaluations of the kernel in one rendering beyond 64 for each pixel.
    max_work: int = 1 << 32

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            try:
                is_allowed = 0 <= index(value) <= _MOST[field.name]
            except TypeError:
                message = f"{field.name} must be an integer, not {type(value).__name__}"
                raise TypeError(message) from None
            if not is_allowed:
                raise ValueError(f"{field.name} {value}; it must be 0 to {_MOST[field.name]}")

    @classmethod
    def none(cls) -> "Limits":
        """No limits but those of the format. For trusted files only."""
        return cls(**_MOST)


@dataclass(frozen=True, slots=True)
class Chunk:
    """The chunks of one type in a file."""

    #: The type: one letter, such as ``"L"`` for a layer, or four, as in ``"bNDS"``.
    kind: str
    #: The number of chunks.
    count: int
    #: The bytes of all these chunks, with type, length and checksum.
    bytes: int


class MasteringDisplay(NamedTuple):
    """The display on which a picture was made (SMPTE ST 2086)."""

    #: CIE 1931 x and y of its red, each 0 to 1.3107, and so are the others.
    red: tuple[float, float]
    #: x and y of its green.
    green: tuple[float, float]
    #: x and y of its blue.
    blue: tuple[float, float]
    #: x and y of its white.
    white: tuple[float, float]
    #: The most luminance that it shows, in cd/m²: 0 to 429496.7295, and so is the least.
    max_luminance: float
    #: The least luminance that it shows, in cd/m².
    min_luminance: float


class ContentLight(NamedTuple):
    """How bright a picture is (CTA-861)."""

    #: The luminance of the brightest pixel, MaxCLL, in cd/m²: 0 (not known) to 429496.7295.
    max_content: float
    #: The mean luminance of the picture, MaxFALL, in cd/m²: 0 (not known) to 429496.7295.
    max_frame_average: float


class Quantizer(NamedTuple):
    """How one component of all Gaussians is stored in a file with packed codes."""

    #: ``"linear"``: the value of a code is code * scale + offset; or ``"log"``: it is the
    #: exponential of that, for positive components of widely different sizes.
    kind: Literal["linear", "log"]
    #: Bit depth, 1 to 16: codes are 0 to 2**bits - 1.
    bits: int
    #: The difference of neighbouring codes, in units of the component or of its logarithm: over 0,
    #: at most 2**32.
    scale: float
    #: That of code 0, within +-2**32.
    offset: float


@dataclass(frozen=True, kw_only=True, slots=True)
class Info:
    """What a file says of its picture."""

    #: Width in pixels.
    width: int
    #: Height in pixels.
    height: int
    #: The channels. Colours are sRGB unless `cicp` or `icc` says otherwise; alpha is
    #: straight.
    mode: Mode
    #: Bits per sample of the picture that was encoded: 8 or 16.
    depth: int
    #: How the picture is turned for display, as the Exif of the file has it: 1 (not at all) to 8,
    #: also where :func:`image_gip.info` leaves Exif out. Width, height and all samples are those of
    #: the picture as it is stored.
    orientation: int
    #: Number of Gaussians, as the header declares it.
    gaussians: int
    #: Number of Gaussians in each layer that was read, in the order of the file.
    layers: tuple[int, ...]
    #: Version of the format.
    version: int
    #: How the Gaussians are stored: ``"entropy"`` or ``"packed"``.
    coding: str
    #: The kernel: ``"quartic"`` or ``"exponential"``.
    kernel: str
    #: The largest squared Mahalanobis distance with a weight over 0.
    cutoff: float
    #: What is stored of a shape: ``"cholesky"``, ``"covariance"`` or ``"rotation-scale"``.
    parameterization: str
    #: The colour that the Gaussians are added to, in 1/65535, one number per channel.
    base_color: tuple[int, ...]
    #: The chunks that were read, by type, in the order in which the types appear.
    chunks: tuple[Chunk, ...]
    #: Chunks that break a rule, and so were skipped, each with the reason: at most 16 of them.
    skipped: tuple[tuple[str, str], ...]
    #: The colour space: the codes of colour primaries and transfer characteristics of Rec. ITU-T
    #: H.273, such as (12, 13) for Display P3. It counts before the ICC profile.
    cicp: tuple[int, int] | None
    #: The display on which the picture was made.
    mastering_display: MasteringDisplay | None
    #: How bright the picture is.
    content_light: ContentLight | None
    #: The ICC profile.
    icc: bytes | None
    #: Exif data: a TIFF stream, which begins with ``II`` or ``MM``.
    exif: bytes | None
    #: An XMP packet: XML in UTF-8.
    xmp: bytes | None
    #: Keywords and their texts.
    texts: tuple[tuple[str, str], ...]

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels, as the picture is stored."""
        return self.width, self.height


@dataclass(frozen=True, slots=True)
class Prefix:
    """The small file that the first layers of a file make."""

    #: Number of layers: 0 in a file without Gaussians.
    layers: int
    #: Number of Gaussians in these layers.
    gaussians: int
    #: Bytes of the small file.
    bytes: int
    #: Where the layers end in the file that they are taken from: so many bytes of it are enough.
    end: int


@dataclass(frozen=True, slots=True)
class Progress:
    """How far an encoding has come."""

    #: The share of the work that is done, from 0 to 1: an estimate, which never falls.
    fraction: float
    #: Iterations of training done so far.
    iteration: int
    #: Iterations planned in total. The number grows when the target needs more than planned.
    iterations: int
    #: Present number of Gaussians.
    gaussians: int
    #: PSNR in dB of the present Gaussians.
    psnr: float


def header_field(value: object) -> Any:
    """What an array, or what makes one, says of a header, in objects of Python.

    Texts of bytes become str, and floats that are whole become int, as `gip import` takes them.
    """
    array = np.asarray(value)
    if array.dtype.kind == "S":
        array = array.astype(str)
    plain = array.tolist()
    return [_whole(item) for item in plain] if isinstance(plain, list) else _whole(plain)


def _whole(value: Any) -> Any:
    return int(value) if isinstance(value, float) and value.is_integer() else value
