"""What is done to the pictures of a shard."""

from __future__ import annotations

import errno
import io
import re
import stat
import struct
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import IO, Any, Literal

from PIL import Image, ImageOps, UnidentifiedImageError

import image_gip.pillow  # noqa: F401
from image_gip._dataset import containers
from image_gip._dataset.containers import ParquetWriter, Picture, TarWriter, Writer
from image_gip._dataset.folder import replacing, write_errors
from image_gip._dataset.shards import Shard

Container = Literal["parquet", "webdataset"]
Operation = Literal["encode", "decode", "thumbnail"]

#: The suffixes of shards.
SUFFIXES: dict[Container, str] = {"parquet": ".parquet", "webdataset": ".tar"}
#: The extensions of pictures by their formats.
EXTENSIONS = {"gip": "gip", "jpeg": "jpg", "png": "png", "webp": "webp"}

#: Formats that Pillow decodes by itself: for EPS, it would start a program.
_FORMATS = (
    *("AVIF", "BMP", "GIF", "ICO", "JPEG", "JPEG2000", "MPO"),
    *("PNG", "PPM", "QOI", "TGA", "TIFF", "WEBP"),
)
#: Errors that belong to a path. With others, such as those of a disk, the shard is not made.
_BAD_PATH = {
    *(errno.ENOENT, errno.ENOTDIR),
    *(errno.EACCES, errno.ELOOP, errno.ENAMETOOLONG),
}
#: How lossy formats are written.
_SAVE_OPTIONS = {"jpeg": {"quality": 90}, "webp": {"quality": 90}}
#: The Exif tag, and the first of its values that exchange width and height.
_ORIENTATION, _FIRST_TURNED = 0x0112, 5
#: What differs between processes in the message of an error.
_ADDRESS = re.compile(r" at 0x[0-9a-f]+")


@dataclass(frozen=True)
class Job:
    """What is done to all shards."""

    operation: Operation
    #: The arguments of the operation.
    options: dict[str, Any]
    folder: Path
    container: Container
    #: Whether the pictures are in shards of an earlier run.
    packed: bool

    def target(self, shard: Shard) -> Path:
        """The file that a shard becomes."""
        return self.folder / (shard["name"] + SUFFIXES[self.container])

    def perform(self, shard: Shard) -> None:
        """Makes the file of a shard, and the list of its bad pictures, if that is not done.

        Raises:
            OSError: A file system fails.
            MemoryError: A picture does not fit into memory.
        """
        target = self.target(shard)
        if target.exists():
            return
        errors: list[dict[str, str]] = []
        with replacing(target) as file:
            with closing(self._writer(file)) as writer:
                for key, path, load in self._pictures(shard):
                    try:
                        picture = _OPERATIONS[self.operation](load(), **self.options)
                    except _BadPictureError as error:
                        errors.append({"key": key, "path": path, "error": str(error)})
                    else:
                        writer.add(key, picture)
            # First, as a shard that is there is one that is done.
            write_errors(target, errors)

    def _writer(self, file: IO[bytes]) -> Writer:
        if self.container == "parquet":
            return ParquetWriter(file)
        return TarWriter(file, EXTENSIONS[self.options.get("format", "gip")])

    def _pictures(self, shard: Shard) -> Iterator[tuple[str, str, Callable[[], bytes]]]:
        """The key of each picture, where it is, and what gets its file."""
        if self.packed:
            (path,) = shard["paths"]
            for key, data in containers.pictures(Path(path)):
                yield key, path, partial(bytes, data)
        else:
            for key, path in zip(shard["keys"], shard["paths"], strict=True):
                yield key, path, partial(_read, path)


class _BadPictureError(Exception):
    """Why a picture is left out: the same text wherever and however often it is tried."""


def _read(path: str) -> bytes:
    try:
        # A pipe or a device may have no end.
        if not stat.S_ISREG(Path(path).stat().st_mode):
            raise _BadPictureError("not a regular file")
        return Path(path).read_bytes()
    except OSError as error:
        if error.errno not in _BAD_PATH:
            raise
        raise _BadPictureError(error.strerror) from error


@contextmanager
def _opened(data: bytes, formats: Iterable[str]) -> Iterator[Image.Image]:
    """A picture. Whatever goes wrong with it, here or in the block, makes it a bad one."""
    Image.init()
    known = [name for name in formats if name in Image.OPEN]
    try:
        with Image.open(io.BytesIO(data), formats=known) as image:
            yield image
    except MemoryError:
        raise
    except UnidentifiedImageError as error:
        raise _BadPictureError("not a picture of a known format") from error
    except Exception as error:
        message = _ADDRESS.sub("", f"{type(error).__name__}: {error}")
        raise _BadPictureError(message) from error


def _encode(data: bytes, **options: Any) -> Picture:
    with _opened(data, _FORMATS) as image:
        # PNG may have its metadata at the end.
        image.load()
        if options.get("metadata") == "none":
            # Nothing will tell how it is to be turned.
            _make_upright(image)
            return _saved(image, "gip", **options)
        metadata = _metadata(image, "exif", "xmp")
        if not metadata.get("exif", b"").startswith((b"Exif\0\0II", b"Exif\0\0MM", b"II", b"MM")):
            metadata.pop("exif", None)
        return _saved(image, "gip", **metadata, **options)


def _decode(data: bytes, *, format: str) -> Picture:
    with _opened(data, ["GIP"]) as image:
        # 8 bits, of gray pictures as well.
        image.draft("L", image.size)
        ImageOps.exif_transpose(image, in_place=True)
        return _saved(image, format, **_metadata(image, "exif", "icc_profile"))


def _thumbnail(data: bytes, *, size: list[int], format: str) -> Picture:
    with _opened(data, ["GIP"]) as image:
        image.draft("L", image.size)
        width, height = size
        if image.getexif().get(_ORIENTATION, 1) >= _FIRST_TURNED:
            width, height = height, width
        image.thumbnail((width, height))
        ImageOps.exif_transpose(image, in_place=True)
        return _saved(image, format, **_metadata(image, "icc_profile"))


def _make_upright(image: Image.Image) -> None:
    """Turns a picture, and drops its Exif and XMP. Damaged Exif tells no orientation."""
    with suppress(OSError, SyntaxError, ValueError, struct.error):
        image.getexif()
    # What was read is known still, and what is not there is not written anew.
    for name in ("exif", "xmp"):
        image.info.pop(name, None)
    ImageOps.exif_transpose(image, in_place=True)


def _metadata(image: Image.Image, *names: str) -> dict[str, Any]:
    return {name: image.info[name] for name in names if image.info.get(name)}


def _saved(image: Image.Image, format: str, **options: Any) -> Picture:
    file = io.BytesIO()
    image.save(file, format, **_SAVE_OPTIONS.get(format, {}), **options)
    return Picture(file.getvalue(), *image.size)


_OPERATIONS: dict[Operation, Callable[..., Picture]] = {
    "encode": _encode,
    "decode": _decode,
    "thumbnail": _thumbnail,
}
