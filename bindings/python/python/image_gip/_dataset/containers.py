"""Files that hold the pictures of a shard: Parquet, and tar as WebDataset lays it out.

Their bytes depend on what is added alone, and on the version of pyarrow.
"""

from __future__ import annotations

import io
import tarfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any, NamedTuple, Protocol

#: Bytes of pictures after which a row group of Parquet ends, so that memory is bounded.
_ROW_GROUP = 32 << 20


class Picture(NamedTuple):
    """An encoded picture, with its size in pixels."""

    data: bytes
    width: int
    height: int


class Writer(Protocol):
    """Adds pictures to a file, which is complete after `close`."""

    def add(self, key: str, picture: Picture) -> None: ...
    def close(self) -> None: ...


class ParquetWriter:
    """A row per picture: `key`, `width`, `height`, `bytes`."""

    def __init__(self, file: IO[bytes]) -> None:
        # Only what needs it loads pyarrow, which is large.
        import pyarrow
        import pyarrow.parquet

        self._arrow: Any = pyarrow
        fields = [("key", "string"), ("width", "uint32"), ("height", "uint32"), ("bytes", "binary")]
        self._schema = pyarrow.schema(
            [pyarrow.field(name, kind, nullable=False) for name, kind in fields]
        )
        self._writer = pyarrow.parquet.ParquetWriter(
            file,
            self._schema,
            version="2.6",
            # The pictures are compressed.
            compression={"key": "zstd"},
            use_dictionary=False,
            write_statistics=["key"],
        )
        self._rows: list[dict[str, Any]] = []
        self._held = 0

    def add(self, key: str, picture: Picture) -> None:
        data, width, height = picture
        self._rows.append({"key": key, "width": width, "height": height, "bytes": data})
        self._held += len(data)
        if self._held >= _ROW_GROUP:
            self._flush()

    def _flush(self) -> None:
        self._writer.write_table(self._arrow.Table.from_pylist(self._rows, self._schema))
        self._rows, self._held = [], 0

    def close(self) -> None:
        if self._rows:
            self._flush()
        self._writer.close()


class TarWriter:
    """A member per picture, named by its key and its format."""

    def __init__(self, file: IO[bytes], extension: str) -> None:
        self._tar = tarfile.open(fileobj=file, mode="w", format=tarfile.PAX_FORMAT)  # noqa: SIM115
        self._extension = extension

    def add(self, key: str, picture: Picture) -> None:
        # The owner and the time of a new member are 0.
        member = tarfile.TarInfo(f"{key}.{self._extension}")
        member.size = len(picture.data)
        member.mode = 0o644
        self._tar.addfile(member, io.BytesIO(picture.data))

    def close(self) -> None:
        self._tar.close()


def pictures(shard: Path) -> Iterator[tuple[str, bytes]]:
    """The keys and files of the `.gip` pictures in a shard, in their order.

    Raises:
        OSError, ValueError, tarfile.TarError: It is not a shard.
    """
    return _parquet(shard) if shard.suffix == ".parquet" else _tar(shard)


def _parquet(shard: Path) -> Iterator[tuple[str, bytes]]:
    import pyarrow.parquet

    with pyarrow.parquet.ParquetFile(shard) as file:
        for batch in file.iter_batches(16, columns=["key", "bytes"]):
            for row in batch.to_pylist():
                yield row["key"], row["bytes"]


def _tar(shard: Path) -> Iterator[tuple[str, bytes]]:
    with tarfile.open(shard, "r|") as tar:
        for member in tar:
            folder, slash, name = member.name.rpartition("/")
            stem, _, extension = name.partition(".")
            file = tar.extractfile(member)
            if file is not None and extension == "gip":
                yield folder + slash + stem, file.read()
