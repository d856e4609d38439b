"""`render` and `pack`: Gaussians that come from elsewhere."""

import io
import subprocess
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from conftest import VECTORS, chunks, draw
from numpy.typing import NDArray

import image_gip
from image_gip import Limits, Quantizer

WIDTH, HEIGHT = 97, 61
SIZE: dict[str, Any] = {"width": WIDTH, "height": HEIGHT}

Gaussians = NDArray[Any]


def some(count: int = 200, channels: int = 3, seed: int = 1) -> Gaussians:
    """Gaussians of many sizes and directions, some of them partly beside the picture."""
    random = np.random.default_rng(seed)
    factors = np.zeros((count, 2, 2))
    sizes = 2 ** random.uniform(0.5, 3, count)
    factors[:, 0, 0] = sizes * random.uniform(0.5, 1.5, count)
    factors[:, 1, 0] = sizes * random.uniform(-0.5, 0.5, count)
    factors[:, 1, 1] = sizes
    kind = [("center", "f4", (2,)), ("covariance", "f4", (2, 2)), ("color", "f4", (channels,))]
    gaussians = np.empty(count, kind)
    gaussians["center"] = random.uniform(-3, [WIDTH + 3, HEIGHT + 3], (count, 2))
    gaussians["covariance"] = factors @ factors.swapaxes(1, 2)
    gaussians["color"] = random.uniform(-0.5, 0.5, (count, channels))
    return gaussians


def oracle(
    gaussians: Gaussians, width: int, height: int, cutoff: float | None, base: NDArray[Any]
) -> NDArray[np.float64]:
    """The sums at the stored size (specification, sections 9.2 to 9.4), in float64."""
    y, x = np.mgrid[0:height, 0:width] + 0.5
    sums = np.broadcast_to(base / 65535, (height, width, base.size)).copy()
    for center, covariance, color in gaussians.tolist():
        (a, b), (_, d) = np.linalg.inv(np.asarray(covariance, np.float64))
        dx, dy = x - center[0], y - center[1]
        q = a * dx**2 + 2 * b * dx * dy + d * dy**2
        if cutoff is None:
            weight = np.where(q < 4, (1 - q / 4) ** 2, 0)
        else:
            weight = np.where(q <= cutoff, np.exp(-q / 2), 0)
        sums += weight[..., None] * np.asarray(color)
    return sums


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_the_formulas_of_the_kernels(channels: int) -> None:
    gaussians = some(channels=channels)
    base = np.array([0, 40000, 65535, 12345][:channels])
    for kernel, cutoff in [("quartic", None), ("exponential", 64.0)]:
        named: Any = {"kernel": kernel, "cutoff": cutoff, "base_color": base, "depth": 16}
        found = image_gip.render(gaussians, **SIZE, **named, dtype=np.float32)
        expected = oracle(gaussians, WIDTH, HEIGHT, cutoff, base)
        assert np.abs(found.reshape(expected.shape) - expected).max() < 1e-4
        assert np.abs(expected).max() > 0.5
        sixteen = image_gip.render(gaussians, **SIZE, **named).reshape(expected.shape)
        assert sixteen.dtype == np.uint16
        assert np.abs(sixteen / 65535 - expected.clip(0, 1)).max() < 1e-4


