"""Decodes and encodes ``.gip``: pictures stored as two-dimensional Gaussians.

``decode`` gives a NumPy array, at any size, of the whole picture or a part of it; ``encode`` makes
a file of one; ``prefix`` cuts a placeholder off it. ``gaussians`` gives the Gaussians of a file,
``render`` renders those of your own, and ``pack`` makes a file of them. With
``image_gip.register()``, Pillow opens and saves ``.gip``; ``image_gip.torch`` decodes crops to
tensors, for training; and ``image_gip.ray`` encodes and decodes data sets on a cluster.
"""

from image_gip._errors import (
    CancelledError,
    GipError,
    LimitError,
    MalformedError,
    MetadataWarning,
    ShortfallWarning,
    SignatureError,
    UnexpectedEndError,
    UnsupportedError,
)
from image_gip._native import (
    StreamDecoder,
    __version__,
    decode,
    encode,
    gaussians,
    info,
    pack,
    prefix,
    prefixes,
    render,
)
from image_gip._types import (
    Chunk,
    ContentLight,
    Info,
    Limits,
    MasteringDisplay,
    Prefix,
    Progress,
    Quantizer,
)

__all__ = [
    "CancelledError",
    "Chunk",
    "ContentLight",
    "GipError",
    "Info",
    "LimitError",
    "Limits",
    "MalformedError",
    "MasteringDisplay",
    "MetadataWarning",
    "Prefix",
    "Progress",
    "Quantizer",
    "ShortfallWarning",
    "SignatureError",
    "StreamDecoder",
    "UnexpectedEndError",
    "UnsupportedError",
    "__version__",
    "decode",
    "encode",
    "gaussians",
    "info",
    "pack",
    "prefix",
    "prefixes",
    "register",
    "render",
]


def register() -> None:
    """Makes Pillow open and save ``.gip``, as ``import image_gip.pillow`` does.

    Raises:
        ImportError: Pillow is not installed.
    """
    import image_gip.pillow  # noqa: F401
