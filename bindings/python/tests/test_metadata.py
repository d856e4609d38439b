"""Metadata: what is stored, what Pillow makes of it, and what a policy keeps."""

import io
import warnings
from typing import Any

import numpy as np
import pytest
from conftest import VECTORS, Picture, chunks, draw, saved
from PIL import ExifTags, Image, ImageCms

import image_gip
from image_gip import ContentLight, MasteringDisplay

SRGB = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
#: A profile that says that it is another.
OTHER = SRGB.replace("sRGB".encode("utf-16-be"), "wide".encode("utf-16-be"))
XMP = (
    '<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-'
    'syntax-ns#"><rdf:Description rdf:about="" xmlns:tiff="http://ns.adobe.com/tiff/1.0/" '
    'xmlns:exif="http://ns.adobe.com/exif/1.0/" tiff:Artist="Emma" exif:GPSLatitude="SECRET"/>'
    "</rdf:RDF></x:xmpmeta>"
)
TEXTS = {"Author": "Emma", "Comment": "SECRET"}


def described() -> Image.Exif:
    made = Image.Exif()
    made[ExifTags.Base.ImageDescription] = "a disc"
    return made


def exif() -> Image.Exif:
    made = described()
    made[ExifTags.Base.Orientation] = 6
    made[ExifTags.Base.BodySerialNumber] = "SECRET"
    made.get_ifd(ExifTags.IFD.GPSInfo)[ExifTags.GPS.GPSLatitudeRef] = "SECRET"
    return made


#: The primaries of BT.2020, D65, and 0.005 to 1000 cd/m².
DISPLAY = MasteringDisplay(
    red=(0.708, 0.292),
    green=(0.17, 0.797),
    blue=(0.131, 0.046),
    white=(0.3127, 0.329),
    max_luminance=1000,
    min_luminance=0.005,
)
LIGHT = ContentLight(max_content=812.3456, max_frame_average=0)
#: As bytes, without the prefix of JPEG.
DESCRIBED = described().tobytes().removeprefix(b"Exif\0\0")
TIFF = exif().tobytes().removeprefix(b"Exif\0\0")
EVERYTHING: dict[str, Any] = {"icc": SRGB, "exif": TIFF, "xmp": XMP.encode(), "texts": TEXTS}


def test_metadata(photo: Picture) -> None:
    exif = b"II*\0\x08\0\0\0\0\0\0\0\0\0"
    prefixed = bytearray(b"Exif\0\0" + exif)
    file = image_gip.encode(
        photo, effort=1, icc=memoryview(b"profile"), exif=prefixed, xmp="<ä/>".encode()
    )
    info = image_gip.info(file)
    assert (info.icc, info.exif, info.xmp) == (b"profile", exif, "<ä/>".encode())


def test_cicp(photo: Picture) -> None:
    wide = photo.astype(np.uint16) * 257
    file = image_gip.encode(wide, effort=1, cicp=(9, 16), metadata="none")
    info = image_gip.info(file)
    assert (info.cicp, info.depth, info.icc) == ((9, 16), 16, None)
    assert image_gip.info(image_gip.encode(photo, effort=1)).cicp is None
    for codes, error in [((9, 256), ValueError), ((-1, 13), ValueError), (9, TypeError)]:
        with pytest.raises(error, match="cicp"):
            image_gip.encode(photo, cicp=codes)  # type: ignore[arg-type]