def test_the_cutoff_of_the_exponential_kernel() -> None:
    one = some(1, channels=1)
    one["center"], one["covariance"], one["color"] = (40, 30), np.eye(2) * 25, 1
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH] + 0.5
    q = ((x - 40) ** 2 + (y - 30) ** 2) / 25
    for given, cutoff in [(None, 11.082527), (9.0, 9.0)]:
        shown = image_gip.render(one, **SIZE, kernel="exponential", cutoff=given, dtype="f4")
        np.testing.assert_array_equal(shown > 0, q <= cutoff)


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_a_file_of_floats_shows_what_is_rendered(channels: int) -> None:
    base = [257 * value for value in (3, 100, 7, 200)][:channels]
    for kernel in ("quartic", "exponential"):
        options: Any = {"kernel": kernel, "base_color": base}
        file = image_gip.pack(some(channels=channels), **SIZE, **options)
        info = image_gip.info(file)
        assert (info.size, info.kernel, info.base_color) == ((WIDTH, HEIGHT), kernel, tuple(base))
        assert info.coding == "packed"
        # In the order of the file.
        exact = image_gip.gaussians(file, cholesky=True)
        assert exact.dtype.names == ("center", "cholesky", "color")
        requests: list[Any] = [
            {},
            {"dtype": np.float32, "threads": 2},
            {"size": (40, 30)},
            {"scale": 2, "region": (10, 20, 70, 50), "dtype": np.uint16},
        ]
        for request in requests:
            shown = image_gip.render(exact, like=info, **request)
            np.testing.assert_array_equal(shown, image_gip.decode(file, **request))
        assert image_gip.pack(exact, like=info) == file


def test_gaussians_come_back() -> None:
    gaussians = some()
    back = image_gip.gaussians(image_gip.pack(gaussians, **SIZE))
    energy = (gaussians["color"].astype(float) ** 2).sum(1) * np.sqrt(
        np.linalg.det(gaussians["covariance"].astype(float))
    )
    gaussians = gaussians[np.argsort(-energy)]
    np.testing.assert_array_equal(back["center"], gaussians["center"])
    np.testing.assert_array_equal(back["color"], gaussians["color"])
    np.testing.assert_allclose(back["covariance"], gaussians["covariance"], 1e-5, 1e-5)
    assert back.dtype == gaussians.dtype


def test_a_file_of_the_encoder_is_rendered_and_packed_again(file: bytes) -> None:
    info = image_gip.info(file)
    exact = image_gip.gaussians(file, cholesky=True)
    shown = image_gip.decode(file, texture=False, dtype=np.float32)
    np.testing.assert_array_equal(image_gip.render(exact, like=info, dtype="f4"), shown)
    again = image_gip.decode(image_gip.pack(exact, like=info), dtype=np.float32)
    np.testing.assert_allclose(again, shown, atol=1e-5)
    rounded = image_gip.render(image_gip.gaussians(file), like=info, dtype="f4")
    np.testing.assert_allclose(rounded, shown, atol=1e-4)


def test_vectors_are_rendered_as_they_are_decoded() -> None:
    rendered = 0
    for path in sorted(VECTORS.glob("*.gip")):
        try:
            info = image_gip.info(path, limits=Limits.none())
            expected = image_gip.decode(path, texture=False, limits=Limits.none())
        except image_gip.GipError:
            continue
        exact = image_gip.gaussians(path, cholesky=True, limits=Limits.none())
        # Some have Gaussians that are not drawn.
        bounds = [("center", 2**24), ("cholesky", 2**24), ("color", 2**16)]
        drawn = (exact["cholesky"][:, [0, 2]] >= 2**-12).all(1)
        for name, most in bounds:
            drawn &= (np.abs(exact[name]) <= most).all(1)
        exact = exact[drawn]
        found = image_gip.render(exact, like=info, limits=Limits.none())
        np.testing.assert_array_equal(found, expected)
        rendered += 1
    assert rendered > 5


def test_arrays_by_name_of_any_real_type() -> None:
    gaussians = some(channels=1)
    expected = image_gip.render(gaussians, **SIZE)
    assert expected.shape == (HEIGHT, WIDTH)
    fields: dict[str, Any] = {name: gaussians[name] for name in gaussians.dtype.names or ()}
    factors = np.linalg.cholesky(fields["covariance"].astype(np.float64))
    cholesky = factors[:, [0, 1, 1], [0, 0, 1]]
    stored = io.BytesIO()
    np.savez(stored, **fields)
    stored.seek(0)
    alternatives: list[Any] = [
        fields,
        fields | {"color": fields["color"][:, 0]},
        fields | {"color": fields["color"][:, 0].tolist(), "center": fields["center"].tolist()},
        fields | {"center": np.asfortranarray(fields["center"].astype(">f8"))},
        fields | {"cholesky": cholesky},
        {"center": fields["center"], "cholesky": cholesky, "color": fields["color"]},
        gaussians.view(np.recarray),
        np.repeat(gaussians, 2)[::2],
        np.load(stored),
    ]
    for alternative in alternatives:
        found = image_gip.render(alternative, **SIZE)
        np.testing.assert_array_equal(found, expected)
    whole: dict[str, Any] = {
        "center": [[5, 5]],
        "covariance": np.eye(2, dtype=np.int64)[None] * 9,
        "color": [1],
    }
    assert image_gip.render(whole, width=10, height=10).max() > 200


