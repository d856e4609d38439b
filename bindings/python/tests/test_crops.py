"""Crops for training: their geometry, and planar samples."""

import math
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from conftest import draw

import image_gip
from image_gip import _crops
from image_gip._crops import Crop, Rendering

RGB = Rendering("RGB", None, True, None)
TRANSPARENT = np.dstack((draw(48, 32, 3), draw(48, 32, 1)))


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("mode", ["RGB", "RGBA"])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_planes_are_the_samples_in_another_order(channels: int, mode: Any, dtype: Any) -> None:
    picture = np.ascontiguousarray(TRANSPARENT[..., -channels:])
    file = image_gip.encode(picture, bpp=4, effort=1)
    samples = image_gip.decode(file, mode=mode, dtype=dtype)
    planes = image_gip.decode(file, mode=mode, dtype=dtype, planar=True)
    assert planes.flags.c_contiguous
    assert np.array_equal(planes, samples.transpose(2, 0, 1))


def test_one_plane_has_its_axis(photo: Any) -> None:
    file = image_gip.encode(np.ascontiguousarray(photo[..., 0]), bpp=4, effort=1)
    assert image_gip.decode(file, planar=True).shape == (1, 64, 96)
    with pytest.raises(ValueError, match=r"shape \(64, 96\); it must have \(1, 64, 96\)"):
        image_gip.decode(file, planar=True, out=np.empty((64, 96), np.uint8))


def test_planes_of_gaussians_and_of_streams(file: bytes) -> None:
    planes = image_gip.decode(file, planar=True)
    decoder = image_gip.StreamDecoder()
    decoder.feed(file)
    assert np.array_equal(decoder.image(planar=True), planes)
    gaussians = image_gip.gaussians(file, cholesky=True)
    like = image_gip.info(file)
    assert np.array_equal(image_gip.render(gaussians, like=like, planar=True), planes)


def test_a_crop_is_that_part_of_the_picture(file: bytes) -> None:
    stored = _crops.stored_size(file, None)
    assert stored == (64, 96)
    part = _crops.render(file, stored, Crop(10, 20, 30, 40), (30, 40), RGB, dtype=np.uint8)
    assert np.array_equal(part, image_gip.decode(file, planar=True)[:, 10:40, 20:60])
    # Twice as wide, half as high.
    part = _crops.render(file, stored, Crop(10, 20, 30, 40), (15, 80), RGB, dtype=np.uint8)
    whole = image_gip.decode(file, size=(192, 32), planar=True)
    assert np.array_equal(part, whole[:, 5:20, 40:120])


def test_a_crop_at_the_edge_of_any_size_is_inside(file: bytes) -> None:
    for side in (1.0, 3.3, 63.9, 64.0):
        crop = Crop(64 - side, 96 - side, side, side)
        assert _crops.render(file, (64, 96), crop, (7, 5), RGB, dtype=np.uint8).shape == (3, 7, 5)


@pytest.mark.parametrize(
    "crop",
    [
        Crop(-1, 0, 32, 32),
        Crop(0, 65, 32, 32),
        Crop(0, 0, 0, 32),
        Crop(0, 40, 32, -8),
        Crop(0, 0, math.nan, 32),
        Crop(0, 0, math.inf, 32),
    ],
)
def test_a_crop_that_is_not_inside_is_refused(file: bytes, crop: Crop) -> None:
    with pytest.raises(ValueError, match="not inside the picture of height and width"):
        _crops.render(file, (64, 96), crop, (8, 8), RGB, dtype=np.uint8)


def test_floats_are_what_shows() -> None:
    spots: dict[str, Any] = {
        "center": [[30, 20], [60, 40]],
        "covariance": [np.eye(2) * 90] * 2,
        "color": [[1.5, 0.5, 0.5], [-0.5, 0.5, 0.5]],
    }
    file = image_gip.pack(spots, width=96, height=64)
    part = _crops.render(file, (64, 96), Crop(0, 0, 64, 96), (64, 96), RGB, dtype="f4")
    raw = image_gip.decode(file, dtype=np.float32, planar=True)
    assert raw.max() > 1.2
    assert raw.min() < -0.2
    assert np.array_equal(part, raw.clip(0, 1))


def test_random_crops_have_the_areas_and_aspects_asked_for() -> None:
    random = np.random.default_rng(1)
    scale, ratio = (0.1, 0.6), (0.5, 2.0)
    shares, aspects, mirrored = [], [], 0
    for _ in range(2000):
        draws = random.random(_crops.DRAWS)
        crop = _crops.random_resized((500, 700), scale, ratio, 0.25, draws)
        assert crop.top >= 0
        assert crop.left >= 0
        assert crop.top + crop.height <= 500
        assert crop.left + crop.width <= 700
        shares.append(crop.height * crop.width / 350_000)
        aspects.append(math.log2(crop.width / crop.height))
        mirrored += crop.flip
    assert 0.095 < min(shares) < 0.12
    assert 0.55 < max(shares) < 0.605
    assert abs(np.mean(shares) - 0.35) < 0.02
    assert -1.02 < min(aspects) < -0.9
    assert 0.9 < max(aspects) < 1.02
    assert 430 < mirrored < 570


def test_a_crop_that_never_fits_is_the_largest_in_the_middle() -> None:
    draws = [0.99] * _crops.DRAWS
    crop = _crops.random_resized((1000, 10), (1.0, 1.0), (3 / 4, 4 / 3), 0.0, draws)
    assert crop == pytest.approx((493 + 1 / 3, 0, 13 + 1 / 3, 10, False))


def test_the_middle() -> None:
    assert _crops.centered((200, 300), (224, 224), 256) == (12.5, 62.5, 175, 175, False)


@pytest.mark.parametrize("size", [0, (3,), (0, 3), (3.5, 2), (1, 2, 3)])
def test_wrong_sizes_are_refused(size: Any) -> None:
    with pytest.raises(ValueError, match="it must be one or two whole numbers"):
        _crops.check_size(size)


@pytest.mark.parametrize("values", [(0, 1), (0.5, 0.4), (0.5, 1.1), (1,)])
def test_wrong_ranges_are_refused(values: Any) -> None:
    with pytest.raises(ValueError, match="scale is"):
        _crops.check_range("scale", values, 1.0)


def test_torch_is_imported_by_its_module_alone() -> None:
    modules = "image_gip, image_gip.pillow, image_gip._crops"
    code = f"import sys, {modules}; assert not {{'torch', 'datasets'}} & sys.modules.keys()"
    subprocess.run([sys.executable, "-c", code], check=True)
