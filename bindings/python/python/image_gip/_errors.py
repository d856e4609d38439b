"""The exceptions and warnings of the module."""

import sys
import warnings


class GipError(Exception):
    """Why a file was not decoded, or a picture not encoded. Its subclasses are the kinds of error.

    Wrong arguments are no ``GipError``: they raise ``TypeError`` or ``ValueError``.
    """

    #: The letters of the chunk in which a file breaks a rule or ends, such as ``"L"`` for a layer;
    #: ``None`` elsewhere.
    chunk: str | None = None


class SignatureError(GipError):
    """The bytes are not those of a ``.gip`` file."""


class MalformedError(GipError):
    """The file breaks a rule of the format."""


class UnsupportedError(GipError):
    """The file may be valid, but requires something that this version does not have."""


class UnexpectedEndError(GipError):
    """The file ends too early."""


class LimitError(GipError):
    """The file, the request or the picture requires more than one of the :class:`Limits` allows."""

    #: What is limited: ``"width"``, ``"height"``, ``"pixels"``, ``"Gaussians"``,
    #: ``"bytes of memory"`` or ``"kernel evaluations"``.
    limit: str = ""
    #: What the file or the request requires, or more.
    wanted: int = 0
    #: What is allowed.
    allowed: int = 0


class CancelledError(GipError):
    """The callback of an encoding returned ``False``."""


class ShortfallWarning(UserWarning):
    """The file misses its target.

    Its PSNR or quality is lower than asked for, which is out of reach at this effort, or it is
    larger than asked for and holds nothing but its start and metadata.
    """


class MetadataWarning(UserWarning):
    """Metadata that may be missed was dropped, as was asked for, or because it is damaged."""


def warn(message: str, category: type[Warning]) -> None:
    """Warns at the line that calls this package, or that calls Pillow, which calls it."""
    level, frame = 1, sys._getframe()
    while frame.f_globals.get("__name__", "").partition(".")[0] in {"image_gip", "PIL"}:
        if frame.f_back is None:
            break
        level, frame = level + 1, frame.f_back
    warnings.warn(message, category, stacklevel=level)
