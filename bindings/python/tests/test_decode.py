"""`decode`, `info` and `gaussians`: where files come from, and where samples go."""

import io
import mmap
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import VECTORS, Picture, unaligned

import image_gip
from image_gip import Limits


def test_any_source(file: bytes, tmp_path: Path) -> None:
    path = tmp_path / "picture.gip"
    path.write_bytes(file)
    expected = image_gip.decode(file)
    sources: list[Any] = [
        bytearray(file),
        memoryview(file),
        memoryview(b"12" + file + b"34")[2:-2],
        np.frombuffer(file, np.uint8),
        io.BytesIO(file),
        str(path),
        path,
    ]
    for source in sources:
        np.testing.assert_array_equal(image_gip.decode(source), expected)
        if isinstance(source, io.BytesIO):
            source.seek(0)
        assert image_gip.info(source) == image_gip.info(file)
    with path.open("rb") as opened:
        np.testing.assert_array_equal(image_gip.decode(opened), expected)
    with (
        path.open("rb") as opened,
        mmap.mmap(opened.fileno(), 0, access=mmap.ACCESS_READ) as mapped,
    ):
        np.testing.assert_array_equal(image_gip.decode(mapped), expected)


def test_a_buffer_is_not_copied(file: bytes) -> None:
    large = file + bytes(16 << 20)
    image_gip.decode(file)
    buffers: list[Any] = [large, memoryview(large), np.frombuffer(large, np.uint8)]
    for buffer in buffers:
        tracemalloc.start()
        image_gip.decode(buffer, size=(8, 8))
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < 100_000


def test_sources_that_cannot_be_read(file: bytes, tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError) as missing:
        image_gip.decode(tmp_path / "none.gip")
    assert missing.value.filename == str(tmp_path / "none.gip")
    with pytest.raises(ValueError, match="not contiguous"):
        image_gip.decode(memoryview(file)[::2])
    with pytest.raises(TypeError, match="bytes-like, a path, or a file object"):
        image_gip.decode(7)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="binary mode"):
        image_gip.decode(io.StringIO("text"))  # type: ignore[arg-type]
    with pytest.raises(image_gip.UnexpectedEndError):
        image_gip.decode(b"")

    class Broken:
        def read(self, size: int = -1, /) -> bytes:
            raise ConnectionResetError("gone")

    with pytest.raises(ConnectionResetError, match="gone"):
        image_gip.decode(Broken())


def test_size_scale_and_region(file: bytes) -> None:
    assert image_gip.decode(file).shape == (64, 96, 3)
    assert image_gip.decode(file, size=(30, 20)).shape == (20, 30, 3)
    double = image_gip.decode(file, scale=2)
    np.testing.assert_array_equal(double, image_gip.decode(file, size=(192, 128)))
    part = image_gip.decode(file, scale=2.0, region=(40, 30, 50, 20))
    np.testing.assert_array_equal(part, double[30:50, 40:90])
    assert image_gip.decode(file, scale=1e-9).shape == (1, 1, 3)
    # NumPy's integers are integers.
    size = (np.int64(30), np.int32(20))
    assert image_gip.decode(file, size=size).shape == (20, 30, 3)


def test_requests_that_are_out_of_range(file: bytes) -> None:
    refused: list[tuple[dict[str, Any], str]] = [
        ({"size": (0, 5)}, "size 0; it must be 1 to 8388608"),
        ({"size": (5, -1)}, "size -1; it must be 1 to 8388608"),
        ({"size": (9_000_000, 5)}, "size 9000000; it must be 1 to 8388608"),
        ({"size": (2**70, 5)}, f"size {2**70}; it must be 1 to 8388608"),
        ({"scale": 0.0}, "scale 0; it must be over 0"),
        ({"scale": -1e-30}, "scale -1e-30; it must be over 0"),
        ({"scale": 10**400}, "scale inf; it must be over 0"),
        ({"scale": 1e9}, "each side must be 1 to 8388608"),
        ({"scale": float("nan")}, "scale NaN; it must be over 0"),
        ({"region": (90, 0, 10, 10)}, "not inside the 96x64 output"),
        ({"region": (0, 0, 0, 10)}, "region 0; it must be 1 to 8388608"),
        ({"region": (-1, 0, 10, 10)}, "region -1; it must be 0 to 8388607"),
        ({"region": (0, 2**70, 10, 10)}, f"region {2**70}; it must be 0 to 8388607"),
        ({"mode": "L"}, 'mode "L" of a picture with mode "RGB"; colours do not become gray'),
        ({"mode": "LA"}, 'mode "LA" of a picture with mode "RGB"'),
        ({"mode": "CMYK"}, 'mode "CMYK"; it must be "L", "LA", "RGB" or "RGBA"'),
        ({"threads": 0}, "threads 0; it must be 1 to 1024"),
        ({"threads": 2**70}, f"threads {2**70}; it must be 1 to 1024"),
    ]
    for keywords, message in refused:
        with pytest.raises(ValueError, match=message):
            image_gip.decode(file, **keywords)
    with pytest.raises(TypeError, match="size and scale exclude each other"):
        image_gip.decode(file, size=(5, 5), scale=1)
    with pytest.raises(TypeError, match="float64; it must be uint8, uint16 or float32"):
        image_gip.decode(file, dtype=np.float64)
    with pytest.raises(TypeError):
        image_gip.decode(file, size=(5.5, 5))  # type: ignore[arg-type]