def test_no_gaussians() -> None:
    none = some(0, channels=4)
    shown = image_gip.render(none, **SIZE, base_color=257 * 9)
    assert shown.shape == (HEIGHT, WIDTH, 4)
    assert (shown == 9).all()
    for precision in ("f32", "packed", "entropy"):
        file = image_gip.pack(none, **SIZE, base_color=257 * 9, precision=precision)
        np.testing.assert_array_equal(image_gip.decode(file), shown)


def test_alpha_over_a_background_and_into_an_array() -> None:
    gaussians = some(channels=4)
    file = image_gip.pack(gaussians, **SIZE)
    exact, info = image_gip.gaussians(file, cholesky=True), image_gip.info(file)
    blue = (0, 0, 255)
    over = image_gip.render(exact, like=info, mode="RGB", background=blue)
    np.testing.assert_array_equal(over, image_gip.decode(file, mode="RGB", background=blue))
    out = np.empty((HEIGHT, WIDTH, 4), np.uint8)
    assert image_gip.render(exact, like=info, out=out) is out
    np.testing.assert_array_equal(out, image_gip.decode(file))
    with pytest.raises(ValueError, match="out has shape"):
        image_gip.render(exact, like=info, out=out[1:])


def psnr(a: NDArray[Any], b: NDArray[Any]) -> float:
    error = ((a.astype(float) - b) ** 2).mean() / 255**2
    return float(-10 * np.log10(max(error, 1e-12)))


def test_packed_codes() -> None:
    gaussians = some()
    shown = image_gip.render(gaussians, **SIZE)
    last = (0, 0.0)
    for bits in [(9, 7, 4), (12, 10, 6), (16, 16, 12)]:
        file = image_gip.pack(gaussians, **SIZE, precision="packed", bits=bits)
        found = (len(file), psnr(image_gip.decode(file), shown))
        assert found > last
        assert found[1] > last[1]
        last = found
    assert last[1] > 50
    assert image_gip.pack(gaussians, **SIZE, precision="packed") == image_gip.pack(
        gaussians, **SIZE, precision="packed", bits=(12, 10, 6)
    )

    names: list[Literal["cholesky", "covariance", "rotation-scale"]]
    names = ["cholesky", "covariance", "rotation-scale"]
    for name in names:
        file = image_gip.pack(gaussians, **SIZE, parameterization=name)
        assert image_gip.info(file).parameterization == name
        assert psnr(image_gip.decode(file), shown) > 60

    places = Quantizer("linear", 10, 0.125, -8)
    shapes = Quantizer("log", bits=8, scale=0.02, offset=-1)
    quantizers = [places, places, shapes, None, shapes, None, None, None]
    file = image_gip.pack(gaussians, **SIZE, precision="packed", quantizers=quantizers)
    back = image_gip.gaussians(file, cholesky=True)
    assert np.array_equal(back["center"] * 8, (back["center"] * 8).round())
    steps = (np.log(back["cholesky"][:, 0]) + 1) / 0.02
    np.testing.assert_allclose(steps, steps.round(), atol=1e-3)
    assert set(back["color"][:, 0]) <= set(gaussians["color"][:, 0])


