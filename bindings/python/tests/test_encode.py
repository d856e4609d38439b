"""`encode`: the tool's bytes, arrays that are refused, and how an encoding ends early."""

import io
import os
import signal
import subprocess
import threading
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import Picture, draw, unaligned
from numpy.typing import NDArray
from PIL import Image

import image_gip
from image_gip import LimitError, Limits, Progress

#: What a test waits for before it fails, in seconds.
PATIENCE = 60


def psnr(a: Picture, b: Picture) -> float:
    return float(10 * np.log10(255**2 / np.square(a.astype(float) - b).mean()))


@pytest.mark.parametrize(
    ("keywords", "arguments"),
    [
        ({}, []),
        ({"bpp": 2.5}, ["--bpp", "2.5"]),
        ({"bytes": 900}, ["--bytes", "900"]),
        ({"quality": 60}, ["--quality", "60"]),
        ({"psnr": 35, "seed": 7}, ["--psnr", "35", "--seed", "7"]),
        ({"gaussians": 50, "tune": "psnr"}, ["--gaussians", "50", "--tune", "psnr"]),
        ({"bpp": 2.5, "texture": 0}, ["--bpp", "2.5", "--texture", "0"]),
        ({"effort": 2, "threads": 2}, ["--effort", "2"]),
        ({"bpp": 3, "precision": "packed"}, ["--bpp", "3", "--precision", "packed"]),
        ({"gaussians": 40, "precision": "f32"}, ["--gaussians", "40", "--precision", "f32"]),
    ],
)
@pytest.mark.parametrize("mode", ["L", "LA", "RGB", "RGBA", "I;16"])
def test_the_tools_bytes(
    tool: Path, tmp_path: Path, mode: str, keywords: dict[str, Any], arguments: list[str]
) -> None:
    channels = {"L": 1, "LA": 2, "RGB": 3, "RGBA": 4, "I;16": 1}[mode]
    picture: Any = draw(48, 40, channels)
    if channels == 1:
        picture = picture[..., 0]
    if mode == "I;16":
        picture = picture.astype(np.uint16) * 257 + 100
    Image.fromarray(picture).save(tmp_path / "picture.png")
    names = [str(tmp_path / name) for name in ("picture.png", "picture.gip", "back.png")]
    arguments = arguments if "effort" in keywords else [*arguments, "--effort", "1"]
    subprocess.run([tool, "encode", *names[:2], *arguments], check=True, capture_output=True)
    written = Path(names[1]).read_bytes()
    assert image_gip.encode(picture, **{"effort": 1} | keywords) == written
    subprocess.run([tool, "decode", *names[1:]], check=True)
    with Image.open(names[2]) as back:
        np.testing.assert_array_equal(image_gip.decode(written), np.asarray(back))


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("channels", [0, 1, 2, 3, 4])
def test_arrays(channels: int, dtype: Any) -> None:
    full = {np.uint8: 1, np.uint16: 257, np.float32: 1 / 255}[dtype]
    picture: NDArray[Any] = (draw(40, 30, max(channels, 1)) * np.array(full, dtype)).astype(dtype)
    picture = picture if channels else picture[..., 0]
    file = image_gip.encode(picture, psnr=38, effort=1)
    info = image_gip.info(file)
    assert info.mode == ("L", "L", "LA", "RGB", "RGBA")[channels]
    assert info.depth == (8 if dtype == np.uint8 else 16)
    decoded = image_gip.decode(file, dtype=dtype)
    assert decoded.shape == picture.squeeze().shape
    error = (np.clip(decoded, 0, None) - picture.squeeze().astype(float)) / full
    if info.mode.endswith("A"):  # colours count as much as they show
        error[..., :-1] *= picture[..., -1:] / (255 * full)
    assert np.sqrt(np.square(error).mean()) < 4


def test_floats_are_stored_with_16_bits() -> None:
    sixteen = draw(32, 24, 3).astype(np.uint16) * 257
    floats = (sixteen / 65535).astype(np.float32)
    assert image_gip.encode(floats, effort=1) == image_gip.encode(sixteen, effort=1)


