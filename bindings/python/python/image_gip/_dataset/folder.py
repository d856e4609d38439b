"""The folder of the results: names, complete files, and what an interrupted run has left."""

from __future__ import annotations

import json
import os
import secrets
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any
from urllib.parse import urlsplit
from urllib.request import url2pathname

# Readers of folders pass over names that begin with `_` or `.`.
_PLAN = "_dataset.json"
_ERRORS = "_errors"
_TEMPORARY = ".gip.tmp"


def local_path(name: str | os.PathLike[str]) -> Path:
    """The path of a local file, or one on a file system that is mounted.

    Raises:
        ValueError: It is a URI of another kind.
    """
    text = os.fspath(name)
    if "://" not in text:
        return Path(text)
    parts = urlsplit(text)
    if parts.scheme != "file" or parts.netloc not in {"", "localhost"}:
        raise ValueError(
            f"{text}: only paths and file:/// URIs are supported; object stores and HDFS are not,"
            " as a file must get its name in one step there: mount them, or copy the result"
        )
    return Path(url2pathname(parts.path))


@contextmanager
def replacing(path: Path) -> Iterator[IO[bytes]]:
    """Opens a file that gets its name, and replaces a file that has it, when it is complete."""
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(8)}{_TEMPORARY}")
    try:
        with temporary.open("xb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def errors_path(shard: Path) -> Path:
    """The list of the bad pictures of a shard."""
    return shard.parent / _ERRORS / f"{shard.stem}.jsonl"


def write_errors(shard: Path, errors: list[dict[str, str]]) -> None:
    """Lists the bad pictures of a shard; a list that an earlier run has left goes away."""
    path = errors_path(shard)
    if errors:
        with replacing(path) as file:
            file.writelines(json.dumps(error).encode() + b"\n" for error in errors)
    else:
        path.unlink(missing_ok=True)


def count_errors(folder: Path) -> int:
    """The number of bad pictures in all shards."""
    total = 0
    for path in (folder / _ERRORS).glob("*.jsonl"):
        with path.open("rb") as file:
            total += sum(1 for _ in file)
    return total


def remove_leftovers(folder: Path) -> None:
    """Removes the temporary files of runs that were killed."""
    for directory in (folder, folder / _ERRORS):
        for path in directory.glob(f".*{_TEMPORARY}"):
            path.unlink(missing_ok=True)


def begin(folder: Path, plan: Mapping[str, Any]) -> None:
    """Makes the folder, and writes down what is made in it.

    Raises:
        ValueError: It holds something else.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / _PLAN
    try:
        known = json.loads(path.read_bytes())
    except FileNotFoundError:
        remove_leftovers(folder)
        if any(folder.iterdir()):
            raise ValueError(f"{folder}: not empty, and not the result of an earlier run") from None
        with replacing(path) as file:
            file.write(json.dumps(plan, indent=2).encode() + b"\n")
        known = plan
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    if known != plan:
        differing = [
            name for name in plan if not isinstance(known, dict) or known.get(name) != plan[name]
        ]
        raise ValueError(
            f"{folder}: holds a result with other {', '.join(differing)}; choose another folder"
        )
    (folder / _ERRORS).mkdir(exist_ok=True)