def test_entropy_coding() -> None:
    gaussians = some(400)
    shown = image_gip.render(gaussians, **SIZE)
    last = (10**9, 99.0)
    for step in (0.003, 0.02, 0.15):
        options: Any = {"precision": "entropy", "color_step": step}
        file = image_gip.pack(gaussians, **SIZE, **options)
        assert image_gip.info(file).coding == "entropy"
        assert image_gip.pack(gaussians, **SIZE, **options, threads=2) == file
        found = (len(file), psnr(image_gip.decode(file), shown))
        assert found < last
        last = found
    assert len(file) < len(image_gip.pack(gaussians, **SIZE)) / 4
    file = image_gip.pack(gaussians, **SIZE, precision="entropy", first_layer=300)
    assert image_gip.prefixes(file)[0].bytes <= 300
    with pytest.raises(ValueError, match="quartic"):
        image_gip.pack(gaussians, **SIZE, precision="entropy", kernel="exponential")


def test_metadata() -> None:
    exif = b"II*\0\x08\0\0\0\0\0\0\0\0\0"
    options: Any = {"cicp": (12, 13), "icc": b"profile", "exif": exif, "xmp": b"<x/>"}
    texts = {"Title": "Spots"}
    file = image_gip.pack(some(), **SIZE, **options, texts=texts, content_light=(900, 100))
    info = image_gip.info(file)
    assert (info.cicp, info.icc, info.exif, info.xmp) == tuple(options.values())
    assert info.texts == (("Title", "Spots"),)
    assert info.content_light == (900, 100)
    with pytest.warns(image_gip.MetadataWarning):
        file = image_gip.pack(some(), **SIZE, icc=b"profile", texts=texts, metadata="none")
    assert image_gip.info(file).texts == ()
    with pytest.raises(ValueError, match="keyword"):
        image_gip.pack(some(), **SIZE, texts={"": "no keyword"})


def test_what_like_gives_can_be_changed(textured: bytes) -> None:
    info = image_gip.info(textured)
    gaussians = image_gip.gaussians(textured, cholesky=True)
    file = image_gip.pack(gaussians, like=info, kernel="exponential", height=64, depth=16)
    changed = image_gip.info(file)
    assert (changed.width, changed.height, changed.depth) == (info.width, 64, 16)
    assert (changed.kernel, changed.base_color) == ("exponential", info.base_color)
    assert abs(changed.cutoff - 11.082527) < 1e-6
    # Texture is no Gaussian of the picture.
    assert not [part for part in chunks(file) if part.kind == "tXTR"]
    again = image_gip.pack(gaussians, like=changed, cutoff=9)
    assert image_gip.info(again).cutoff == 9


def test_arrays_of_the_tool(textured: bytes, tool: Path, tmp_path: Path) -> None:
    def gip(*arguments: str) -> None:
        subprocess.run([tool, *arguments], cwd=tmp_path, check=True, capture_output=True)

    path = tmp_path / "a.gip"
    path.write_bytes(textured)
    gip("export", "a.gip", "a.npz")
    info, expected = image_gip.info(path), image_gip.gaussians(path)
    with np.load(tmp_path / "a.npz") as arrays:
        for name in expected.dtype.names or ():
            np.testing.assert_array_equal(arrays[name], expected[name])
        header: Any = {name: arrays[name] for name in ("width", "height", "depth", "cutoff")}
        header |= {"kernel": str(arrays["kernel"]), "base_color": arrays["base_color"]}
        assert header["kernel"] == info.kernel
        shown = image_gip.render(arrays, **header)
        np.testing.assert_array_equal(shown, image_gip.decode(path, texture=False))
        # They say these things themselves.
        np.testing.assert_array_equal(image_gip.render(arrays), shown)
        darker = image_gip.render(arrays, base_color=0)
        np.testing.assert_array_equal(darker, image_gip.render(expected, like=info, base_color=0))
        assert arrays["texture_center"].shape[1:] == (2,)
        assert (arrays["texture_size"] > 1).all()
        file = image_gip.pack(arrays, **header)
        assert image_gip.pack(arrays) == file
        gip("import", "a.npz", "b.gip")
        assert (tmp_path / "b.gip").read_bytes() == file
        fields = {name: arrays[name] for name in ("center", "cholesky", "color", *header)}
    # As others save them.
    fields["center"] = np.asfortranarray(fields["center"].astype(">f8"))
    fields["width"] = fields["width"].astype(np.uint64)
    fields["kernel"] = np.array(b"quartic")
    np.savez_compressed(tmp_path / "c.npz", **fields)
    gip("import", "c.npz", "c.gip")
    assert (tmp_path / "c.gip").read_bytes() == file
    for name in ("width", "height", "depth", "base_color"):
        fields[name] = fields[name].astype(np.float64)
    # Both take the same.
    with np.load(tmp_path / "c.npz") as arrays:
        assert image_gip.pack(arrays) == file
    assert image_gip.pack(fields) == file
    np.savez(tmp_path / "d.npz", **fields)
    gip("import", "d.npz", "d.gip")
    assert (tmp_path / "d.gip").read_bytes() == file
    fields["base_color"] = np.float32(257)
    np.savez(tmp_path / "e.npz", **fields)
    gip("import", "e.npz", "e.gip")
    assert image_gip.pack(fields) == (tmp_path / "e.gip").read_bytes()
    np.savez(tmp_path / "e.npz", spots=expected)
    failed = subprocess.run(
        [tool, "import", "e.npz", "e.gip"], cwd=tmp_path, capture_output=True, text=True
    )
    assert failed.returncode == 1
    assert "save each of its fields" in failed.stderr


