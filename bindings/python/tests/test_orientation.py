"""Pictures come as they are stored, and tell how to turn them for display."""

import io
import warnings
from typing import Any

import numpy as np
import pytest
from conftest import draw, saved
from PIL import Image, ImageOps

import image_gip
from image_gip import StreamDecoder
from image_gip._types import MetadataPolicy

ORIENTATION = 0x0112
XMP = b'<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:Description tiff:Orientation="%d"/></x:xmpmeta>'


def exif(orientation: int) -> Image.Exif:
    made = Image.Exif()
    made[ORIENTATION] = orientation
    return made


@pytest.fixture(scope="module")
def unturned() -> bytes:
    return saved(Image.fromarray(draw(48, 32, 3)), gaussians=200).getvalue()


@pytest.fixture(params=range(1, 9))
def turned(request: pytest.FixtureRequest) -> tuple[int, bytes]:
    """An orientation, and a file that has it."""
    image = Image.fromarray(draw(48, 32, 3))
    data = exif(request.param)
    return request.param, saved(image, gaussians=200, exif=data, xmp=XMP % request.param).getvalue()


@pytest.mark.parametrize(
    "view", [{}, {"size": (24, 16)}, {"scale": 2}, {"region": (5, 20, 30, 10)}], ids=str
)
def test_samples_are_as_stored(
    turned: tuple[int, bytes], unturned: bytes, view: dict[str, Any]
) -> None:
    orientation, file = turned
    info = image_gip.info(file)
    assert (info.size, info.orientation) == ((48, 32), orientation)
    stream = StreamDecoder().feed(file)
    assert stream.info is not None
    assert stream.info.orientation == orientation
    expected = image_gip.decode(unturned, **view)
    np.testing.assert_array_equal(image_gip.decode(file, **view), expected)
    np.testing.assert_array_equal(stream.image(**view), expected)


def test_pillow_turns_as_with_png(turned: tuple[int, bytes]) -> None:
    orientation, file = turned
    png = io.BytesIO()
    Image.fromarray(image_gip.decode(file)).save(png, "PNG", exif=exif(orientation))
    with Image.open(io.BytesIO(file)) as opened, Image.open(png) as expected:
        assert opened.size == expected.size == (48, 32)
        np.testing.assert_array_equal(np.asarray(opened), np.asarray(expected))
        assert opened.getexif() == expected.getexif()
        upright = ImageOps.exif_transpose(opened)
        np.testing.assert_array_equal(
            np.asarray(upright), np.asarray(ImageOps.exif_transpose(expected))
        )
    assert upright.getexif().get(ORIENTATION, 1) == 1
    again = saved(upright, exif=upright.info["exif"], xmp=upright.info["xmp"]).getvalue()
    assert image_gip.info(again).orientation == 1
    with Image.open(io.BytesIO(again)) as opened:
        assert opened.getexif().get(ORIENTATION, 1) == 1
        assert opened.size == ((32, 48) if orientation >= 5 else (48, 32))


def test_thumbnails_and_drafts_are_as_stored(turned: tuple[int, bytes]) -> None:
    orientation, file = turned
    with Image.open(io.BytesIO(file)) as opened:
        opened.thumbnail((12, 12))
        assert opened.size == (12, 8)
        upright = ImageOps.exif_transpose(opened)
    assert upright.size == ((8, 12) if orientation >= 5 else (12, 8))


def test_an_orientation_in_xmp_alone() -> None:
    file = saved(Image.fromarray(draw(48, 32, 3)), xmp=XMP % 6)
    with Image.open(file) as opened:
        assert ImageOps.exif_transpose(opened).size == (32, 48)


@pytest.mark.parametrize("value", [0, 9, 300])
def test_orientations_that_are_none(value: int) -> None:
    file = saved(Image.fromarray(draw(48, 32, 3)), exif=exif(value)).getvalue()
    assert image_gip.info(file).orientation == 1
    with Image.open(io.BytesIO(file)) as opened:
        assert ImageOps.exif_transpose(opened).size == (48, 32)


@pytest.mark.parametrize("way", ["encode", "save"])
@pytest.mark.parametrize("policy", ["all", "safe", "none"])
@pytest.mark.parametrize("orientation", range(10))
def test_an_orientation_is_not_dropped_in_silence(
    orientation: int, policy: MetadataPolicy, way: str
) -> None:
    samples = draw(48, 32, 3)
    data = exif(orientation)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        if way == "encode":
            file = image_gip.encode(
                samples, gaussians=9, effort=1, exif=data.tobytes(), metadata=policy
            )
        else:
            saved_to = io.BytesIO()
            image = Image.fromarray(samples)
            image.save(saved_to, "GIP", gaussians=9, effort=1, exif=data, metadata=policy)
            file = saved_to.getvalue()
    stored = orientation if orientation in range(1, 9) and policy != "none" else 1
    assert image_gip.info(file).orientation == stored
    is_lost = policy == "none" and orientation in range(2, 9)
    messages = [str(warning.message) for warning in caught]
    lost = "the orientation was dropped, so the picture is shown as it is stored"
    assert messages == ([lost] if is_lost else [])
    for warning in caught:
        assert (warning.category, warning.filename) == (image_gip.MetadataWarning, __file__)