def test_arrays_that_are_refused() -> None:
    picture = draw(20, 10, 3)
    not_a_number = np.zeros((10, 20, 3), np.float32)
    not_a_number[4, 7, 2] = np.nan
    out_of_range = np.zeros((10, 20), np.float32)
    out_of_range[9, 1] = 255
    refused: list[tuple[Any, type[Exception], str]] = [
        (picture.tolist(), TypeError, "must be a NumPy array, not list"),
        (picture.astype(np.float64), TypeError, "dtype float64; it must be uint8, uint16 or float"),
        (picture.astype(">u2"), TypeError, "dtype >u2; .* in the machine's byte order"),
        (picture.astype(bool), TypeError, "dtype bool"),
        (picture[:, ::2], ValueError, "not C-contiguous: .*numpy.ascontiguousarray"),
        (picture[..., ::-1], ValueError, "not C-contiguous"),
        (np.asfortranarray(picture), ValueError, "not C-contiguous"),
        (picture[0, 0], ValueError, r"shape \(3,\); it must be height x width, or"),
        (np.zeros((4, 4, 5), np.uint8), ValueError, r"shape \(4, 4, 5\); .* x 1 to 4 channels"),
        (np.zeros((0, 4), np.uint8), ValueError, "4x0 pixels; each side must be 1 to 1048576"),
        (not_a_number, ValueError, r"the float at \(4, 7, 2\) is NaN; floats must be 0.0 to 1.0"),
        (out_of_range, ValueError, r"the float at \(9, 1\) is 255; .* use numpy.clip"),
        (-out_of_range * 1e-32, ValueError, r"the float at \(9, 1\) is -2.55e-30; floats must"),
        (unaligned(picture.astype(np.uint16)), ValueError, "not aligned .see numpy.require"),
        (unaligned(not_a_number), ValueError, "not aligned"),
        (np.ma.masked_array(picture, picture > 99), TypeError, "the array is masked"),
    ]
    for array, kind, message in refused:
        with pytest.raises(kind, match=message):
            image_gip.encode(array)


def test_options_that_are_refused(photo: Picture) -> None:
    refused: list[tuple[dict[str, Any], type[Exception], str]] = [
        ({"bpp": 1, "psnr": 30}, TypeError, "at most one of bpp, bytes, quality, psnr"),
        ({"effort": 0}, ValueError, "effort 0; it must be 1 to 7"),
        ({"effort": 1000}, ValueError, "effort 1000; it must be 1 to 7"),
        ({"bpp": 0.0}, ValueError, "bits per pixel 0; it must be"),
        ({"effort": 2**70}, ValueError, f"effort {2**70}; it must be 1 to 7"),
        ({"texture": 101}, ValueError, "texture 101; it must be 0 to 100"),
        ({"effort": 1.5}, TypeError, "'float' object cannot be .*\n.* 'effort'"),
        ({"seed": -1}, ValueError, f"seed -1; it must be 0 to {2**64 - 1}"),
        ({"seed": 2**64}, ValueError, f"seed {2**64}; it must be 0 to"),
        ({"psnr": 1e300}, ValueError, "1e300; it must be 1 to 120"),
        ({"quality": -(10**400)}, ValueError, "quality -inf; it must be 0 to 100"),
        ({"bytes": -5}, ValueError, "bytes -5; it must be 1 to 1073741824"),
        ({"bytes": 0}, ValueError, "bytes 0; it must be 1 to 1073741824"),
        ({"bytes": 2**63}, ValueError, f"bytes {2**63}; it must be 1 to 1073741824"),
        ({"bytes": 900, "xmp": b"x" * 2000}, ValueError, "of which 2... are metadata"),
        ({"gaussians": 1 << 40}, ValueError, f"gaussians {1 << 40}; it must be 1 to 4194304"),
        ({"quality": float("nan")}, ValueError, "quality NaN; it must be 0 to 100"),
        ({"tune": "ssim"}, ValueError, 'tune "ssim"; it must be "visual" or "psnr"'),
        (
            {"precision": "u8"},
            ValueError,
            'precision "u8"; it must be "entropy", "packed" or "f32"',
        ),
        ({"threads": 2000}, ValueError, "threads 2000; it must be 1 to 1024"),
        ({"exif": b"\xff\xd8"}, ValueError, "begins with II or MM"),
        ({"icc": "sRGB"}, TypeError, "icc must be bytes-like, not str"),
        ({"texts": "Title"}, TypeError, "texts must be a mapping of str to str, or pairs of str"),
        ({"texts": {"Title": 5}}, TypeError, "texts must be a mapping of str to str"),
        ({"texts": [("a", "b", "c")]}, TypeError, "texts must be"),
        ({"texts": 5}, TypeError, "texts must be"),
        ({"texts": {"": "a"}}, ValueError, 'keyword ""; it must be 1 to 79 bytes long'),
        ({"texts": {"ä" * 40: "a"}}, ValueError, "it must be 1 to 79 bytes long"),
        ({"texts": {"Title": "a\0b"}}, ValueError, 'a NUL in the text "Title"'),
        ({"texts": {"Title": "\ud800"}}, ValueError, "surrogates not allowed"),
    ]
    for keywords, kind, message in refused:
        with pytest.raises(kind, match=message):
            image_gip.encode(photo, **keywords)