@pytest.mark.parametrize("index", [0, 3])
@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("center", (np.nan, 0), "centre"),
        ("center", (0, 3e7), "centre"),
        ("covariance", np.full((2, 2), np.inf), "finite"),
        ("covariance", [[1, np.nan], [0, 1]], "finite"),
        ("covariance", [[4, 1], [2, 4]], "symmetric"),
        ("covariance", [[4, 4], [4, 4]], "positive definite"),
        ("covariance", [[1, 2], [2, 1]], "positive definite"),
        ("covariance", [[-1, 0], [0, 1]], "positive definite"),
        ("covariance", [[1, 0], [0, -1]], "positive definite"),
        ("covariance", np.zeros((2, 2)), "positive definite"),
        ("covariance", np.eye(2) * 1e-9, "2.-12 to 2.24 pixels"),
        ("color", (0, np.nan, 0), "colour"),
        ("color", (0, 70000, 0), "colour"),
    ],
)
def test_bad_gaussians_are_refused_by_index(
    index: int, field: str, value: Any, message: str
) -> None:
    gaussians = some(6)
    gaussians[field][index] = value
    # A later one does not count.
    gaussians["covariance"][5], gaussians["color"][5] = -1, np.inf
    for call in (image_gip.render, image_gip.pack):
        with pytest.raises(ValueError, match=f"^Gaussian {index}: .*{message}"):
            call(gaussians, **SIZE)
    with pytest.raises(ValueError, match=f"^Gaussian {index}: "):
        image_gip.pack(gaussians, **SIZE, precision="entropy")


def test_what_rounding_makes_bad_is_refused_by_index() -> None:
    gaussians = some(5)
    gaussians["covariance"][2] = [[64, 64], [64, 64.0001]]
    options: Any = {"precision": "packed", "parameterization": "covariance", "bits": (8, 3, 6)}
    with pytest.raises(ValueError, match=r"^Gaussian 2: rounded by the quantizers"):
        image_gip.pack(gaussians, **SIZE, **options)
    gaussians["center"][1], gaussians["covariance"][1] = (-4000, 0), np.eye(2) * 3000**2
    with pytest.raises(ValueError, match=r"^Gaussian 1: .*outside"):
        image_gip.pack(gaussians, **SIZE, precision="entropy")


