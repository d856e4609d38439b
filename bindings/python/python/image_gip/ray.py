"""Encodes and decodes data sets on a Ray cluster, with one task per shard of some hundred pictures.

    import image_gip.ray
    image_gip.ray.encode_dataset("photos.txt", "/mnt/data/encoded", quality=75)

A shard is a Parquet file, with the columns ``key``, ``width``, ``height`` and ``bytes`` (the file
of a picture), or a WebDataset tar file, with a member ``KEY.EXTENSION`` per picture. Its name and
its bytes depend on the pictures and the options alone. It is written under a temporary name,
renamed when it is complete, and skipped when it is there. So tasks may fail with their node and run
again, and after the end of the driver or of the cluster the same call does the rest.

``pictures`` is a list of paths, or the path of a manifest: a text file with a path per line, or, if
its name ends in ``.jsonl`` or ``.ndjson``, a file with a JSON object per line, which has a ``path``
and may have a ``key``. In a manifest, paths are relative to its folder. Without one, the key is the
path as it is given, without extension, root and ``..``; dots in its last part become ``_``. A key
that is there twice is an error. No folder is listed.

All paths, and the folder of the results, are on local file systems or on shared ones that are
mounted on all nodes at the same place; ``file:///`` URIs are taken as well, and others refused.
Temporary files of killed runs are removed, so only one run at a time may write to a folder.

Pictures that cannot be read are left out of their shard ``NAME``, and listed in
``_errors/NAME.jsonl`` with ``key``, ``path`` and ``error``. ``_dataset.json`` says what was asked
for: a folder with a result of other pictures or options is refused. Whether pictures have changed
since is not checked.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import numpy as np
import ray.data

import image_gip
from image_gip._dataset import folder, shards
from image_gip._dataset.shards import Pictures, Shard
from image_gip._dataset.work import SUFFIXES, Container, Job, Operation
from image_gip._types import MetadataPolicy, Tune

__all__ = ["Summary", "decode_dataset", "encode_dataset", "thumbnail_dataset"]

PictureFormat = Literal["jpeg", "png", "webp"]


@dataclass(frozen=True, slots=True)
class Summary:
    """What a folder holds after a run."""

    #: The number of shards.
    shards: int
    #: How many of them were there before.
    skipped: int
    #: The number of pictures that could not be read, in all shards.
    bad: int


def encode_dataset(
    pictures: Pictures,
    out_uri: str | os.PathLike[str],
    *,
    container: Container = "parquet",
    shard_size: int = 256,
    bpp: float | None = None,
    bytes: int | None = None,
    quality: float | None = None,
    psnr: float | None = None,
    gaussians: int | None = None,
    effort: int = 4,
    tune: Tune = "visual",
    texture: int = 50,
    first_layer: int | None = None,
    seed: int = 0,
    keep_invisible: bool = False,
    metadata: MetadataPolicy = "all",
) -> Summary:
    """Encodes pictures of the formats that Pillow reads to ``.gip``.

    Gray pictures of 16 bits keep them; colours have 8, as Pillow has no more. ICC
    profile, Exif and XMP are kept, or what ``metadata`` says. If that is ``"none"``, so that no
    orientation is stored, pictures are turned upright; else they are stored as they are, with it.

    Args:
        pictures: A list of paths, or a manifest: see the module.
        out_uri: The folder of the results: new, empty, or of an earlier run of the same call.
        container: ``"parquet"``, or ``"webdataset"`` for tar files.
        shard_size: Pictures per shard, at least 1. A shard is what is lost when a task fails.
        bpp: Bits per pixel of each picture. At most one target may be given, as in
            :func:`image_gip.encode`, and without one it is its default.
        bytes: Bytes of each picture.
        quality: Quality of each picture, on the scale of SSIMULACRA2.
        psnr: PSNR of each picture, in dB.
        gaussians: Number of Gaussians of each picture.
        effort: As in :func:`image_gip.encode`.
        tune: As in :func:`image_gip.encode`.
        texture: As in :func:`image_gip.encode`.
        first_layer: As in :func:`image_gip.encode`.
        seed: As in :func:`image_gip.encode`.
        keep_invisible: As in :func:`image_gip.encode`.
        metadata: As in :func:`image_gip.encode`.

    Raises:
        ValueError: An argument, a line of the manifest or a key is wrong, or the folder holds
            something else.
        OSError: The manifest cannot be read, or the folder not be written.
        ray.exceptions.RayError: A task has failed for another reason than its node or a picture.
    """
    targets = {"bpp": bpp, "bytes": bytes, "quality": quality, "psnr": psnr, "gaussians": gaussians}
    options: dict[str, Any] = {name: v for name, v in targets.items() if v is not None}
    options |= {"effort": effort, "tune": tune, "texture": texture}
    options |= {"first_layer": first_layer, "seed": seed, "metadata": metadata}
    options |= {"keep_invisible": keep_invisible}
    _check_encoder_options(options)
    return _run("encode", options, pictures, out_uri, container, shard_size)


def decode_dataset(
    pictures: Pictures,
    out_uri: str | os.PathLike[str],
    *,
    container: Container = "parquet",
    shard_size: int = 256,
    format: PictureFormat = "png",
) -> Summary:
    """Decodes ``.gip`` pictures to files of another format, upright, with 8 bits per sample.

    Args:
        pictures: As in :func:`encode_dataset`; or the shards, ``.parquet`` or ``.tar``, that it has
            made. They keep their names and keys, and ``shard_size`` has no effect.
        out_uri: As in :func:`encode_dataset`.
        container: As in :func:`encode_dataset`.
        shard_size: As in :func:`encode_dataset`.
        format: ``"png"``; or ``"jpeg"`` or ``"webp"``, with Pillow's quality 90. JPEG has no alpha:
            pictures with it are listed as bad ones.

    Raises:
        The same as :func:`encode_dataset`.
    """
    _check_format(format)
    return _run("decode", {"format": format}, pictures, out_uri, container, shard_size)


def thumbnail_dataset(
    pictures: Pictures,
    out_uri: str | os.PathLike[str],
    *,
    size: tuple[int, int],
    container: Container = "parquet",
    shard_size: int = 256,
    format: PictureFormat = "png",
) -> Summary:
    """Decodes ``.gip`` pictures to thumbnails, from as much of each file as they need.

    Of the metadata, they have the ICC profile alone.

    Args:
        pictures: As in :func:`decode_dataset`.
        out_uri: As in :func:`decode_dataset`.
        size: Width and height in pixels that a thumbnail fits into, upright, in the aspect of its
            picture. Pictures are not enlarged.
        container: As in :func:`decode_dataset`.
        shard_size: As in :func:`decode_dataset`.
        format: As in :func:`decode_dataset`.

    Raises:
        The same as :func:`encode_dataset`.
    """
    _check_format(format)
    width, height = size
    if not (isinstance(width, int) and isinstance(height, int) and min(size) >= 1):
        raise ValueError(f"size is {size}; it must be two integers of at least 1")
    options = {"size": [width, height], "format": format}
    return _run("thumbnail", options, pictures, out_uri, container, shard_size)


def _check_encoder_options(options: Mapping[str, Any]) -> None:
    """Refuses wrong options here, where each picture would be taken for a bad one."""
    # Large enough for all sizes and rates of use; the encoding ends before it has begun.
    picture = np.zeros((1024, 1024), np.uint8)
    with contextlib.suppress(image_gip.CancelledError):
        image_gip.encode(picture, **options, progress=lambda _: False)


def _check_format(format: str) -> None:
    if format not in {"jpeg", "png", "webp"}:
        raise ValueError(f'format is {format!r}; it must be "jpeg", "png" or "webp"')


def _run(
    operation: Operation,
    options: dict[str, Any],
    pictures: Pictures,
    out_uri: str | os.PathLike[str],
    container: Container,
    shard_size: int,
) -> Summary:
    if container not in SUFFIXES:
        raise ValueError(f'container is {container!r}; it must be "parquet" or "webdataset"')
    path = folder.local_path(out_uri).absolute()
    found = shards.read(pictures, shard_size, may_be_packed=operation != "encode")
    plan = {
        "image_gip": image_gip.__version__,
        "operation": operation,
        "options": options,
        "container": container,
        "pictures": found.digest,
        "shards": len(found.shards),
    }
    folder.begin(path, plan)
    folder.remove_leftovers(path)
    job = Job(operation, options, path, container, found.packed)
    missing = [shard for shard in found.shards if not job.target(shard).exists()]
    _perform(job, missing)
    # A node that was taken for dead may have left some.
    folder.remove_leftovers(path)
    total = len(found.shards)
    return Summary(total, total - len(missing), folder.count_errors(path))


def _perform(job: Job, missing: list[Shard]) -> None:
    """Makes shards, each in a task of one core, wherever there is one."""
    if not missing:
        return
    # A block per shard: a task takes a block.
    dataset = ray.data.from_items(missing, override_num_blocks=len(missing))
    done = dataset.map(partial(_task, job), num_cpus=1)
    for _ in done.iter_batches(batch_size=None):
        pass


def _task(job: Job, row: dict[str, Any]) -> dict[str, Any]:
    shard: Shard = {
        "name": str(row["name"]),
        "keys": [str(key) for key in row["keys"]],
        "paths": [str(path) for path in row["paths"]],
    }
    job.perform(shard)
    return {"name": shard["name"]}