def test_types_of_samples(file: bytes) -> None:
    eight = image_gip.decode(file)
    sixteen = image_gip.decode(file, dtype=np.uint16)
    floats = image_gip.decode(file, dtype="float32")
    assert [samples.dtype for samples in (eight, sixteen, floats)] == ["u1", "u2", "f4"]
    clipped = np.clip(floats, 0, 1)
    np.testing.assert_array_equal(eight, (clipped * np.float32(255) + np.float32(0.5)).astype("u1"))
    np.testing.assert_array_equal(sixteen, (clipped * np.float32(65535) + 0.5).astype("u2"))
    gray = (VECTORS / "gray16.gip").read_bytes()
    assert image_gip.decode(gray).dtype == np.uint16
    assert image_gip.decode(gray, dtype=np.float32).ndim == 2
    wide = image_gip.decode(gray, dtype=np.float32, mode="RGBA")
    np.testing.assert_array_equal(wide[..., 0], image_gip.decode(gray, dtype=np.float32))
    assert (wide[..., 3] == 1.0).all()


def test_out(file: bytes) -> None:
    expected = image_gip.decode(file)
    batch = np.zeros((3, 64, 96, 3), np.uint8)
    for picture in batch:
        assert image_gip.decode(file, out=picture) is picture
    assert (batch == expected).all()
    floats = np.empty((64, 96, 3), np.float32)
    image_gip.decode(file, out=floats)
    np.testing.assert_array_equal(floats, image_gip.decode(file, dtype=np.float32))


def test_out_that_does_not_fit(file: bytes) -> None:
    samples = np.zeros((64, 96, 3), np.uint8)
    read_only = samples.copy()
    read_only.flags.writeable = False
    refused: list[tuple[Any, str]] = [
        (samples[:, :50], r"out has shape \(64, 50, 3\); it must have \(64, 96, 3\)"),
        (samples[0], r"out has shape \(96, 3\)"),
        (np.zeros((64, 192, 3), np.uint8)[:, ::2], "C-contiguous"),
        (np.asfortranarray(samples), "C-contiguous"),
        (samples[..., ::-1], "C-contiguous"),
        (read_only, "read-only"),
        (unaligned(np.zeros((64, 96, 3), np.uint16)), "out is not aligned"),
    ]
    for out, message in refused:
        with pytest.raises(ValueError, match=message):
            image_gip.decode(file, out=out)
    assert not samples.any()
    with pytest.raises(ValueError, match="out has dtype uint8; it must have uint16"):
        image_gip.decode(file, out=samples, dtype=np.uint16)
    with pytest.raises(TypeError, match="float64; it must be uint8, uint16 or float32"):
        image_gip.decode(file, out=np.zeros((64, 96, 3)))
    with pytest.raises(TypeError, match="out is masked"):
        image_gip.decode(file, out=np.ma.zeros((64, 96, 3), np.uint8))
    with pytest.raises(TypeError, match="out must be a NumPy array"):
        image_gip.decode(file, out=bytearray(64 * 96 * 3))  # type: ignore[arg-type]
    # A file in the memory of its own picture.
    memory: Any = np.zeros(64 * 96 * 3, np.uint8)
    memory[: len(file)] = np.frombuffer(file, np.uint8)
    for source in (memory, memoryview(memory), memory[: len(file)]):
        with pytest.raises(ValueError, match="out overlaps src"):
            image_gip.decode(source, out=memory.reshape(64, 96, 3))


def test_limits(file: bytes) -> None:
    with pytest.raises(
        image_gip.LimitError, match=r"96 required, 90 .*; limits=image_gip.Limits\(max_width="
    ) as raised:
        image_gip.decode(file, limits=Limits(max_width=90))
    error = raised.value
    assert (error.limit, error.wanted, error.allowed) == ("width", 96, 90)
    with pytest.raises(image_gip.LimitError) as raised:
        image_gip.decode(file, size=(70_000, 10))
    assert raised.value.allowed == Limits().max_width
    with pytest.raises(image_gip.LimitError, match="kernel evaluations"):
        image_gip.decode(file, region=(40, 30, 1, 1), limits=Limits(max_work=10))
    with pytest.raises(image_gip.LimitError, match="bytes of memory"):
        image_gip.gaussians(file, limits=Limits(max_memory=10))
    decoded = image_gip.decode(file, size=(70_000, 10), limits=Limits.none())
    assert decoded.shape == (10, 70_000, 3)


