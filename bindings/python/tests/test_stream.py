"""`StreamDecoder`."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

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
    assert raised.value.chunk == "GEND"
    np.testing.assert_array_equal(stream.image(), image_gip.decode(file))


def test_after_an_error(file: bytes) -> None:
    damaged = bytearray(file)
    damaged[-30] ^= 1
    stream = StreamDecoder()
    with pytest.raises(image_gip.MalformedError, match="chunk GAUS"):
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
    stream = StreamDecoder().feed(file[:-12])

    def work(number: int) -> bool:
        if number == 5:
            stream.feed(file[-12:])
        return bool((stream.image(threads=1 + number % 2) == expected).all())

    with ThreadPoolExecutor(4) as pool:
        assert all(pool.map(work, range(40)))
    assert stream.is_complete


def test_data_must_be_bytes() -> None:
    with pytest.raises(TypeError, match="data must be bytes-like, not str"):
        StreamDecoder().feed("text")  # type: ignore[arg-type]
