"""Measures random crops for training, from .gip and from other formats at equal quality.

    pip install image-gip --requirement benchmarks/requirements.txt
    python benchmarks/crops.py --pictures FOLDER [FOLDER...] --files CACHE

Every PNG that is named or in one of the folders becomes a .gip of about the quality asked for,
without texture, whose SSIMULACRA2 the others then meet: JPEG (Pillow's default), WebP (method 6)
and AVIF (speed 6), each with the quality that comes nearest. The files are kept in the cache. Then
crops of 224 x 224 pixels are made of all files, the same ones for each format, with areas and
aspects as torchvision's ``RandomResizedCrop`` draws them. What is not rendered at the size of the
result is resampled by Pillow with the bilinear filter, which averages where it reduces.

Formats are measured in turns, and figures are medians, so that other work on the machine slows all
of them down alike. With two processes, each makes all crops.
"""

import argparse
import csv
import io
import json
import statistics
import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import simplejpeg
from numpy.typing import NDArray
from PIL import AvifImagePlugin, Image
from ssimulacra2 import compute_ssimulacra2

import image_gip
from image_gip import _crops
from image_gip._crops import Crop, Rendering

SIZE = 224
RGB = Rendering("RGB", None, True, None)
#: Formats of Pillow, and their options.
OTHERS: dict[str, dict[str, Any]] = {"JPEG": {}, "WEBP": {"method": 6}, "AVIF": {"speed": 6}}

Samples = NDArray[np.uint8]


def resized(image: Image.Image, box: tuple[float, float, float, float]) -> Samples:
    return np.asarray(image.resize((SIZE, SIZE), Image.Resampling.BILINEAR, box=box))


def of_gip(file: bytes, crop: Crop) -> Samples:
    stored = _crops.stored_size(file, None)
    return _crops.render(file, stored, crop, (SIZE, SIZE), RGB, dtype=np.uint8, planar=False)


def of_pillow(file: bytes, crop: Crop) -> Samples:
    with Image.open(io.BytesIO(file)) as image:
        return resized(image.convert("RGB"), box_of(crop, 1, 1))


def of_draft(file: bytes, crop: Crop) -> Samples:
    """By Pillow's libjpeg-turbo, at the least scale that has a pixel for each of the result."""
    with Image.open(io.BytesIO(file)) as image:
        width, height = image.size
        least = (int(width * SIZE / crop.width), int(height * SIZE / crop.height))
        image.draft("RGB", least)
        return resized(image, box_of(crop, image.width / width, image.height / height))


def of_simplejpeg(file: bytes, crop: Crop) -> Samples:
    """By simplejpeg's libjpeg-turbo, at such a scale."""
    height, width, _, _ = simplejpeg.decode_jpeg_header(file)
    least = (
        min(height, int(height * SIZE / crop.height)),
        min(width, int(width * SIZE / crop.width)),
    )
    samples = simplejpeg.decode_jpeg(
        file, min_height=least[0], min_width=least[1], min_factor=1, fastdct=True, fastupsample=True
    )
    scaled = Image.fromarray(samples)
    return resized(scaled, box_of(crop, scaled.width / width, scaled.height / height))


def box_of(crop: Crop, x: float, y: float) -> tuple[float, float, float, float]:
    """The crop in pixels of a decoded picture, with so many along x and y for each stored one."""
    right, bottom = crop.left + crop.width, crop.top + crop.height
    return crop.left * x, crop.top * y, right * x, bottom * y


#: What makes crops, and the suffix of its files.
READERS: dict[str, tuple[str, Callable[[bytes, Crop], Samples]]] = {
    "gip": ("gip", of_gip),
    "gip with texture": ("textured.gip", of_gip),
    "JPEG by Pillow": ("jpeg", of_pillow),
    "JPEG by Pillow at a smaller scale": ("jpeg", of_draft),
    "JPEG by simplejpeg at a smaller scale": ("jpeg", of_simplejpeg),
    "WebP by Pillow": ("webp", of_pillow),
    "AVIF by Pillow": ("avif", of_pillow),
}


def nearest(picture: Image.Image, kind: str, wanted: float) -> tuple[bytes, float]:
    """The file of a format whose SSIMULACRA2 is nearest to the one wanted."""
    tried: dict[int, tuple[bytes, float]] = {}

    def encode(quality: int) -> float:
        file = io.BytesIO()
        picture.save(file, kind, quality=quality, **OTHERS[kind])
        decoded = np.asarray(Image.open(io.BytesIO(file.getvalue())).convert("RGB"))
        tried[quality] = file.getvalue(), score(np.asarray(picture), decoded)
        return tried[quality][1]

    low, high = 1, 99
    while low < high:
        middle = (low + high) // 2
        low, high = (middle + 1, high) if encode(middle) < wanted else (low, middle)
    return min(tried.values(), key=lambda file: abs(file[1] - wanted))


