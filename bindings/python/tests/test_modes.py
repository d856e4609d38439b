"""Pillow's modes in `Image.save`, and 16 bits in both directions."""

import io
import struct
import warnings
from typing import Any

import numpy as np
import pytest
from conftest import draw, saved
from PIL import Image, ImageCms

import image_gip

#: Samples that are 0 to 65535, with all their bits in use.
GRAY16 = draw(40, 30, 1)[..., 0].astype(np.uint16) * 250 + 77


def profile(space: Any) -> bytes:
    return ImageCms.ImageCmsProfile(ImageCms.createProfile(space)).tobytes()


def stored(image: Image.Image, **options: Any) -> image_gip.Info:
    return image_gip.info(saved(image, **options).getvalue())


@pytest.mark.parametrize(
    ("mode", "expected"), [("1", "L"), ("P", "RGB"), ("PA", "RGBA"), ("RGBX", "RGB")]
)
def test_modes_whose_samples_are_kept(mode: str, expected: str) -> None:
    image = Image.fromarray(draw(40, 30, 3)).convert("P" if mode == "PA" else mode).convert(mode)
    file = saved(image)
    assert file.getvalue() == image_gip.encode(np.asarray(image.convert(expected)), effort=1)


@pytest.mark.parametrize("mode", ["YCbCr", "HSV", "LAB"])
def test_modes_of_other_colours(mode: str) -> None:
    photo = Image.fromarray(draw(40, 30, 3))
    if mode == "LAB":
        srgb, lab = ImageCms.createProfile("sRGB"), ImageCms.createProfile("LAB")
        image: Any = ImageCms.profileToProfile(photo, srgb, lab, outputMode="LAB")
    else:
        image = photo.convert(mode)
    file = saved(image, bpp=16)
    assert image_gip.info(file.getvalue()).icc is None
    with Image.open(file) as opened:
        assert opened.mode == "RGB"
        assert np.abs(np.asarray(opened).astype(int) - np.asarray(photo)).mean() < 4


@pytest.mark.parametrize(("mode", "straight"), [("La", "LA"), ("RGBa", "RGBA")])
def test_premultiplied_alpha_becomes_straight(mode: str, straight: str) -> None:
    image = Image.fromarray(draw(40, 30, len(mode))).convert(mode)
    file = saved(image)
    assert file.getvalue() == image_gip.encode(np.asarray(image.convert(straight)), effort=1)


@pytest.mark.parametrize(
    ("mode", "expected"), [("P", "RGBA"), ("1", "LA"), ("L", "LA"), ("RGB", "RGBA")]
)
def test_a_transparent_colour_becomes_alpha(mode: str, expected: str) -> None:
    image = Image.fromarray(draw(40, 30, 3)).convert(mode)
    image.info["transparency"] = image.getpixel((5, 5))
    assert stored(image, gaussians=50).mode == expected


def test_a_transparent_colour_of_16_bits() -> None:
    image = Image.fromarray(GRAY16)
    image.info["transparency"] = int(GRAY16[3, 4])
    file = saved(image, psnr=45).getvalue()
    info = image_gip.info(file)
    assert (info.mode, info.depth) == ("LA", 16)
    alpha = image_gip.decode(file)[..., 1]
    transparent = np.equal(GRAY16, GRAY16[3, 4])
    assert np.equal(alpha < 32768, transparent).mean() > 0.95


@pytest.mark.parametrize("mode", ["I;16", "I;16L", "I;16B", "I;16N", "I"])
def test_16_bits_are_kept(mode: str) -> None:
    image = Image.fromarray(GRAY16)
    image = image if mode == "I;16" else image.convert("I").convert(mode)
    file = saved(image, psnr=60)
    assert file.getvalue() == image_gip.encode(GRAY16, psnr=60, effort=1)
    with Image.open(file) as opened:
        assert (opened.mode, opened.size) == ("I;16", (40, 30))
        np.testing.assert_array_equal(np.asarray(opened), image_gip.decode(file.getvalue()))
        assert np.abs(np.asarray(opened).astype(int) - GRAY16).mean() < 257
        again = opened.copy()
    assert saved(again, psnr=60).getvalue() == image_gip.encode(
        np.asarray(again), psnr=60, effort=1
    )


def test_16_bits_of_gray_as_8() -> None:
    file = saved(Image.fromarray(GRAY16)).getvalue()
    eight = image_gip.decode(file, dtype=np.uint8)
    with Image.open(io.BytesIO(file)) as opened:
        assert opened.draft("L", opened.size) == ("L", (0, 0, 40, 30))
        np.testing.assert_array_equal(np.asarray(opened), eight)
    with Image.open(io.BytesIO(file)) as opened:
        opened.draft("L", (20, 15))
        opened.thumbnail((10, 10))
        assert (opened.mode, opened.size) == ("L", (10, 8))


@pytest.mark.parametrize("gap", [1.0, 2.0, None])
@pytest.mark.parametrize("size", [(20, 15), (10, 10), (30, 2), (200, 200)])
def test_thumbnails_of_16_bits(size: tuple[int, int], gap: float | None) -> None:
    image = Image.fromarray(GRAY16)
    with Image.open(saved(image)) as opened:
        opened.thumbnail(size, reducing_gap=gap)
    image.thumbnail(size, reducing_gap=None)
    assert (opened.mode, opened.size) == ("I;16", image.size)
    assert np.abs(np.asarray(opened).astype(int) - np.asarray(image)).mean() < 25 * 257


