"""The plug-in for Pillow."""

import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import SIGNATURE, VECTORS, Chunk, Picture, chunks, draw, joined, moved, saved
from PIL import Image, ImageFile, UnidentifiedImageError

import image_gip
import image_gip.pillow
from image_gip import _native


class Counted(io.BytesIO):
    """A file that knows how far it was read."""

    furthest = 0

    def read(self, size: int | None = -1, /) -> bytes:
        data = super().read(size)
        self.furthest = max(self.furthest, self.tell())
        return data


@pytest.fixture
def truncated_images() -> Iterator[None]:
    """Pillow shows what there is of a damaged file."""
    ImageFile.LOAD_TRUNCATED_IMAGES = True
    yield
    ImageFile.LOAD_TRUNCATED_IMAGES = False


@pytest.mark.parametrize("keep", [False, True])
def test_colours_that_do_not_show(keep: bool) -> None:
    samples = draw(40, 30, 4)
    samples[:, :20, 3] = 0
    samples[:, 20:, 3] = 255
    file = saved(Image.fromarray(samples), psnr=36, keep_invisible=keep).getvalue()
    assert file == image_gip.encode(samples, psnr=36, effort=1, keep_invisible=keep)
    found = image_gip.decode(file)[:, :12, :3].astype(int)
    assert (np.abs(found - samples[:, :12, :3]).mean() < 8) == keep


@pytest.mark.parametrize("mode", ["L", "LA", "RGB", "RGBA"])
def test_round_trips(mode: str) -> None:
    samples = draw(60, 45, len(mode))
    samples = samples[..., 0] if mode == "L" else samples
    file = saved(Image.fromarray(samples), psnr=36)
    assert file.getvalue() == image_gip.encode(samples, psnr=36, effort=1)
    with Image.open(file) as opened:
        assert (opened.format, opened.mode, opened.size) == ("GIP", mode, (60, 45))
        assert opened.get_format_mimetype() == "image/vnd.gip"
        expected = image_gip.decode(file.getvalue())
        np.testing.assert_array_equal(np.asarray(opened), expected)
        again = opened.copy()
    np.testing.assert_array_equal(np.asarray(again), expected)


def test_files_by_name(tmp_path: Path, photo: Picture) -> None:
    path = tmp_path / "picture.gip"
    Image.fromarray(photo).save(path, bpp=2, effort=1)
    assert path.read_bytes() == image_gip.encode(photo, bpp=2, effort=1)
    with Image.open(path) as opened:
        opened.load()
        assert opened.size == (96, 64)
    assert image_gip.register() is None  # type: ignore[func-returns-value]


def test_opening_reads_the_header_only(file: bytes) -> None:
    source = Counted(file)
    with Image.open(source) as opened:
        assert opened.size == (96, 64)
        assert source.furthest < 200
        opened.load()
        assert source.furthest == len(file)


def test_file_objects_that_give_other_buffers(file: bytes) -> None:
    class Buffers(io.BytesIO):
        def read(self, size: int | None = -1, /) -> Any:
            return kind(super().read(size))

    expected = image_gip.decode(file)
    for kind in (bytearray, memoryview):
        # Pillow's own formats compare the start of a file as bytes.
        formats = ["GIP"] if kind is memoryview else None
        with Image.open(Buffers(file), formats=formats) as opened:
            np.testing.assert_array_equal(np.asarray(opened), expected)
        with Image.open(Buffers(file), formats=formats) as opened:
            opened.thumbnail((12, 12))
            assert opened.size == (12, 8)
        np.testing.assert_array_equal(image_gip.decode(Buffers(file)), expected)
    with pytest.raises(TypeError, match="binary mode"):
        _native.read_header(io.StringIO("text"))  # type: ignore[arg-type]


def test_drafts(file: bytes) -> None:
    source = Counted(file)
    with Image.open(source) as opened:
        assert opened.draft(None, (12, 8)) == ("RGB", (0, 0, 12, 8))
        assert opened.size == (12, 8)
        opened.load()
        assert source.furthest < len(file)
        assert np.asarray(opened).shape == (8, 12, 3)
        # It is loaded, and remains as it is.
        assert opened.draft(None, (24, 16)) is None
    for asked, size in [((13, 8), (13, 9)), ((500, 500), (96, 64)), ((24, 1), (24, 16))]:
        with Image.open(io.BytesIO(file)) as opened:
            opened.draft("L", (5, 5))
            opened.draft("L", asked)
            assert opened.size == size
            assert opened.mode == "RGB"
    with Image.open(io.BytesIO(file)) as opened:
        assert opened.draft("L", None) is None
        opened.draft(None, (96, 64))
        np.testing.assert_array_equal(np.asarray(opened), image_gip.decode(file))


def test_thumbnails(file: bytes) -> None:
    whole = Image.fromarray(image_gip.decode(file))
    for size in [(24, 16), (20, 20), (30, 5), (200, 10), (200, 200)]:
        expected = whole.copy()
        expected.thumbnail(size, reducing_gap=None)
        for gap, tolerance in [(1.0, 25), (2.0, 16), (None, 0)]:
            source = Counted(file)
            with Image.open(source) as opened:
                opened.thumbnail(size, reducing_gap=gap)
            assert opened.size == expected.size
            error = np.abs(np.asarray(opened).astype(int) - np.asarray(expected)).mean()
            assert error <= tolerance
    source = Counted(file)
    with Image.open(source) as opened:
        opened.thumbnail((12, 12))
    assert source.furthest < len(file)