def test_mastering_display_and_content_light(photo: Picture) -> None:
    options: dict[str, Any] = {"effort": 1, "metadata": "none"}
    file = image_gip.encode(photo, mastering_display=DISPLAY, content_light=LIGHT, **options)
    # Plain tuples, rounded to what a file can have.
    options |= {"mastering_display": tuple(DISPLAY), "content_light": (812.34562, 0.00004)}
    same = image_gip.encode(photo, **options)
    assert file == same
    stored = {part.kind: part.payload for part in chunks(file)}
    assert stored["mDCV"].hex() == "8a48390821349baa199608fc3d1340420098968000000032"
    assert stored["cLLI"].hex() == "007bf44000000000"
    info = image_gip.info(file, metadata="none")
    assert (info.mastering_display, info.content_light) == (DISPLAY, LIGHT)
    assert isinstance(info.mastering_display, MasteringDisplay)
    assert isinstance(info.content_light, ContentLight)
    bare = image_gip.info(image_gip.encode(photo, effort=1))
    assert (bare.mastering_display, bare.content_light) == (None, None)


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"content_light": (429_496.7296, 0)}, ValueError, "content_light 429496.7296; it must be"),
        ({"content_light": (0, -0.001)}, ValueError, "must be 0 to 429496.7295"),
        ({"content_light": (float("nan"), 0)}, ValueError, "a luminance of content_light NaN"),
        ({"content_light": (10**400, 0)}, ValueError, "a luminance of content_light inf"),
        ({"content_light": (1,)}, ValueError, "content_light"),
        ({"content_light": 1}, TypeError, "content_light"),
        (
            {"mastering_display": DISPLAY._replace(white=(0.3, 1.31072))},
            ValueError,
            "a chromaticity of mastering_display 1.31072; it must be 0 to 1.3107",
        ),
        (
            {"mastering_display": DISPLAY._replace(min_luminance=-1)},
            ValueError,
            "a luminance of mastering_display -1; it must be",
        ),
        ({"mastering_display": (1, 2)}, ValueError, "mastering_display"),
    ],
)
def test_light_that_is_refused(
    photo: Picture, options: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        image_gip.encode(photo, **options)


def test_pillow_keeps_what_tells_the_colours(photo: Picture) -> None:
    told = {"cicp": (9, 16), "mastering_display": DISPLAY, "content_light": LIGHT}
    image = Image.fromarray(photo)
    with Image.open(saved(image, **told)) as found:
        assert {name: found.info[name] for name in told} == told
        with Image.open(saved(found)) as again:
            assert {name: again.info[name] for name in told} == told
        with Image.open(saved(found, **dict.fromkeys(told))) as again:
            assert not told.keys() & again.info.keys()
    # What becomes sRGB is in it.
    inks = Image.new("LAB", (9, 9))
    inks.info.update(told)
    with Image.open(saved(inks)) as found:
        assert not told.keys() & found.info.keys()


def test_texts(photo: Picture) -> None:
    pairs = [("Title", "Dämmerung"), ("Author", ""), ("Title", "once more")]
    for texts in (pairs, iter(pairs), tuple(pairs)):
        file = image_gip.encode(photo, effort=1, texts=texts)
        assert image_gip.info(file).texts == tuple(pairs)
    texts_by_keyword = dict(pairs)
    file = image_gip.encode(photo, effort=1, texts=texts_by_keyword)
    assert image_gip.info(file).texts == tuple(texts_by_keyword.items())


@pytest.mark.parametrize(
    "options",
    [
        {"exif": described()},
        {"exif": DESCRIBED},
        {"exif": b"Exif\0\0" + DESCRIBED},
        {"exif": bytearray(DESCRIBED)},
        {"exif": b""},
        {"exif": Image.Exif()},
        {"exif": None},
        {"xmp": XMP},
        {"xmp": XMP.encode()},
        {"xmp": ""},
        {"xmp": None},
        {"icc_profile": SRGB},
        {"icc_profile": b""},
        {"icc_profile": None},
        {},
    ],
    ids=lambda options: "".join(
        f"{name} {type(value).__name__}" for name, value in options.items()
    ),
)
@pytest.mark.parametrize("inherited", [{}, {"icc_profile": OTHER, "exif": TIFF, "xmp": b"<x/>"}])
def test_pillow_keeps_what_avif_does(options: dict[str, Any], inherited: dict[str, Any]) -> None:
    image = Image.fromarray(draw(20, 10, 3))
    image.info.update(inherited)
    avif = io.BytesIO()
    image.save(avif, "AVIF", **options)
    with Image.open(saved(image, **options)) as found, Image.open(avif) as expected:
        for name in ("exif", "icc_profile", "xmp"):
            # AVIF's keeps the prefix as it comes.
            values = [image.info.get(name, b"") for image in (found, expected)]
            assert len({value.removeprefix(b"Exif\0\0") for value in values}) == 1
        assert found.getexif() == expected.getexif()
        assert found.getxmp() == expected.getxmp()


def test_texts_in_pillow() -> None:
    file = saved(Image.fromarray(draw(20, 10, 3)), texts=TEXTS)
    with Image.open(file) as opened:
        assert opened.info["texts"] == tuple(TEXTS.items())
        assert image_gip.info(saved(opened).getvalue()).texts == ()
        again = saved(opened, texts=opened.info["texts"])
    assert image_gip.info(again.getvalue()).texts == tuple(TEXTS.items())


def test_there_and_back_in_pillow() -> None:
    file = saved(Image.fromarray(draw(20, 10, 3)), exif=exif(), xmp=XMP, icc_profile=OTHER)
    with Image.open(file) as opened:
        assert opened.info["exif"] == b"Exif\0\0" + TIFF
        assert opened.getexif()[ExifTags.Base.Orientation] == 6
        gps = opened.getexif().get_ifd(ExifTags.IFD.GPSInfo)
        assert gps[ExifTags.GPS.GPSLatitudeRef] == "SECRET"
        assert opened.getxmp()["xmpmeta"]["RDF"]["Description"]["Artist"] == "Emma"
        second = saved(opened, exif=opened.info["exif"], xmp=opened.info["xmp"])
    first, again = image_gip.info(file.getvalue()), image_gip.info(second.getvalue())
    assert (first.icc, first.exif, first.xmp) == (OTHER, TIFF, XMP.encode())
    assert (first.icc, first.exif, first.xmp) == (again.icc, again.exif, again.xmp)
    with Image.open(VECTORS / "metadata.gip") as opened:
        assert opened.getexif()[ExifTags.Base.Orientation] == 6


def test_a_thumbnail_has_the_metadata_of_its_picture() -> None:
    file = saved(Image.fromarray(draw(40, 20, 3)), exif=exif(), xmp=XMP, icc_profile=OTHER)
    with Image.open(file) as opened:
        opened.thumbnail((20, 20))
        assert opened.info["exif"] == b"Exif\0\0" + TIFF
        # As with all formats of Pillow, the profile goes with it, and the rest on request.
        info = image_gip.info(saved(opened).getvalue())
    assert (info.size, info.icc, info.exif, info.xmp) == ((20, 10), OTHER, None, None)


@pytest.mark.parametrize("way", ["encode", "info", "save"])
def test_the_safe_policy(photo: Picture, way: str) -> None:
    if way == "encode":
        info = image_gip.info(image_gip.encode(photo, effort=1, **EVERYTHING, metadata="safe"))
    elif way == "info":
        file = image_gip.encode(photo, effort=1, **EVERYTHING)
        assert image_gip.info(file) == image_gip.info(file, metadata="all")
        info = image_gip.info(file, metadata="safe")
    else:
        options = {"icc_profile": SRGB, "exif": exif(), "xmp": XMP, "texts": TEXTS}
        image = Image.fromarray(photo)
        info = image_gip.info(saved(image, **options, metadata="safe").getvalue())
    assert (info.icc, info.orientation, info.texts) == (SRGB, 6, (("Author", "Emma"),))
    assert info.exif is not None
    assert info.xmp is not None
    assert b"Emma" in info.xmp
    assert b"SECRET" not in info.exif + info.xmp
    kept = Image.Exif()
    kept.load(info.exif)
    assert kept[ExifTags.Base.ImageDescription] == "a disc"
    assert not kept.get_ifd(ExifTags.IFD.GPSInfo)


def test_without_metadata(photo: Picture) -> None:
    bare = image_gip.encode(photo, effort=1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        upright = EVERYTHING | {"exif": DESCRIBED}
        assert image_gip.encode(photo, effort=1, **upright, metadata="none") == bare
    everything = upright | {"icc": OTHER}
    with pytest.warns(image_gip.MetadataWarning, match="the colour profile was dropped") as raised:
        assert image_gip.encode(photo, effort=1, **everything, metadata="none") == bare
    assert raised[0].filename == __file__
    file = image_gip.encode(photo, effort=1, **EVERYTHING)
    # It is what the file says of the picture, so that nothing is lost.
    info = image_gip.info(file, metadata="none")
    assert (info.icc, info.exif, info.xmp, info.texts) == (None, None, None, ())
    assert info.orientation == 6


def test_damaged_metadata(photo: Picture) -> None:
    damaged = TIFF[:9]
    lost = "the Exif is damaged, and what could not be read of it was dropped"
    with pytest.warns(image_gip.MetadataWarning, match=lost):
        file = image_gip.encode(photo, effort=1, exif=damaged, metadata="safe")
    assert image_gip.info(file).exif is None
    assert image_gip.info(image_gip.encode(photo, effort=1, exif=damaged)).exif == damaged


@pytest.mark.parametrize("policy", ["", "some", "SAFE"])
def test_policies_that_are_refused(photo: Picture, file: bytes, policy: Any) -> None:
    with pytest.raises(ValueError, match='it must be "all", "safe" or "none"'):
        image_gip.encode(photo, metadata=policy)
    with pytest.raises(ValueError, match='it must be "all", "safe" or "none"'):
        image_gip.info(file, metadata=policy)
    with pytest.raises(ValueError, match='it must be "all", "safe" or "none"'):
        saved(Image.fromarray(photo), metadata=policy)
