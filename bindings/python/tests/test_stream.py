"""`StreamDecoder`."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from conftest import LEAST_CHUNK, Chunk, chunks, joined, moved

import image_gip
from image_gip import StreamDecoder


def test_a_picture_that_arrives(file: bytes) -> None:
    stream = StreamDecoder()
    assert stream.info is None
    for read in (stream.image, stream.gaussians, lambda: stream.gaussians_for(9, 9)):
        with pytest.raises(ValueError, match="the header has not arrived yet"):
            read()
    counts = []
    errors = []
    whole = image_gip.decode(file).astype(int)
    for start in range(0, len(file), 100):
        assert not stream.is_complete
        counts.append(stream.feed(file[start : start + 100]).arrived)
        errors.append(np.abs(stream.image() - whole).mean())
    assert stream.is_complete
    assert counts == sorted(counts)
    assert len(set(counts)) > 2
    assert counts[-1] == stream.gaussians().size == image_gip.info(file).gaussians
    assert errors[0] > errors[len(errors) // 2] > errors[-1] == 0
    stream.finish()
    assert stream.info == image_gip.info(file)
    # What follows the file is not a part of it.
    assert stream.feed(b"something else").is_complete


def test_chained() -> None:
    picture = np.full((5, 9), 200, np.uint8)
    file = image_gip.encode(picture, effort=1)
    assert abs(StreamDecoder().feed(file).image(size=(3, 2)).astype(int) - 200).max() < 3


def test_the_end_is_missing(file: bytes) -> None:
    stream = StreamDecoder().feed(file[:-3])
    with pytest.raises(image_gip.UnexpectedEndError) as raised:
        stream.finish()
    assert raised.value.chunk == "E"
    np.testing.assert_array_equal(stream.image(), image_gip.decode(file))


def test_after_an_error(file: bytes) -> None:
    damaged = bytearray(file)
    damaged[-30] ^= 1
    stream = StreamDecoder()
    with pytest.raises(image_gip.MalformedError, match=r"chunk L \(layer\)"):
        stream.feed(damaged)
    assert 0 < stream.arrived < image_gip.info(file).gaussians
    assert stream.image().shape == (64, 96, 3)
    with pytest.raises(image_gip.GipError, match="already failed"):
        stream.feed(b"more")


def test_previews(file: bytes) -> None:
    stream = StreamDecoder().feed(file)
    everything = stream.arrived
    assert stream.gaussians_for(1, 1) < everything == stream.gaussians_for(2000, 2000)
    with pytest.raises(ValueError, match="height -4; it must be 0 to 4294967295"):
        stream.gaussians_for(1, -4)
    with pytest.raises(ValueError, match=f"width {2**40}; it must be 0 to 4294967295"):
        stream.gaussians_for(2**40, 4)
    with pytest.raises(ValueError, match="prefix -1; it must be 0 to 4294967295"):
        stream.image(prefix=-1)
    few = stream.image(prefix=stream.gaussians_for(12, 8), size=(12, 8))
    assert np.abs(few - stream.image(size=(12, 8)).astype(int)).mean() < 30


def test_one_decoder_for_many_threads(file: bytes) -> None:
    expected = image_gip.decode(file)
    stream = StreamDecoder().feed(file[:-LEAST_CHUNK])

    def work(number: int) -> bool:
        if number == 5:
            stream.feed(file[-LEAST_CHUNK:])
        return bool((stream.image(threads=1 + number % 2) == expected).all())

    with ThreadPoolExecutor(4) as pool:
        assert all(pool.map(work, range(40)))
    assert stream.is_complete


def test_metadata_after_the_layers(file: bytes) -> None:
    profile = Chunk("iCCP", b"profile")
    late = [Chunk("tEXt", b"Title\0A disc"), Chunk("xMPD", b"<x/>")]
    parts = chunks(file)
    first = 1 + [part.kind for part in parts].index("L")
    spread = joined(
        [parts[0], profile, *parts[1:first], *late[:1], *parts[first:-1], *late[1:], parts[-1]]
    )
    stream = StreamDecoder()
    seen = {}
    for byte in spread:
        info = stream.feed(bytes([byte])).info
        if info is not None and stream.arrived > 0:
            seen[info.icc, info.texts, info.xmp] = stream.arrived
    texts = (("Title", "A disc"),)
    layers = image_gip.info(file).layers
    assert seen == {
        (b"profile", (), None): layers[0],
        (b"profile", texts, None): sum(layers),
        (b"profile", texts, b"<x/>"): sum(layers),
    }
    assert stream.info == image_gip.info(spread)
    np.testing.assert_array_equal(stream.image(), image_gip.decode(file))


def test_texture_after_the_layers(textured: bytes) -> None:
    late = moved(textured, "tXTR")
    texture = next(part for part in chunks(late) if part.kind == "tXTR")
    end = len(late) - LEAST_CHUNK
    stream = StreamDecoder().feed(late[: end - len(texture.bytes)])
    assert stream.arrived == image_gip.info(late).gaussians
    plain = image_gip.decode(textured, texture=False)
    np.testing.assert_array_equal(stream.image(), plain)
    stream.feed(late[end - len(texture.bytes) : end])
    expected = image_gip.decode(textured)
    assert np.abs(expected.astype(int) - plain).mean() > 1
    np.testing.assert_array_equal(stream.image(), expected)
    np.testing.assert_array_equal(image_gip.decode(late), expected)
    np.testing.assert_array_equal(image_gip.decode(late, texture=False), plain)


def test_an_orientation_after_a_layer(file: bytes) -> None:
    turned = b"MM\0*\0\0\0\x08\0\1\1\x12\0\3\0\0\0\1\0\6\0\0\0\0\0\0"
    parts = chunks(file)
    early = joined([parts[0], Chunk("eXIF", turned), *parts[1:]])
    assert image_gip.info(early).orientation == 6
    stream = StreamDecoder()
    stream.feed(moved(early, "eXIF"))
    assert stream.is_complete
    assert stream.info is not None
    assert (stream.info.orientation, stream.info.exif) == (1, None)
    assert stream.arrived == image_gip.info(file).gaussians


def test_data_must_be_bytes() -> None:
    with pytest.raises(TypeError, match="data must be bytes-like, not str"):
        StreamDecoder().feed("text")  # type: ignore[arg-type]