def score(source: Samples, decoded: Samples) -> float:
    """SSIMULACRA2, by a package that takes files."""
    files = io.BytesIO(), io.BytesIO()
    for file, samples in zip(files, (source, decoded), strict=True):
        Image.fromarray(samples).save(file, "BMP")
    return float(compute_ssimulacra2(*files))


def make_files(picture: Path, quality: float, cache: Path) -> dict[str, float]:
    """Makes the files of a picture that are not there, and returns their SSIMULACRA2."""
    scores = cache / f"{picture.stem}.json"
    if scores.exists():
        found: dict[str, float] = json.loads(scores.read_text())
        return found
    image = Image.open(picture).convert("RGB")
    samples = np.asarray(image)
    plain = image_gip.encode(samples, quality=quality, texture=0)
    textured = image_gip.encode(samples, quality=quality)
    wanted = score(samples, image_gip.decode(plain))
    found = {"gip": wanted, "textured.gip": score(samples, image_gip.decode(textured))}
    (cache / f"{picture.stem}.gip").write_bytes(plain)
    (cache / f"{picture.stem}.textured.gip").write_bytes(textured)
    for kind in OTHERS:
        file, found[kind.lower()] = nearest(image, kind, wanted)
        (cache / f"{picture.stem}.{kind.lower()}").write_bytes(file)
    scores.write_text(json.dumps(found))
    return found


def draw_crops(files: list[bytes], each: int) -> list[list[Crop]]:
    random = np.random.default_rng(1)
    sizes = [_crops.stored_size(file, None) for file in files]
    shape = (each, _crops.DRAWS)
    return [
        [_crops.random_resized(size, (0.08, 1), (3 / 4, 4 / 3), 0, draws) for draws in rows]
        for size in sizes
        for rows in [random.random(shape)]
    ]


def make_crops(name: str, paths: list[Path], crops: list[list[Crop]]) -> float:
    """The seconds that all crops take, with the reading of each file for each crop."""
    AvifImagePlugin.DEFAULT_MAX_THREADS = 1
    reader = READERS[name][1]
    start = time.perf_counter()
    for path, of_picture in zip(paths, crops, strict=True):
        for crop in of_picture:
            assert reader(path.read_bytes(), crop).shape == (SIZE, SIZE, 3)
    return time.perf_counter() - start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument(
        "--pictures", type=Path, nargs="+", required=True, help="PNG files, or folders of them"
    )
    parser.add_argument("--files", type=Path, required=True, help="the folder of the cache")
    parser.add_argument("--every", type=int, default=1, help="take one of so many pictures")
    parser.add_argument("--quality", type=float, default=70, help="SSIMULACRA2")
    parser.add_argument("--crops", type=int, default=8, help="crops of each picture in a round")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--csv", action="store_true", help="print CSV in place of a table")
    args = parser.parse_args()
    args.files.mkdir(parents=True, exist_ok=True)
    found = [sorted(path.glob("*.png")) if path.is_dir() else [path] for path in args.pictures]
    pictures = [path for paths in found for path in paths[:: args.every]]
    with ProcessPoolExecutor(2) as pool:
        every = [[value] * len(pictures) for value in (args.quality, args.files)]
        scores = list(pool.map(make_files, pictures, *every))
    paths = {
        name: [args.files / f"{picture.stem}.{suffix}" for picture in pictures]
        for name, (suffix, _) in READERS.items()
    }
    crops = draw_crops([path.read_bytes() for path in paths["gip"]], args.crops)
    seconds: dict[tuple[str, int], list[float]] = {(n, p): [] for n in READERS for p in (1, 2)}
    with ProcessPoolExecutor(2) as pool:
        # Both processes are there before anything is measured.
        list(pool.map(make_crops, list(READERS)[:2] * 2, [[], []] * 2, [[], []] * 2))
        for _ in range(args.rounds):
            for name in READERS:
                seconds[name, 1].append(make_crops(name, paths[name], crops))
                start = time.perf_counter()
                list(pool.map(make_crops, [name] * 2, [paths[name]] * 2, [crops] * 2))
                seconds[name, 2].append(time.perf_counter() - start)
    count = len(pictures) * args.crops
    rows = []
    for name, (suffix, _) in READERS.items():
        size = statistics.mean(path.stat().st_size for path in paths[name])
        quality = statistics.mean(of_picture[suffix] for of_picture in scores)
        rates = [count * p / statistics.median(seconds[name, p]) for p in (1, 2)]
        rows.append((name, quality, size, *rates))
    if args.csv:
        csv.writer(sys.stdout).writerows(rows)
        return
    print(f"{len(pictures)} pictures, {args.crops} crops of each\n")
    print("| | SSIMULACRA2 | bytes read | crops a second | with two processes |")
    print("| --- | ---: | ---: | ---: | ---: |")
    for name, quality, size, one, two in rows:
        print(f"| {name} | {quality:.1f} | {size:,.0f} | {one:.0f} | {two:.0f} |")


if __name__ == "__main__":
    main()