def test_colour_of_16_bits_has_no_mode() -> None:
    file = image_gip.encode(draw(20, 10, 3).astype(np.uint16) * 257, effort=1)
    with Image.open(io.BytesIO(file)) as opened:
        assert opened.mode == "RGB"
        np.testing.assert_array_equal(np.asarray(opened), image_gip.decode(file, dtype=np.uint8))


@pytest.mark.parametrize(
    ("image", "message"),
    [
        (Image.new("F", (9, 9)), "mode F as GIP: convert it to L, or pass an array of 0.0 to 1.0"),
        (Image.new("I", (9, 9), -1), "mode I as GIP: values are -1 to -1, not 0 to 65535"),
        (Image.new("I", (9, 9), 65536), "values are 65536 to 65536"),
        (Image.new("CMYK", (9, 9)), "mode CMYK as GIP: it has no ICC profile that tells"),
    ],
    ids=lambda value: getattr(value, "mode", ""),
)
def test_modes_that_are_refused(image: Image.Image, message: str) -> None:
    with pytest.raises(OSError, match=message):
        saved(image)


def inks() -> bytes:
    """A profile for CMYK whose colours are those of the simplest formula, in a table of corners."""
    corners = np.array(list(np.ndindex(2, 2, 2, 2)))
    rgb = (255 * (1 - corners[:, :3]) * (1 - corners[:, 3:])).astype(np.uint8)
    srgb, lab = ImageCms.createProfile("sRGB"), ImageCms.createProfile("LAB")
    colors = ImageCms.profileToProfile(Image.fromarray(rgb[None]), srgb, lab, outputMode="LAB")
    # Pillow has a and b with sign, the profile with an offset.
    values = (np.asarray(colors) ^ np.array([0, 128, 128], np.uint8)).tobytes()
    linear, matrix = bytes(range(256)), struct.pack(">9i", *np.eye(3, dtype=int).ravel() << 16)
    white = struct.pack(">3i", 63190, 65536, 54061)
    tags = {
        b"A2B0": b"mft1" + bytes(4) + b"\4\3\2\0" + matrix + 4 * linear + values + 3 * linear,
        b"desc": b"desc" + bytes(4) + struct.pack(">I", 5) + b"inks" + bytes(79),
        b"wtpt": b"XYZ " + bytes(4) + white,
    }
    index, data = struct.pack(">I", len(tags)), b""
    for name, tag in tags.items():
        index += name + struct.pack(">2I", 128 + 4 + 12 * len(tags) + len(data), len(tag))
        data += tag + bytes(-len(tag) % 4)
    length = struct.pack(">I", 128 + len(index) + len(data))
    header = length + b"lcms\2\x10\0\0prtrCMYKLab " + bytes(12) + b"acsp" + bytes(28) + white
    return header.ljust(128, b"\0") + index + data


@pytest.mark.parametrize("explicit", [False, True])
def test_inks_become_srgb_by_their_profile(explicit: bool) -> None:
    image = Image.new("CMYK", (60, 20))
    colors = {
        (0, 0, 0, 0): (255, 255, 255),
        (0, 255, 0, 0): (255, 0, 255),
        (0, 0, 0, 255): (0,) * 3,
    }
    for index, ink in enumerate(colors):
        image.paste(ink, (20 * index, 0, 20 * index + 20, 20))
    image.info["icc_profile"] = None if explicit else inks()
    file = saved(image, **({"icc_profile": inks()} if explicit else {}), quality=90).getvalue()
    info = image_gip.info(file)
    assert (info.mode, info.icc) == ("RGB", None)
    found = image_gip.decode(file)[10, 10::20].astype(int)
    assert np.abs(found - list(colors.values())).max() < 12


def test_inks_with_a_profile_that_is_damaged() -> None:
    with pytest.raises(OSError, match=r"mode CMYK as GIP: .+; convert it to RGB"):
        saved(Image.new("CMYK", (9, 9)), icc_profile=inks()[:200])


def test_profiles_of_other_colours() -> None:
    gray, color = Image.fromarray(draw(20, 10, 1)[..., 0]), Image.fromarray(draw(20, 10, 3))
    srgb = profile("sRGB")
    for image, data in [(gray, srgb), (color, inks())]:
        image.info["icc_profile"] = data
        with pytest.warns(
            image_gip.MetadataWarning, match=r"does not fit mode .*, and is not stored"
        ) as raised:
            assert stored(image).icc is None
        assert raised[0].filename.endswith("conftest.py")
        with pytest.warns(image_gip.MetadataWarning, match="does not fit mode"):
            assert stored(image, icc_profile=memoryview(data)).icc is None
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert stored(color, icc_profile=srgb).icc == srgb
        assert stored(color, icc_profile=bytearray(srgb)).icc == srgb
        assert stored(color, icc_profile=None).icc is None
        # It is no profile, and kept as it is.
        assert stored(gray, icc_profile=b"profile").icc == b"profile"