def test_fields_that_do_not_fit() -> None:
    gaussians = some(5)
    fields: dict[str, Any] = {name: gaussians[name] for name in gaussians.dtype.names or ()}

    def refused(kind: type[Exception], match: str, changed: Any) -> None:
        for call in (image_gip.render, image_gip.pack):
            with pytest.raises(kind, match=match):
                call(changed, **SIZE)

    for name in fields:
        rest = {other: fields[other] for other in fields if other != name}
        refused(ValueError, f"the Gaussians have n.* {name}", rest)
    refused(ValueError, r"center has shape \(5, 3\)", fields | {"center": np.zeros((5, 3))})
    refused(ValueError, r"it must be \(5, 2, 2\)", fields | {"covariance": np.zeros((5, 3))})
    refused(ValueError, r"it must be \(5, 3\)", fields | {"cholesky": np.zeros((4, 3))})
    refused(ValueError, r"color has shape \(5, 5\)", fields | {"color": np.zeros((5, 5))})
    refused(ValueError, r"color has shape \(4,\)", fields | {"color": np.zeros(4)})
    factors = np.ones((5, 3))
    refused(ValueError, "Gaussian 0: .*must agree", fields | {"cholesky": factors})
    refused(TypeError, "color has dtype complex128", fields | {"color": np.ones((5, 3), complex)})
    refused(TypeError, "center has dtype", fields | {"center": [["a", "b"]] * 5})
    refused(TypeError, "masked", fields | {"color": np.ma.zeros((5, 3))})
    refused(TypeError, "masked", np.ma.array(gaussians))
    refused(TypeError, "structured array or a mapping", np.zeros((5, 9)))
    refused(TypeError, "structured array or a mapping", [1, 2])
    refused(ValueError, "center has shape", gaussians[:4].reshape(2, 2))


def test_arguments_that_do_not_fit(file: bytes) -> None:
    gaussians = some(5)

    def refused(kind: type[Exception], match: str, **options: Any) -> None:
        with pytest.raises(kind, match=match):
            image_gip.pack(gaussians, **SIZE | options)

    for call in (image_gip.render, image_gip.pack):
        with pytest.raises(TypeError, match="width and height"):
            call(gaussians, width=5)
        with pytest.raises(TypeError, match=r"like must be an image_gip\.Info"):
            call(gaussians, like=file)  # type: ignore[arg-type]
    gray = image_gip.info(image_gip.encode(draw(20, 20, 1), gaussians=3, effort=1))
    refused(ValueError, "base_color has 1 numbers", like=gray)
    refused(ValueError, "width 0", width=0)
    refused(ValueError, "height 2097152", height=1 << 21)
    refused(ValueError, "depth 12", depth=12)
    refused(ValueError, "kernel 'gauss'|kernel \"gauss\"", kernel="gauss")
    refused(ValueError, "cutoff of the quartic kernel is 4", cutoff=5)
    for cutoff in (0, -1, 65, np.nan, 1e300):
        refused(ValueError, "cut-off", kernel="exponential", cutoff=cutoff)
    refused(ValueError, "multiples of 257", base_color=5)
    refused(ValueError, "base_color 65536", base_color=65536)
    refused(ValueError, "base_color has 2 numbers", base_color=(0, 0))
    refused(TypeError, "base_color must be an integer", base_color=0.5)
    refused(ValueError, "precision", precision="f16")
    refused(ValueError, "parameterization", parameterization="angle")
    refused(TypeError, "no bits", bits=(12, 10, 6))
    refused(TypeError, "no color_step", precision="packed", color_step=0.1)
    refused(TypeError, "no parameterization", precision="entropy", parameterization="cholesky")
    refused(TypeError, "exclude", precision="packed", bits=(9, 9, 9), quantizers=[None] * 8)
    refused(ValueError, "a number of bits 17", precision="packed", bits=(9, 17, 9))
    for step in (0, -1, np.nan, 1e9):
        refused(ValueError, "step of colour", precision="entropy", color_step=step)
    refused(ValueError, "one for each component", precision="packed", quantizers=[None] * 7)
    bad: list[tuple[Any, type[Exception]]] = [
        (("linear", 17, 1, 0), ValueError),
        (("linear", 8, 0, 0), ValueError),
        (("log", 8, 1, np.nan), ValueError),
        (("cubic", 8, 1, 0), ValueError),
        (("linear", 8, 1), TypeError),
        (7, TypeError),
    ]
    for quantizer, kind in bad:
        refused(kind, "quantizer|bits", precision="packed", quantizers=[quantizer] * 8)
    with pytest.raises(image_gip.LimitError) as error:
        image_gip.render(gaussians, **SIZE, limits=Limits(max_gaussians=4))
    assert (error.value.wanted, error.value.allowed) == (5, 4)
    with pytest.raises(image_gip.LimitError):
        image_gip.render(gaussians, width=1 << 17, height=1)
    with pytest.raises(ValueError, match="region"):
        image_gip.render(gaussians, **SIZE, region=(90, 0, 20, 20))


