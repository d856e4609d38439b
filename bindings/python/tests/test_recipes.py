"""The Python code of the documentation runs as it stands there."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT, draw
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

#: As much of torch as a `Dataset` needs, where there is none.
TORCH = """
import numpy


class Tensor(numpy.ndarray):
    def permute(self, *axes):
        return self.transpose(axes)


def from_numpy(array):
    return array.view(Tensor)
"""
DATASET = "class Dataset:\n    pass\n"

#: What a recipe does not show by itself.
CHECKS = {
    "Upright pictures": (
        "for orientation in range(1, 9):\n"
        "    image = Image.fromarray(image_gip.decode('photo.gip'))\n"
        "    image.getexif()[0x0112] = orientation\n"
        "    turned = upright(np.asarray(image), orientation)\n"
        "    assert np.array_equal(turned, ImageOps.exif_transpose(image))\n"
    ),
    "A torch `Dataset` that decodes at training size": (
        "pictures = Pictures('.', (64, 48))\n"
        "assert len(pictures) == 1\n"
        "assert pictures[0].shape == (3, 48, 64)\n"
    ),
}


@pytest.fixture(scope="module")
def photo_file() -> bytes:
    return image_gip.encode(draw(288, 192, 3), bpp=1, effort=1)


@pytest.mark.parametrize(("page", "heading", "code"), RECIPES, ids=lambda text: text[:30])
def test_recipe(page: str, heading: str, code: str, tmp_path: Path, photo_file: bytes) -> None:
    (tmp_path / "photo.gip").write_bytes(photo_file)
    (tmp_path / "photos").mkdir()
    Image.fromarray(draw(288, 192, 3)).save(tmp_path / "photo.png")
    Image.fromarray(draw(48, 32, 3)).save(tmp_path / "photos" / "first.png")
    if importlib.util.find_spec("torch") is None:
        (tmp_path / "torch" / "utils").mkdir(parents=True)
        (tmp_path / "torch" / "__init__.py").write_text(TORCH)
        (tmp_path / "torch" / "utils" / "data.py").write_text(DATASET)
    script = tmp_path / "recipe.py"
    script.write_text(code + CHECKS.get(heading, ""))
    subprocess.run([sys.executable, "-W", "error", script], cwd=tmp_path, check=True)


def test_the_recipes_are_found() -> None:
    assert len(RECIPES) >= 10
    assert set(CHECKS) <= {heading for _, heading, _ in RECIPES}