def test_targets(photo: Picture) -> None:
    assert 594 <= len(image_gip.encode(photo, bytes=600, effort=1)) <= 600
    assert len(image_gip.encode(photo, bpp=1, effort=1)) <= 64 * 96 / 8
    # 200 Gaussians: enough that one more or less changes the PSNR by less than 0.05 dB.
    file = image_gip.encode(photo, psnr=44, effort=1)
    assert 44 <= psnr(image_gip.decode(file), photo) <= 44.05
    assert image_gip.info(image_gip.encode(photo, gaussians=30, effort=1)).gaussians <= 30


def test_what_a_decoder_would_refuse_is_not_encoded(photo: Picture) -> None:
    called: list[Progress] = []
    tall = np.zeros((65537, 2), np.uint8)
    refused: list[tuple[dict[str, Any], Picture, str, int]] = [
        ({}, tall, "height", 65537),
        ({"limits": Limits(max_pixels=6000)}, photo, "pixels", 96 * 64),
        ({"limits": Limits(max_gaussians=9), "gaussians": 10}, photo, "Gaussians", 10),
        ({"limits": Limits(max_memory=1000), "xmp": bytes(2000)}, photo, "bytes of memory", 2000),
    ]
    for keywords, picture, limit, wanted in refused:
        with pytest.raises(LimitError, match=r"limits=image_gip.Limits\(max_\w+=...\)") as raised:
            image_gip.encode(picture, effort=1, **keywords, progress=called.append)
        assert raised.value.limit == limit
        assert raised.value.wanted >= wanted > raised.value.allowed
    # It was known before the work.
    assert not called
    # Of a narrow picture, whole tiles of 8 x 8 pixels count.
    narrow = (np.arange(1200) * 7 % 251).astype(np.uint8).reshape(1200, 1)
    with pytest.raises(LimitError, match=r"max_work=...\)"):
        image_gip.encode(narrow, gaussians=1000, effort=1, limits=Limits(max_work=2000))
    file = image_gip.encode(tall, effort=1, limits=Limits(max_height=1 << 20))
    with pytest.raises(LimitError, match="height"):
        image_gip.decode(file)
    assert image_gip.decode(file, limits=Limits(max_height=1 << 20)).shape == tall.shape


def test_a_target_out_of_reach(photo: Picture) -> None:
    corner = photo[:16, :16].copy()
    with pytest.warns(image_gip.ShortfallWarning, match="dB is what this effort") as caught:
        file = image_gip.encode(corner, psnr=120, effort=1)
    assert [warning.filename for warning in caught] == [__file__]
    # At the line of the caller, not where the plug-in calls the encoder.
    with pytest.warns(image_gip.ShortfallWarning, match="dB is what this effort") as caught:
        Image.fromarray(corner).save(io.BytesIO(), "GIP", psnr=120, effort=1)
    assert [warning.filename for warning in caught] == [__file__]
    assert image_gip.decode(file).shape == (16, 16, 3)


def test_a_size_below_the_least_file(photo: Picture) -> None:
    with pytest.warns(image_gip.ShortfallWarning, match="are the least that this picture takes"):
        file = image_gip.encode(photo, bytes=20, effort=1)
    assert image_gip.decode(file).shape == photo.shape


def test_without_a_target_warnings_are_those_of_the_default_quality() -> None:
    # Hard to fit, with codes that are not fine.
    noise = np.random.default_rng(1).choice(np.array([0, 255], np.uint8), (32, 32, 4))
    found = []
    for quality in (None, 75):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            image_gip.encode(noise, effort=1, precision="packed", quality=quality)
        found.append([(warning.category, str(warning.message)) for warning in caught])
    assert found[0] == found[1]


def test_the_number_of_threads_does_not_show(photo: Picture) -> None:
    files = {image_gip.encode(photo, effort=2, threads=threads) for threads in (1, 2, 3)}
    assert len(files) == 1
    assert image_gip.encode(photo, effort=2, seed=1) not in files