def test_metadata_after_the_layers(file: bytes) -> None:
    parts = chunks(file)
    profile, exif = Chunk("iCCP", b"profile"), Chunk("eXIF", b"II*\0\x08\0\0\0\0\0\0\0\0\0")
    texts = [Chunk("tEXt", b"Title\0A disc"), Chunk("tEXt", b"Author\0Emma")]
    spread = joined([parts[0], profile, texts[0], *parts[1:-1], exif, texts[1], parts[-1]])
    with Image.open(io.BytesIO(spread)) as opened:
        assert opened.info == {"icc_profile": b"profile", "texts": (("Title", "A disc"),)}
        opened.info["mine"] = 1
        opened.load()
        assert opened.info == {
            "mine": 1,
            "icc_profile": b"profile",
            "exif": b"Exif\0\0" + exif.payload,
            "texts": (("Title", "A disc"), ("Author", "Emma")),
        }
    # What a program has removed does not come back.
    early = joined([parts[0], profile, exif, *parts[1:]])
    with Image.open(io.BytesIO(early)) as opened:
        del opened.info["icc_profile"]
        opened.load()
        assert opened.info.keys() == {"exif"}
    # A draft of a part of the Gaussians does without.
    source = Counted(spread)
    with Image.open(source) as opened:
        opened.draft(None, (12, 8))
        opened.load()
        assert source.furthest < len(spread)
        assert "exif" not in opened.info


def test_texture_after_the_layers(textured: bytes) -> None:
    late = moved(textured, "tXTR")
    expected = image_gip.decode(textured)
    with Image.open(io.BytesIO(late)) as opened:
        np.testing.assert_array_equal(np.asarray(opened), expected)
    # A draft with all Gaussians has their texture.
    drafts = []
    for file in (textured, late):
        with Image.open(io.BytesIO(file)) as opened:
            opened.draft(None, (120, 80))
            drafts.append(np.asarray(opened))
    assert drafts[0].shape == (80, 120, 3)
    np.testing.assert_array_equal(drafts[0], drafts[1])


@pytest.mark.parametrize("damage", ["truncated", "changed"])
def test_damaged_files(file: bytes, damage: str) -> None:
    damaged = file[:-20] if damage == "truncated" else file[:-20] + bytes(8) + file[-12:]
    with (
        Image.open(io.BytesIO(damaged)) as opened,
        pytest.raises(OSError, match=r"chunk L \(layer\)") as raised,
    ):
        opened.load()
    assert isinstance(raised.value.__cause__, image_gip.GipError)
    with (
        Image.open(io.BytesIO(damaged)) as opened,
        pytest.raises(OSError, match=r"chunk L \(layer\)"),
    ):
        opened.verify()


@pytest.mark.usefixtures("truncated_images")
def test_what_there_is_of_a_damaged_file(file: bytes) -> None:
    whole = image_gip.decode(file).astype(int)
    with Image.open(io.BytesIO(file[:-20])) as opened:
        assert 0 < np.abs(np.asarray(opened) - whole).mean() < 20
    # Nothing but the signature, the header, and the letter of a layer.
    header = SIGNATURE + len(chunks(file)[0].bytes)
    with Image.open(io.BytesIO(file[: header + 1])) as opened:
        assert len(np.unique(np.asarray(opened))) <= 3
    with Image.open(io.BytesIO(file[:300])) as opened:
        opened.thumbnail((12, 8))
        assert opened.size == (12, 8)


def test_files_that_are_not_opened(file: bytes) -> None:
    with pytest.raises(OSError, match=r"unexpected end of the file in chunk H \(header\)"):
        Image.open(io.BytesIO(file[:20]))
    with pytest.raises(OSError, match="unsupported: version 2"):
        Image.open(VECTORS / "xversion.gip")
    with pytest.raises(UnidentifiedImageError):
        Image.open(io.BytesIO(b"\xc7GIP" + file[5:]))
    with pytest.raises(SyntaxError, match="signature"):
        image_gip.pillow.GipImageFile(io.BytesIO(b"\x89PNG\r\n\x1a\n" + file[8:]))


def test_verify(file: bytes) -> None:
    with Image.open(io.BytesIO(file)) as opened:
        opened.verify()


@pytest.mark.parametrize("pixels", [3072, 6143, 6144, 10_000])
def test_pillow_has_a_limit_of_its_own(
    file: bytes, pixels: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    png = io.BytesIO()
    Image.fromarray(image_gip.decode(file)).save(png, "PNG")
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", pixels)
    outcomes = []
    for opened in (io.BytesIO(file), png):
        try:
            Image.open(opened).close()
            outcomes.append("")
        # Its warning is an error here.
        except (Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
            outcomes.append(repr(error))
    assert outcomes[0] == outcomes[1]


def test_what_decode_would_refuse_is_not_saved() -> None:
    image = Image.new("L", (2, 65537))
    with pytest.raises(OSError, match=r"height: 65537 .* limits=image_gip.Limits\(max_height="):
        saved(image)
    file = saved(image, limits=image_gip.Limits(max_height=65537))
    # Pillow has a limit for the number of pixels only.
    with Image.open(file) as opened:
        opened.load()
        assert opened.size == (2, 65537)


def test_a_cancelled_save_leaves_no_file(tmp_path: Path, photo: Picture) -> None:
    path = tmp_path / "picture.gip"
    with pytest.raises(OSError, match="cancelled"):
        Image.fromarray(photo).save(path, progress=lambda _: False)
    assert not path.exists()
