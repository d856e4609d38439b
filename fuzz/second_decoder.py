"""Compares the crate's decoder with the second one, written from the specification alone.

    python fuzz/second_decoder.py [--seconds N] [--seed N]

It changes the test vectors at random, most of the time with right CRCs, and asks both decoders for
the samples, or the kind of error, its chunk and how many Gaussians are kept, and for the chunks that
are skipped. It needs NumPy and `image_gip` (bindings/python). Files about which they do not agree
are left in `fuzz/artifacts`, and make it fail.
"""

import argparse
import random
import sys
import time
import zlib
from pathlib import Path

import image_gip
import numpy as np

ROOT = Path(__file__).parent.parent
VECTORS = ROOT / "spec" / "vectors"
ARTIFACTS = ROOT / "fuzz" / "artifacts"
SIGNATURE_LENGTH = 8

sys.path.insert(0, str(ROOT / "spec"))
from decoder.check import outcome  # noqa: E402
from decoder.container import ChunkStart  # noqa: E402
from decoder.decode import decode  # noqa: E402
from decoder.errors import Refused  # noqa: E402

KINDS = {
    image_gip.SignatureError: "signature",
    image_gip.MalformedError: "malformed",
    image_gip.UnsupportedError: "unsupported",
    image_gip.UnexpectedEndError: "unexpected end",
    image_gip.LimitError: "limit",
}
#: Larger pictures take the second decoder too long.
MOST_PIXELS = 1 << 14
#: So many skipped chunks are listed.
LISTED = 16

Chunks = list[tuple[bytes, bytes]]
Result = tuple[str, list[str]]


def chunks_of(file: bytes) -> Chunks:
    """Types and payloads of the chunks, as far as they are framed as they should be."""
    chunks, at = [], SIGNATURE_LENGTH
    while at < len(file):
        try:
            start = ChunkStart(file, at)
        except Refused:
            break
        chunks.append((start.type.encode("latin-1"), start.available(file)))
        at = start.end()
    return chunks


def number(value: int) -> bytes:
    """A number of one to five bytes (spec, section 2)."""
    found = bytearray()
    while value > 127:
        found.append(value % 128 + 128)
        value //= 128
    return bytes([*found, value])


def chunk(kind: bytes, payload: bytes) -> bytes:
    framed = kind + number(len(payload)) + payload
    return framed + zlib.crc32(framed).to_bytes(4, "little")


class Changes:
    """Changes of a file, all by chance."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        files = [path.read_bytes() for path in sorted(VECTORS.glob("*.gip"))]
        self.bases = [file for file in files if len(file) < 5000]
        self.all = [chunk for file in self.bases for chunk in chunks_of(file)]

    def of_bytes(self, original: bytes) -> bytes:
        """With some bytes changed, removed or added."""
        data = bytearray(original)
        for _ in range(self.random.choice((1, 1, 2, 5))):
            at = self.random.randrange(len(data) + 1)
            # Most of what decides is at the beginning.
            at = self.random.choice((at, min(at, 12)))
            what = self.random.randrange(6)
            if what == 0:
                data[at:at] = self.random.randbytes(self.random.randrange(1, 4))
            elif what == 1:
                del data[at : at + self.random.randrange(1, 4)]
            elif at < len(data):
                value = self.random.choice((data[at] ^ 1 << self.random.randrange(8), 0, 255, 0x80))
                data[at] = value
        return bytes(data)

    def of_chunks(self, chunks: Chunks) -> Chunks:
        """With a chunk changed, removed, added or moved."""
        chunks = list(chunks)
        at = self.random.randrange(len(chunks))
        what = self.random.randrange(6)
        kind, payload = chunks[at]
        if what == 0:
            del chunks[at]
        elif what == 1:
            chunks.insert(self.random.randrange(len(chunks) + 1), self.random.choice(self.all))
        elif what == 2:
            chunks.insert(self.random.randrange(len(chunks) + 1), chunks.pop(at))
        elif what == 3:
            chunks[at] = (self.of_bytes(kind)[:4] or b"H", payload)
        else:
            chunks[at] = (kind, self.of_bytes(payload))
        return chunks

    def file(self) -> bytes:
        base = self.random.choice(self.bases)
        what = self.random.randrange(10)
        if what == 0:
            return self.of_bytes(base)
        chunks = chunks_of(base)
        if not chunks:
            return self.of_bytes(base)
        for _ in range(self.random.choice((1, 1, 1, 2, 3))):
            chunks = self.of_chunks(chunks) or chunks_of(base)
        file = base[:SIGNATURE_LENGTH] + b"".join(chunk(*each) for each in chunks)
        return file[: self.random.randrange(len(file))] if what == 1 else file


def of_second(data: bytes) -> Result | None:
    """What the second decoder says; `None` of pictures that take it too long."""
    picture, error = decode(data)
    if picture is None:
        return outcome(None, error, "error"), []
    if picture.header.width * picture.header.height > MOST_PIXELS:
        return None
    result = outcome(picture, error, "error" if error else "whole")
    return result, picture.skipped


def of_first(data: bytes) -> Result:
    """What the crate says, in the same words."""
    stream = image_gip.StreamDecoder()
    try:
        for start in range(0, len(data), 1000):
            stream.feed(data[start : start + 1000])
        stream.finish()
        samples = stream.image()
        stored = samples.astype(">u2") if samples.dtype == np.uint16 else samples
        result = f"{zlib.crc32(stored.tobytes()):08x}"
    except image_gip.GipError as error:
        kind = next(name for kind, name in KINDS.items() if isinstance(error, kind))
        # Quotes in a type that is not of letters are escaped.
        chunk = (getattr(error, "chunk", None) or "").replace("\\'", "'").replace('\\"', '"')
        result = f"{kind}{f' {chunk}' if chunk else ''}; {stream.arrived} kept"
    info = stream.info
    return result, [kind for kind, _ in info.skipped] if info else []


def compare(data: bytes) -> str | None:
    """What differs; `None` if nothing does."""
    second = of_second(data)
    if second is None:
        return None
    expected = second[0], second[1][:LISTED]
    found = of_first(data)
    # Limits are each decoder's own.
    if "limit" in found[0] or "limit" in expected[0] or found == expected:
        return None
    return f"{found} instead of {expected}"


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    changes = Changes(options.seed)
    end = time.monotonic() + options.seconds
    files = differences = 0
    while time.monotonic() < end:
        data = changes.file()
        files += 1
        if difference := compare(data):
            differences += 1
            ARTIFACTS.mkdir(exist_ok=True)
            path = ARTIFACTS / f"second-{zlib.crc32(data):08x}.gip"
            path.write_bytes(data)
            print(f"{path}: {difference}")
    print(f"{files} files, {differences} differences")
    return 1 if differences else 0


if __name__ == "__main__":
    sys.exit(main())
