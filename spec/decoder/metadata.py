"""Payloads of ancillary chunks: metadata (section 5.5), bounds of layers (section 5.6).

`Malformed` here is a reason to skip the chunk (section 4.3), not to refuse the file.
"""

from .errors import Malformed

LENGTHS = {"cICP": 4, "mDCV": 24, "cLLI": 8}  # of payloads in bytes; those of other types are free


def read_text(payload):
    """`tEXt`: (keyword, text)."""
    keyword, nul, text = payload.partition(b"\0")
    if not nul:
        raise Malformed("a text without the NUL after its keyword")
    if not 1 <= len(keyword) <= 79:
        raise Malformed("a keyword of a wrong length")
    if b"\0" in text:
        raise Malformed("a text with a NUL")
    try:
        return keyword.decode("utf-8"), text.decode("utf-8")
    except UnicodeDecodeError:
        raise Malformed("a text that is not UTF-8") from None


def check_code_points(payload):
    """`cICP`, of the right length. The first two codes may have any value."""
    if payload[2] != 0:
        raise Malformed("matrix coefficients")
    if payload[3] != 1:
        raise Malformed("a range that is not full")


def orientation(exif):
    """The orientation that an `eXIF` tells, 1 to 8, 1 if it tells none: section 5.5, "found in this way"."""
    order = {b"II": "little", b"MM": "big"}.get(exif[:2])
    if order is None or len(exif) < 8:
        return 1

    def unsigned(at, size):
        return int.from_bytes(exif[at : at + size], order)

    if unsigned(2, 2) != 42:
        return 1
    directory = unsigned(4, 4)
    if directory + 2 > len(exif):
        return 1
    for i in range(unsigned(directory, 2)):
        entry = directory + 2 + 12 * i
        if entry + 12 > len(exif):
            return 1  # those that follow are not there either
        if unsigned(entry, 2) == 0x0112 and unsigned(entry + 2, 2) == 3 and unsigned(entry + 4, 4) == 1:
            value = unsigned(entry + 8, 2)
            return value if 1 <= value <= 8 else 1
    return 1


def read_bounds(payload, layers):
    """`bNDS`: for each layer (first column, first row, last column, last row) of 256 x 256 cells."""
    if len(payload) != 4 * layers:
        raise Malformed("bounds of another number of layers")
    bounds = [tuple(payload[i : i + 4]) for i in range(0, len(payload), 4)]
    for first_column, first_row, last_column, last_row in bounds:
        if last_column < first_column or last_row < first_row:
            raise Malformed("a last column or row below its first")
    return bounds