@pytest.mark.parametrize("limits", [5, {}, (1, 2), "none", Limits])
def test_limits_of_another_type(file: bytes, limits: Any) -> None:
    calls: list[Callable[..., object]] = [
        lambda: image_gip.decode(file, limits=limits),
        lambda: image_gip.info(file, limits=limits),
        lambda: image_gip.gaussians(file, limits=limits),
        lambda: image_gip.StreamDecoder(limits=limits),
        lambda: image_gip.encode(np.zeros((8, 8), np.uint8), limits=limits),
    ]
    for call in calls:
        with pytest.raises(TypeError, match=r"limits must be an image_gip\.Limits, not "):
            call()


def test_limits_that_are_out_of_range(file: bytes) -> None:
    for name in ("max_width", "max_height", "max_gaussians"):
        for value in (-1, 2**32, 2**70):
            with pytest.raises(ValueError, match=f"{name} {value}; it must be 0 to {2**32 - 1}"):
                Limits(**{name: value})
    for name in ("max_pixels", "max_memory", "max_work"):
        for value in (-1, 2**64):
            with pytest.raises(ValueError, match=f"{name} {value}; it must be 0 to {2**64 - 1}"):
                Limits(**{name: value})
    for wrong in (1.5, "5", None):
        with pytest.raises(TypeError, match="max_work must be an integer, not "):
            Limits(max_work=wrong)  # type: ignore[arg-type]
    assert image_gip.decode(file, limits=Limits(max_width=np.int64(96))).shape == (64, 96, 3)  # type: ignore[arg-type]


def test_info(photo: Picture) -> None:
    exif = b"MM\0*\0\0\0\x08\0\0\0\0\0\0"
    file = image_gip.encode(photo, bpp=4, effort=1, icc=b"profile", exif=exif, xmp=b"<x/>")
    info = image_gip.info(file)
    assert (info.width, info.height, info.size) == (96, 64, (96, 64))
    assert (info.mode, info.depth, info.version) == ("RGB", 8, 1)
    assert (info.coding, info.kernel, info.cutoff) == ("entropy", "quartic", 4.0)
    assert info.parameterization == "cholesky"
    assert len(info.base_color) == 3
    assert (info.icc, info.exif, info.xmp, info.texts) == (b"profile", exif, b"<x/>", ())
    assert sum(info.layers) == info.gaussians
    assert len(info.layers) > 1
    layers = next(chunk for chunk in info.chunks if chunk.kind == "L")
    assert layers.count == len(info.layers)
    assert [chunk.kind for chunk in info.chunks] == ["H", "iCCP", "eXIF", "xMPD", "L", "E"]
    signature = 8
    assert signature + sum(chunk.bytes for chunk in info.chunks) == len(file)
    texts = image_gip.info(VECTORS / "metadata.gip").texts
    assert texts[0] == ("Title", "Dämmerung über dem Meer")
    assert info.skipped == ()
    broken = image_gip.info(VECTORS / "skip-text-utf8.gip")
    assert (broken.texts, broken.skipped) == ((), (("tEXt", "is not UTF-8"),))


def test_gaussians(file: bytes) -> None:
    found = image_gip.gaussians(file)
    assert found.shape == (image_gip.info(file).gaussians,)
    assert found.dtype == [
        ("center", "f4", (2,)),
        ("covariance", "f4", (2, 2)),
        ("color", "f4", (3,)),
    ]
    covariance = found["covariance"]
    np.testing.assert_array_equal(covariance[:, 0, 1], covariance[:, 1, 0])
    assert (np.linalg.eigvalsh(covariance) > 0).all()
    # Their sum is the picture: the kernel is (1 - q / 4)^2 for q < 4.
    base = np.array(image_gip.info(file).base_color) / 65535
    y, x = 30, 50
    distance = np.array([x + 0.5, y + 0.5]) - found["center"]
    q = np.einsum("ni,nij,nj->n", distance, np.linalg.inv(covariance.astype("f8")), distance)
    weight = np.where(q < 4, (1 - q / 4) ** 2, 0)
    expected = image_gip.decode(file, dtype=np.float32)[y, x]
    np.testing.assert_allclose(base + weight @ found["color"], expected, atol=1e-3)
    assert image_gip.gaussians(VECTORS / "no-gaussians.gip").shape == (0,)
    assert image_gip.gaussians(VECTORS / "gray8.gip")["color"].shape[1:] == (1,)