def test_what_a_decoder_would_refuse_is_not_packed() -> None:
    gaussians = some(5)
    with pytest.raises(image_gip.LimitError) as error:
        image_gip.pack(gaussians, **SIZE, limits=Limits(max_gaussians=4))
    assert (error.value.wanted, error.value.allowed) == (5, 4)
    with pytest.raises(image_gip.LimitError, match="max_width"):
        image_gip.pack(gaussians, width=1 << 17, height=1)
    wide = Limits(max_width=1 << 17)
    file = image_gip.pack(gaussians, width=1 << 17, height=1, limits=wide)
    assert image_gip.info(file, limits=wide).size == (1 << 17, 1)
    # The work of a rendering.
    large = np.repeat(gaussians[:1], 3000)
    large["covariance"], large["color"] = np.eye(2) * 1e8, 1e-3
    for precision in ("f32", "packed", "entropy"):
        with pytest.raises(image_gip.LimitError, match="max_work"):
            image_gip.pack(large, width=2048, height=2048, precision=precision)


def test_fitted_gaussians_get_the_codes_of_the_encoder() -> None:
    gaussians = some(150)
    gaussians["color"] *= 0.4
    picture = image_gip.render(gaussians, **SIZE, base_color=110 * 257)
    keywords: dict[str, Any] = {"fitted": gaussians, "tune": "psnr"}
    file = image_gip.encode(picture, **keywords, base_color=110 * 257, psnr=40)
    error = np.square(image_gip.decode(file).astype(float) - picture).mean()
    assert 40 <= 10 * np.log10(255**2 / error) < 40.5
    assert len(file) < len(image_gip.pack(gaussians, **SIZE)) / 4
    small = image_gip.encode(picture, **keywords, base_color=(110 * 257,) * 3, bytes=800)
    assert len(small) <= 800
    for wrong in (
        {"base_color": 0},
        {"fitted": some(9, 1)},
        {"fitted": some(9), "precision": "f32"},
    ):
        with pytest.raises((TypeError, ValueError)):
            image_gip.encode(picture, **wrong)
    broken = some(9)
    broken["center"][7] = np.nan
    with pytest.raises(ValueError, match="Gaussian 7"):
        image_gip.encode(picture, fitted=broken)
    # What a mapping says of the picture holds.
    fields: dict[str, Any] = {name: gaussians[name] for name in ("center", "covariance", "color")}
    fields |= {**SIZE, "base_color": np.full(3, 110 * 257), "kernel": np.array("quartic")}
    assert image_gip.encode(picture, fitted=fields, tune="psnr", bytes=800) == small
    wrong_fields = {"width": 5, "height": np.int32(7), "depth": 16, "kernel": "exponential"}
    for name, value in wrong_fields.items():
        with pytest.raises(ValueError, match=f"have the {name} {value}; it must be"):
            image_gip.encode(picture, fitted=fields | {name: value})
    as_others_save_them = {"kernel": np.bytes_(b"quartic"), "width": float(WIDTH), "depth": 8.0}
    again = image_gip.encode(picture, fitted=fields | as_others_save_them, tune="psnr", bytes=800)
    assert again == small
    del fields["width"]
    with pytest.raises(TypeError, match="must be given"):
        image_gip.render(fields)
