"""Pictures with alpha as samples without it: composed over a background."""

from typing import Any

import numpy as np
import pytest
from conftest import VECTORS, draw
from numpy.typing import NDArray

import image_gip
from image_gip import StreamDecoder

FULL = {np.uint8: 255, np.uint16: 65535, np.float32: 1.0}


def cut_out(channels: int, dtype: Any = np.uint8) -> bytes:
    """A file of a disc with a soft edge, in an invisible colour of its own."""
    picture = draw(60, 40, channels)
    y, x = np.mgrid[0:40, 0:60]
    picture[..., -1] = np.clip(255 * (2 - np.hypot(x - 30, y - 20) / 9), 0, 255)
    scale = np.array(FULL[dtype] // 255, dtype)
    return image_gip.encode(picture.astype(dtype) * scale, bpp=6, effort=1)


FILES = {mode: cut_out(len(mode)) for mode in ("LA", "RGBA")}


def composed(samples: NDArray[Any], background: Any = None) -> NDArray[np.float64]:
    """What a viewer shows of samples with alpha over a background: white by default."""
    full = FULL[samples.dtype.type]
    shown = np.clip(samples.astype(np.float64) / full, 0, 1)
    color, alpha = shown[..., :-1], shown[..., -1:]
    behind = np.broadcast_to(full if background is None else background, color.shape) / full
    mixed: NDArray[np.float64] = (color * alpha + behind * (1 - alpha)) * full
    return mixed.squeeze()


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize(("stored", "mode"), [("LA", "L"), ("RGBA", "RGB")])
def test_over_white_by_default(stored: str, mode: Any, dtype: Any) -> None:
    file = FILES[stored]
    found = image_gip.decode(file, mode=mode, dtype=dtype)
    assert found.dtype == dtype
    assert found.shape == ((40, 60, 3) if mode == "RGB" else (40, 60))
    expected = composed(image_gip.decode(file, dtype=dtype))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 if dtype == np.float32 else 0.51)
    # The corner is transparent, and as white as the fit of alpha lets it be.
    assert found[0, 0].min() > 0.95 * FULL[dtype]


def test_gray_becomes_rgb() -> None:
    gray = image_gip.decode(FILES["LA"], mode="L", background=30)
    rgb = image_gip.decode(FILES["LA"], mode="RGB", background=30)
    np.testing.assert_array_equal(rgb, np.dstack([gray] * 3))
    tinted = image_gip.decode(FILES["LA"], mode="RGB", background=(250, 30, 10))
    np.testing.assert_array_equal(tinted[..., 1], gray)
    assert tinted[0, 0].tolist() != [30] * 3


@pytest.mark.parametrize(
    ("dtype", "background"),
    [
        (np.uint8, 0),
        (np.uint8, (255, 128, 0)),
        (np.uint8, np.array([9, 8, 7], np.uint8)),
        (np.uint16, [65535, 300, 12]),
        (np.float32, 0.25),
        (np.float32, (0.1, 0.5, 1)),
    ],
)
def test_backgrounds(dtype: Any, background: Any) -> None:
    file = FILES["RGBA"]
    found = image_gip.decode(file, mode="RGB", dtype=dtype, background=background)
    expected = composed(image_gip.decode(file, dtype=dtype), background)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 if dtype == np.float32 else 0.51)
    # A background asks for a picture without alpha.
    same = image_gip.decode(file, dtype=dtype, background=background)
    np.testing.assert_array_equal(found, same)


@pytest.mark.parametrize(
    "view",
    [
        {"size": (23, 17)},
        {"scale": 3},
        {"region": (10, 5, 30, 20)},
        {"size": (120, 80), "region": (31, 22, 50, 40)},
        {"threads": 2},
    ],
    ids=str,
)
def test_sizes_and_regions(view: dict[str, Any]) -> None:
    file = FILES["RGBA"]
    straight = image_gip.decode(file, **view)
    found = image_gip.decode(file, mode="RGB", background=(10, 200, 30), **view)
    assert found.shape[:2] == straight.shape[:2]
    np.testing.assert_allclose(found, composed(straight, (10, 200, 30)), rtol=0, atol=0.51)
    out = np.empty_like(found)
    assert image_gip.decode(file, out=out, background=(10, 200, 30), **view) is out
    np.testing.assert_array_equal(out, found)


def test_a_picture_that_arrives() -> None:
    stream = StreamDecoder().feed(FILES["RGBA"][:-40])
    found = stream.image(mode="RGB", background=0, size=(30, 20))
    expected = composed(stream.image(size=(30, 20)), 0)
    np.testing.assert_allclose(found, expected, rtol=0, atol=0.51)


def test_16_bits_are_kept() -> None:
    found = image_gip.decode(cut_out(4, np.uint16), mode="RGB")
    assert found.dtype == np.uint16
    assert found[0, 0].min() > 62000


def test_without_alpha_nothing_is_behind(file: bytes) -> None:
    expected = image_gip.decode(file)
    np.testing.assert_array_equal(image_gip.decode(file, background=0), expected)
    np.testing.assert_array_equal(image_gip.decode(file, mode="RGB", background=0), expected)
    gray = VECTORS / "gray16.gip"
    np.testing.assert_array_equal(
        image_gip.decode(gray, mode="RGB", background=(1, 2, 3))[..., 0], image_gip.decode(gray)
    )


@pytest.mark.parametrize(
    ("keywords", "kind", "message"),
    [
        ({"background": 256}, ValueError, "background 256; it must be 0 to 255"),
        ({"background": -1}, ValueError, "background -1; it must be 0 to 255"),
        ({"background": float("nan")}, ValueError, "background NaN; it must be 0 to 255"),
        ({"background": 255, "dtype": np.float32}, ValueError, "background 255; .* 0 to 1"),
        ({"background": (1, 2)}, ValueError, "has 2 numbers; it must be one, or .*: 3"),
        ({"background": ()}, ValueError, "has 0 numbers"),
        ({"background": "white"}, TypeError, "must be a number, or one for each colour channel"),
        ({"background": 0, "mode": "RGBA"}, TypeError, 'mode "RGBA" has alpha'),
        ({"background": -1e-30}, ValueError, "background -1e-30; it must be 0 to 255"),
        ({"background": (0, 0, 10**400)}, ValueError, "background inf; it must be 0 to 255"),
        ({"mode": "L"}, ValueError, 'mode "L" of a picture with mode "RGBA"'),
        ({"mode": "LA"}, ValueError, 'mode "LA" of a picture with mode "RGBA"'),
        ({"mode": "L", "background": 0}, ValueError, 'mode "L" of a picture with mode "RGBA"'),
    ],
    ids=str,
)
def test_what_is_refused(keywords: dict[str, Any], kind: type[Exception], message: str) -> None:
    with pytest.raises(kind, match=message):
        image_gip.decode(FILES["RGBA"], **keywords)
    with pytest.raises(kind, match=message):
        StreamDecoder().feed(FILES["RGBA"]).image(**keywords)
