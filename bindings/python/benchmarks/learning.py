"""Whether a network learns as well from .gip as from JPEG of the same bytes.

    pip install image-gip --requirement benchmarks/requirements.txt
    python benchmarks/learning.py

The pictures are made of what scikit-learn ships: each of its 1,797 handwritten digits, enlarged and
tinted, lies at a random place over a random part of one of its two photographs. A picture of 128 x
128 pixels becomes a JPEG with the given quality, and a .gip of as many bytes. A small convolutional
network learns the digits from random crops of each, and of the pictures themselves, with the same
seeds, and is tested on pictures in the same format: the last third, which it has not seen.
"""

import argparse
import csv
import io
import statistics
import sys
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import torch
from numpy.typing import NDArray
from PIL import Image
from sklearn.datasets import load_digits, load_sample_images
from torch import nn

import image_gip
from image_gip import _crops
from image_gip._crops import Crop, Rendering

SIDE = 128
#: Pixels of what the network sees.
SEEN = 48
RGB = Rendering("RGB", None, True, None)
FORMATS = ("the pictures", "gip", "JPEG")

Samples = NDArray[np.uint8]


def draw_pictures() -> tuple[list[Samples], NDArray[np.int64]]:
    random = np.random.default_rng(1)
    digits, photos = load_digits(), load_sample_images().images
    pictures = []
    for digit in digits.images:
        photo = photos[random.integers(len(photos))]
        top, left = (random.integers(side - SIDE) for side in photo.shape[:2])
        picture = photo[top : top + SIDE, left : left + SIDE].astype(np.float32)
        side = int(random.integers(72, 113))
        enlarged = Image.fromarray((digit * 255 / 16).astype(np.uint8)).resize((side, side))
        opacity = np.asarray(enlarged, np.float32)[..., None] / 255
        row, column = random.integers(SIDE - side, size=2)
        part = picture[row : row + side, column : column + side]
        # Bright on dark parts, and dark on bright ones.
        color = random.uniform(0, 90, 3)
        color = color if part.mean() > 127 else 255 - color
        part += 0.9 * opacity * (color - part)
        pictures.append(picture.round().astype(np.uint8))
    return pictures, digits.target


def encode(picture: Samples, quality: int) -> tuple[bytes, bytes]:
    """The picture as .gip and as JPEG, of about the same bytes."""
    file = io.BytesIO()
    Image.fromarray(picture).save(file, "JPEG", quality=quality, optimize=True)
    size = len(file.getvalue())
    return image_gip.encode(picture, bytes=size, effort=2), file.getvalue()


def crop_of(kind: str, picture: Samples, files: tuple[bytes, bytes], crop: Crop) -> Samples:
    if kind == "gip":
        return _crops.render(
            files[0], (SIDE, SIDE), crop, (SEEN, SEEN), RGB, dtype=np.uint8, planar=False
        )
    image = Image.open(io.BytesIO(files[1])) if kind == "JPEG" else Image.fromarray(picture)
    box = (crop.left, crop.top, crop.left + crop.width, crop.top + crop.height)
    return np.asarray(image.resize((SEEN, SEEN), Image.Resampling.BILINEAR, box=box))


def tensor(samples: list[Samples]) -> torch.Tensor:
    return torch.from_numpy(np.stack(samples)).permute(0, 3, 1, 2).float() / 255 - 0.5


def network() -> nn.Sequential:
    layers: list[nn.Module] = []
    for before, after in ((3, 24), (24, 48), (48, 96)):
        layers += [nn.Conv2d(before, after, 3, padding=1), nn.BatchNorm2d(after), nn.ReLU()]
        layers.append(nn.MaxPool2d(2))
    layers += [nn.Conv2d(96, 96, 3, padding=1), nn.ReLU(), nn.AvgPool2d(2)]
    return nn.Sequential(*layers, nn.Flatten(), nn.Linear(9 * 96, 10))


def learn(
    kind: str,
    pictures: list[Samples],
    files: list[tuple[bytes, bytes]],
    labels: NDArray[np.int64],
    seed: int,
    epochs: int,
) -> float:
    """The share of the test pictures whose digit the network tells, in percent."""
    torch.manual_seed(seed)
    random = np.random.default_rng(seed)
    train = len(pictures) * 2 // 3
    model, targets = network(), torch.from_numpy(labels)
    batches = train // 32
    optimizer = torch.optim.AdamW(model.parameters())
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, 3e-3, epochs * batches)
    for _ in range(epochs):
        order = random.permutation(train)
        for batch in np.array_split(order, batches):
            crops = [
                _crops.random_resized((SIDE, SIDE), (0.5, 1), (3 / 4, 4 / 3), 0, draws)
                for draws in random.random((len(batch), _crops.DRAWS))
            ]
            seen = [
                crop_of(kind, pictures[i], files[i], c) for i, c in zip(batch, crops, strict=True)
            ]
            optimizer.zero_grad()
            nn.functional.cross_entropy(model(tensor(seen)), targets[batch]).backward()
            optimizer.step()
            schedule.step()
    model.eval()
    whole = Crop(0, 0, SIDE, SIDE)
    seen = [crop_of(kind, pictures[i], files[i], whole) for i in range(train, len(pictures))]
    with torch.no_grad():
        told = model(tensor(seen)).argmax(1)
    return 100 * float((told == targets[train:]).float().mean())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quality", type=int, nargs="+", default=[10, 30], help="of JPEG")
    parser.add_argument("--pictures", type=int, help="take only so many")
    parser.add_argument("--epochs", type=int, default=20)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--csv", action="store_true", help="print CSV in place of a table")
    args = parser.parse_args()
    if args.pictures is not None and args.pictures < 48:
        parser.error(
            "--pictures must be at least 48, for one batch of the two thirds to learn from"
        )
    pictures, labels = draw_pictures()
    pictures, labels = pictures[: args.pictures], labels[: args.pictures]
    rows = []
    # Networks are small: two at once, with a thread each, take less time than one after another.
    with ProcessPoolExecutor(2, initializer=torch.set_num_threads, initargs=(1,)) as pool:
        for quality in args.quality:
            files = list(pool.map(encode, pictures, [quality] * len(pictures), chunksize=32))
            size = statistics.mean(len(jpeg) for _, jpeg in files)
            kinds = FORMATS if quality == args.quality[0] else FORMATS[1:]
            learned = {
                kind: [
                    pool.submit(learn, kind, pictures, files, labels, seed, args.epochs)
                    for seed in range(args.seeds)
                ]
                for kind in kinds
            }
            for kind, of_seeds in learned.items():
                accuracies = [accuracy.result() for accuracy in of_seeds]
                rows.append((0 if kind == FORMATS[0] else size, kind, quality, accuracies))
    if args.csv:
        for size, kind, quality, accuracies in rows:
            name = f"{kind} {quality}" if size else kind
            mean = statistics.mean(accuracies)
            csv.writer(sys.stdout).writerow((name, size, mean, min(accuracies), max(accuracies)))
        return
    print("| bytes | learned from | accuracy | of each seed |")
    print("| ---: | --- | ---: | --- |")
    for size, kind, _, accuracies in rows:
        each = ", ".join(f"{accuracy:.1f}" for accuracy in accuracies)
        shown = f"{size:,.0f}" if size else "-"
        print(f"| {shown} | {kind} | {statistics.mean(accuracies):.1f} % | {each} |")


if __name__ == "__main__":
    main()
