"""python -m decoder.check FOLDER: compares this decoder with test vectors (section 13; README.md of the folder)."""

import re
import sys
import time
import zlib
from pathlib import Path

from .decode import decode
from .errors import LimitExceeded
from .header import MODELS
from .pnm import sample_bytes
from .render import Request
from .samples import render

PARTS = [
    (r"whole", lambda request: None),
    (r"size (\d+)x(\d+)", lambda request, w, h: setattr(request, "size", (int(w), int(h)))),
    (r"region (\d+)x(\d+) at (\d+),(\d+)",
     lambda request, w, h, x, y: setattr(request, "region", (int(x), int(y), int(w), int(h)))),
    (r"first (\d+)", lambda request, n: setattr(request, "first", int(n))),
    (r"as (\w+)", lambda request, model: setattr(request, "model", MODELS.index(model))),
    (r"without texture", lambda request: setattr(request, "texture", False)),
]


def request_of(text):
    """The request that a line of the index names."""
    request = Request()
    for part in text.split(", "):
        for pattern, apply in PARTS:
            match = re.fullmatch(pattern, part)
            if match:
                apply(request, *match.groups())
                break
        else:
            raise ValueError(f"unknown rendering: {text}")
    return request


def error_text(error, picture):
    """Kind and chunk of an error, and how many Gaussians are kept."""
    # A damaged type can be any byte, such as a tab.
    chunk = " " + error.chunk.encode("unicode_escape").decode() if error.chunk else ""
    return f"{error.kind}{chunk}; {picture.kept() if picture else 0} kept"


def outcome(picture, error, rendering):
    """What the third column of the index should say."""
    if rendering == "error":
        return error_text(error, picture) if error else "no error"
    if error:
        return error_text(error, picture)
    if rendering == "skips":
        return " ".join(picture.skipped)
    try:
        samples = render(picture, request_of(rendering))
    except LimitExceeded as e:
        return error_text(e, picture)
    return f"{zlib.crc32(sample_bytes(samples, picture.header.depth)):08x}"


def main(folder):
    start = time.monotonic()
    lines = [line.split("\t") for line in (folder / "index.tsv").read_text().splitlines()[1:]]
    listed = {(line[0], line[1]) for line in lines}
    deviations = 0
    for name, rendering, expected, _ in lines:
        picture, error = decode((folder / name).read_bytes())
        if picture and picture.skipped and (name, "skips") not in listed:
            deviations += 1
            print(f"{name}: skips {' '.join(picture.skipped)}, of which the index says nothing")
        result = outcome(picture, error, rendering)
        if result != expected:
            deviations += 1
            print(f"{name}, {rendering}: {result} instead of {expected}")
    unlisted = {p.name for p in folder.glob("*.gip")} - {line[0] for line in lines}
    for name in sorted(unlisted):
        deviations += 1
        print(f"{name}: not in the index")
    files = len({line[0] for line in lines})
    print(f"{len(lines)} lines of {files} files, {deviations} deviations, {time.monotonic() - start:.1f} s")
    return 1 if deviations else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
