"""From a list or a manifest of pictures to shards."""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import TypedDict

from image_gip._dataset.folder import local_path

#: Suffixes of manifests with a JSON object per line; in others, a line is a path.
_JSON_LINES = {".jsonl", ".ndjson"}
#: Suffixes of shards.
_PACKED = {".parquet", ".tar"}
_NO_PATH = re.compile(r"[\x00\ud800-\udfff]")
_CONTROL = re.compile(r"[\x00-\x1f\x7f\ud800-\udfff]")

Pictures = str | os.PathLike[str] | Iterable[str | os.PathLike[str]]


class Shard(TypedDict):
    """Some pictures that become one file."""

    #: The name of that file, without its suffix.
    name: str
    #: One per picture; none if the pictures are in a shard of an earlier run.
    keys: list[str]
    #: The files of the pictures, or the shard of an earlier run.
    paths: list[str]


@dataclass(frozen=True)
class Input:
    """All pictures, in shards."""

    shards: list[Shard]
    #: Whether the pictures are in shards already.
    packed: bool
    #: Tells apart inputs with other keys, paths, or sizes of the shards.
    digest: str


def read(pictures: Pictures, shard_size: int, *, may_be_packed: bool) -> Input:
    """Splits pictures, which are named by a manifest or a list, into shards.

    Raises:
        OSError: The manifest cannot be read.
        ValueError: A line, path or key is not one, a key is there twice, or there is no picture.
    """
    if shard_size < 1:
        raise ValueError(f"shard_size is {shard_size}; it must be at least 1")
    entries = _entries(pictures)
    first = next(entries, None)
    if first is None:
        raise ValueError("there are no pictures")
    packed = may_be_packed and first.path.suffix in _PACKED

    def all_entries() -> Iterator[_Entry]:
        yield first
        yield from entries

    shards = list(_packed(all_entries()) if packed else _split(all_entries(), shard_size))
    digest = hashlib.sha256()
    for shard in shards:
        digest.update(json.dumps(shard).encode())
    return Input(shards, packed, digest.hexdigest())


@dataclass(frozen=True, slots=True)
class _Entry:
    key: str
    #: An absolute path.
    path: Path
    #: The entry in messages.
    place: str


def _entries(pictures: Pictures) -> Iterator[_Entry]:
    if not isinstance(pictures, str | os.PathLike):
        for index, name in enumerate(pictures):
            yield _entry(os.fspath(name), None, Path.cwd(), f"picture {index}")
        return
    manifest = local_path(pictures).absolute()
    is_json = manifest.suffix in _JSON_LINES
    with manifest.open(encoding="utf-8", newline="\n") as lines:
        try:
            for number, line in enumerate(lines, 1):
                text = line.rstrip("\r\n")
                if text:
                    name, key = _parse(text) if is_json else (text, None)
                    yield _entry(name, key, manifest.parent, f"line {number}")
        except ValueError as error:
            raise ValueError(f"{manifest}: {error}") from error


def _parse(line: str) -> tuple[str, str | None]:
    record = json.loads(line)
    if not isinstance(record, dict):
        raise ValueError(f"{line[:80]} is not a JSON object")
    name, key = record.get("path"), record.get("key")
    if not isinstance(name, str) or not isinstance(key, str | None):
        raise ValueError(f"{line[:80]} has no string `path`, or a `key` that is not one")
    return name, key


def _entry(name: str, key: str | None, base: Path, place: str) -> _Entry:
    if _NO_PATH.search(name):
        raise ValueError(f"{place}: {name!r} cannot be a path: that is text in UTF-8 without NUL")
    path = local_path(name)
    if key is None:
        # The path as it was given, as the name of a WebDataset sample: it ends at the first dot.
        parts = [part for part in path.parts if part not in {path.anchor, ".."}]
        key = "/".join([*parts[:-1], PurePosixPath(*parts[-1:]).stem.replace(".", "_")])
    parts = key.split("/")
    if _CONTROL.search(key) or {"", ".", ".."} & set(parts) or "." in parts[-1]:
        raise ValueError(
            f"{place}: {key!r} cannot be a key: that is a relative path without control characters,"
            " and without a dot in its last part"
        )
    return _Entry(key, base / path, place)


def _split(entries: Iterator[_Entry], shard_size: int) -> Iterator[Shard]:
    known: set[str] = set()
    index = 0
    while part := list(islice(entries, shard_size)):
        for entry in part:
            if entry.key in known:
                raise ValueError(
                    f"{entry.place}: the key {entry.key} is there twice; a JSON-lines manifest can"
                    ' name others: {"path": ..., "key": ...}'
                )
            known.add(entry.key)
        yield {
            "name": f"shard-{index:06}",
            "keys": [entry.key for entry in part],
            "paths": [str(entry.path) for entry in part],
        }
        index += 1


def _packed(entries: Iterator[_Entry]) -> Iterator[Shard]:
    known: set[str] = set()
    for entry in entries:
        name = entry.path.stem
        if entry.path.suffix not in _PACKED:
            raise ValueError(f"{entry.place}: {entry.path} is not a shard, as those before it are")
        if name in known:
            raise ValueError(f"{entry.place}: there are two shards of the name {name}")
        known.add(name)
        yield {"name": name, "keys": [], "paths": [str(entry.path)]}
