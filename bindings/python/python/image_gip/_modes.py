"""Pillow's modes as samples that a file can have."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageCms

from image_gip._errors import MetadataWarning, warn

#: What modes of 8 bits become, without alpha.
_COLORS = {
    **dict.fromkeys(("1", "L", "LA", "La"), "L"),
    **dict.fromkeys(("P", "PA", "RGB", "RGBA", "RGBa", "RGBX"), "RGB"),
    **dict.fromkeys(("CMYK", "HSV", "LAB", "YCbCr"), "RGB"),
}
#: Modes that become sRGB by a profile, which the file does not need any more.
_MANAGED = ("CMYK", "LAB")
#: Modes in which `info["transparency"]` means nothing.
_WITHOUT_ALPHA = (*_MANAGED, "HSV", "YCbCr")


def samples(image: Image.Image, profile: bytes | None) -> NDArray[Any]:
    """The samples of a picture with this ICC profile: gray or RGB, with alpha if it has any.

    Raises:
        OSError: No file can have the colours of this mode.
    """
    if image.mode.startswith("I"):
        return _sixteen_bits(image)
    if image.mode not in _COLORS:
        raise _refused(image, "convert it to L, or pass an array of 0.0 to 1.0 to image_gip.encode")
    if image.mode == "CMYK":
        image = _to_srgb(image, profile)
    mode = _COLORS[image.mode]
    if image.has_transparency_data and image.mode not in _WITHOUT_ALPHA:
        mode += "A"
    return np.asarray(image if image.mode == mode else image.convert(mode))


def stored_profile(image: Image.Image, profile: bytes | None) -> bytes | None:
    """The profile that is stored with the picture: that of the samples, or none.

    Programs take a profile of another colour space for damage, or for the wrong colours.
    """
    if not profile or image.mode in _MANAGED:
        return None
    space = b"GRAY" if _COLORS.get(image.mode, "L") == "L" else b"RGB "
    if profile[36:40] == b"acsp" and profile[16:20] != space:
        found = profile[16:20].decode("ascii", "replace").strip()
        message = f"an ICC profile for {found} does not fit mode {image.mode}, and is not stored"
        warn(message, MetadataWarning)
        return None
    return profile


def stored_colors(image: Image.Image) -> dict[str, Any]:
    """What the picture says of its colours besides a profile, unless its samples become sRGB."""
    if image.mode in _MANAGED:
        return {}
    names = ("cicp", "mastering_display", "content_light")
    return {name: image.info[name] for name in names if name in image.info}


def _sixteen_bits(image: Image.Image) -> NDArray[np.uint16]:
    """The samples of a mode of integers, in the machine's byte order."""
    values = np.asarray(image)
    gray = values.astype(np.uint16)
    if (gray != values).any():
        raise _refused(image, f"values are {values.min()} to {values.max()}, not 0 to 65535")
    transparent = image.info.get("transparency")
    if not isinstance(transparent, int):
        return gray
    return np.dstack((gray, np.where(gray == transparent, 0, 65535).astype(np.uint16)))


def _to_srgb(image: Image.Image, profile: bytes | None) -> Image.Image:
    """A picture in inks as sRGB."""
    if not profile:
        raise _refused(image, "it has no ICC profile that tells its colours; convert it to RGB")
    try:
        srgb = ImageCms.createProfile("sRGB")
        converted = ImageCms.profileToProfile(image, io.BytesIO(profile), srgb, outputMode="RGB")
    except ImageCms.PyCMSError as error:
        raise _refused(image, f"{error}; convert it to RGB") from error
    assert converted is not None
    return converted


def _refused(image: Image.Image, why: str) -> OSError:
    return OSError(f"cannot write mode {image.mode} as GIP: {why}")
