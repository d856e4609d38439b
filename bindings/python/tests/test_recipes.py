"""The Python code of the documentation runs as it stands there."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import HAS_TORCH, ROOT, STAND_IN, draw
from PIL import Image

import image_gip

NAMES = ("README.md", "docs/python.md", "bindings/python/README.md")
PAGES = [ROOT / name for name in NAMES]
RECIPES = [
    (page.name, heading, code)
    for page in PAGES
    for part in re.split(r"^#+ ", page.read_text(), flags=re.MULTILINE)
    for heading in [part.partition("\n")[0]]
    for code in re.findall(r"^```python\n(.*?)^```", part, flags=re.MULTILINE | re.DOTALL)
    # Those are run by the tests of integrations/ray, where Ray is installed.
    if "image_gip.ray" not in code
]

#: Renders by the formula of GaussianImage's code, without its order and tiles.
CHECKPOINTS = """
def theirs(center, covariance, color):
    y, x = np.mgrid[0:64, 0:96]
    sums = np.zeros((64, 96, 3))
    for (u, v), (xx, xy, yy), rgb in zip(center, covariance, color, strict=True):
        determinant = xx * yy - xy * xy
        a, b, c = yy / determinant, -xy / determinant, xx / determinant
        dx, dy = u - x, v - y
        sigma = 0.5 * (a * dx * dx + c * dy * dy) + b * dx * dy
        alpha = np.minimum(1, np.exp(-sigma))
        sums += np.where((sigma < 0) | (alpha < 1 / 255), 0, alpha)[..., None] * rgb
    return sums.clip(0, 1)


def check(saved, covariance, center, color_norm=False):
    color = saved["_features_dc"].astype(float)
    color = 1 / (1 + np.exp(-color)) if color_norm else color
    expected = theirs(center, covariance, color)
    gaussians = from_checkpoint(saved, 96, 64, color_norm)
    found = image_gip.render(gaussians, width=96, height=64, kernel="exponential", dtype="f4")
    source = np.random.default_rng(2).uniform(0, 1, expected.shape)
    found = found.clip(0, 1)
    psnr = [-10 * np.log10(((image - source) ** 2).mean()) for image in (found, expected)]
    assert abs(psnr[0] - psnr[1]) < 0.01
    near = -10 * np.log10(((found - expected) ** 2).mean())
    assert near > 60 and expected.std() > 0.1, near


random = np.random.default_rng(1)
raw = {name: random.uniform(0, 1, (200, width)).astype("f4") for name, width in
       {"_cholesky": 3, "_scaling": 2, "_rotation": 1, "_features_dc": 3}.items()}
raw["_xyz"] = np.arctanh(random.uniform(-1, 1, (200, 2))).astype("f4")
raw["_scaling"] *= 6
raw["_cholesky"] *= 6
half = np.array([48, 32])
center = half * np.tanh(raw["_xyz"]) + half
l11, l21, l22 = (raw["_cholesky"] + (0.5, 0, 0.5)).T
check({name: raw[name] for name in ("_xyz", "_cholesky", "_features_dc")},
      np.stack([l11 * l11, l11 * l21, l21 * l21 + l22 * l22], 1), center)
turned = []
for scale, (rotation,) in zip(np.abs(raw["_scaling"] + 0.5), raw["_rotation"], strict=True):
    angle = 2 * np.pi / (1 + np.exp(-rotation))
    # As glm fills a matrix column by column.
    matrix = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]).T
    product = matrix @ np.diag(scale**2) @ matrix.T
    turned.append((product[0, 0], product[0, 1], product[1, 1]))
check({name: raw[name] for name in ("_xyz", "_scaling", "_rotation", "_features_dc")},
      turned, center)
with np.load("checkpoint.npz") as loaded:
    plus = dict(loaded)
whole = plus["_cov2d"] + plus["slv_bound"]
check(plus, whole, plus["_xyz"])
check(plus, whole, plus["_xyz"], color_norm=True)
"""

#: What a recipe does not show by itself.
CHECKS = {
    "Checkpoints of GaussianImage and GaussianImage++": CHECKPOINTS,
    "Upright pictures": (
        "for orientation in range(1, 9):\n"
        "    image = Image.fromarray(image_gip.decode('photo.gip'))\n"
        "    image.getexif()[0x0112] = orientation\n"
        "    turned = upright(np.asarray(image), orientation)\n"
        "    assert np.array_equal(turned, ImageOps.exif_transpose(image))\n"
    ),
    "Training with PyTorch": (
        "pictures = Pictures('.', crop)\n"
        "assert len(pictures) == 1\n"
        "assert pictures[0].shape == (3, 224, 224)\n"
        "assert batch.images.shape == (3, 3, 224, 224)\n"
        "assert list(batch.errors) == [1]\n"
    ),
}


@pytest.fixture(scope="module")
def photo_file() -> bytes:
    return image_gip.encode(draw(288, 192, 3), bpp=1, effort=1)


def save_checkpoint(path: Path) -> None:
    """Saves what the code of GaussianImage++ saves, for a picture of 96 x 64 pixels."""
    random = np.random.default_rng(7)
    tensors = {
        "_xyz": random.uniform(0, (96, 64), (150, 2)),
        "_cov2d": random.uniform((0, -3, 0), (30, 3, 20), (150, 3)),
        "_features_dc": random.uniform(-0.3, 0.7, (150, 3)),
        "_opacity": np.ones((150, 1)),
        "slv_bound": np.tile([1.4, 0, 1.4], (150, 1)),
    }
    # Those that are left are positive definite.
    xx, xy, yy = (tensors["_cov2d"] + tensors["slv_bound"]).T
    kept = xx * yy - xy * xy > 0.1
    np.savez(path, **{name: tensor[kept].astype(np.float32) for name, tensor in tensors.items()})


@pytest.mark.parametrize(("page", "heading", "code"), RECIPES, ids=lambda text: text[:30])
def test_recipe(page: str, heading: str, code: str, tmp_path: Path, photo_file: bytes) -> None:
    (tmp_path / "photo.gip").write_bytes(photo_file)
    (tmp_path / "photos").mkdir()
    Image.fromarray(draw(288, 192, 3)).save(tmp_path / "photo.png")
    Image.fromarray(draw(48, 32, 3)).save(tmp_path / "photos" / "first.png")
    save_checkpoint(tmp_path / "checkpoint.npz")
    script = tmp_path / "recipe.py"
    script.write_text(code + CHECKS.get(heading, ""))
    paths = {} if HAS_TORCH else {"PYTHONPATH": str(STAND_IN)}
    command = [sys.executable, "-W", "error", str(script)]
    subprocess.run(command, cwd=tmp_path, env=os.environ | paths, check=True)


def test_the_recipes_are_found() -> None:
    assert len(RECIPES) >= 10
    assert set(CHECKS) <= {heading for _, heading, _ in RECIPES}