def test_importance(photo: Picture) -> None:
    height, width = photo.shape[:2]
    importance = np.ones((height, width), np.float32)
    importance[:, : width // 2] = 6
    plain = image_gip.encode(photo, bytes=1500, effort=2)
    own = image_gip.encode(photo, bytes=1500, effort=2, importance=importance)
    left = np.s_[:, : width // 2]
    before, after = (psnr(photo[left], image_gip.decode(file)[left]) for file in (plain, own))
    assert after > before + 0.3
    for wrong in (importance.astype(float), importance[1:], importance[..., None], [[1.0]]):
        with pytest.raises(ValueError, match=rf"float32 and shape \({height}, {width}\)"):
            image_gip.encode(photo, importance=wrong)  # type: ignore[arg-type]
    for bad in (np.nan, np.inf, -1):
        with pytest.raises(ValueError, match="finite, and not negative"):
            image_gip.encode(photo, importance=importance * np.float32(bad))
    with pytest.raises(TypeError, match="masked"):
        image_gip.encode(photo, importance=np.ma.masked_less(importance, 2))
    with pytest.raises(ValueError, match="importance"):
        image_gip.encode(photo, tune="psnr", importance=importance)


def test_precision(photo: Picture) -> None:
    codings = {"entropy": "entropy", "packed": "packed", "f32": "packed"}
    sizes = []
    for precision, coding in codings.items():
        file = image_gip.encode(photo, effort=1, gaussians=60, precision=precision)  # type: ignore[arg-type]
        info = image_gip.info(file)
        assert info.coding == coding
        assert 50 < info.gaussians <= 60
        sizes.append(len(file))
    assert sizes == sorted(sizes)


def test_progress(photo: Picture) -> None:
    reports: list[Progress] = []

    def note(progress: Progress) -> None:
        assert threading.current_thread() is threading.main_thread()
        reports.append(progress)

    file = image_gip.encode(photo, effort=3, progress=note)
    assert file == image_gip.encode(photo, effort=3)
    iterations = [report.iteration for report in reports]
    assert iterations == sorted(iterations)
    fractions = [report.fraction for report in reports]
    assert fractions == sorted(fractions)
    # On a busy machine the last one may be the only one.
    assert 0.8 < fractions[-1] <= 1
    assert reports[-1].iterations >= reports[-1].iteration > 0
    assert reports[-1].gaussians > 0
    assert reports[-1].psnr > 20


def test_progress_cancels(photo: Picture) -> None:
    calls = []

    def stop(progress: Progress) -> bool:
        calls.append(progress)
        return False

    with pytest.raises(image_gip.CancelledError):
        image_gip.encode(photo, effort=7, progress=stop)
    assert len(calls) == 1

    def fail(progress: Progress) -> None:
        raise LookupError("no")

    with pytest.raises(LookupError, match="no"):
        image_gip.encode(photo, effort=7, progress=fail)


def test_ctrl_c() -> None:
    # A shell's jobs in the background ignore the signal.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        image_gip.encode(draw(400, 300, 3), effort=7, threads=2)
    timer.join()


def test_very_wide_gaussians_are_cancelled_at_once() -> None:
    """Each of them covers all pixels, so that every pass of the search looks at all for each."""
    random, count = np.random.default_rng(3), 1500
    wide = {
        "center": random.uniform(0, [256, 192], (count, 2)),
        "covariance": np.eye(2) * random.uniform(4e6, 4e7, (count, 1, 1)),
        "color": random.uniform(-0.1, 0.1, (count, 3)),
    }
    begin = time.monotonic()

    def stop(_: Progress) -> bool:
        return time.monotonic() < begin + 0.5

    with pytest.raises(image_gip.CancelledError):
        image_gip.encode(draw(256, 192, 3), fitted=wide, bpp=1, progress=stop)
    assert time.monotonic() < begin + 2.5


def test_the_interpreter_goes_on() -> None:
    """An encoding on another thread, and a thread that stops it from outside."""
    stop = threading.Event()
    errors: list[BaseException] = []

    def work() -> None:
        try:
            image_gip.encode(draw(400, 300, 3), effort=7, progress=lambda _: not stop.is_set())
        except image_gip.CancelledError as error:
            errors.append(error)

    worker = threading.Thread(target=work)
    worker.start()
    stop.set()
    worker.join(PATIENCE)
    assert not worker.is_alive()
    assert len(errors) == 1
