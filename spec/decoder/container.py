"""Signature, numbers and chunks (sections 2 and 4.1 to 4.3)."""

import zlib

from .errors import MALFORMED, SIGNATURE, UNEXPECTED_END, UNSUPPORTED, Malformed, Refused

SIGNATURE_BYTES = bytes.fromhex("C7 47 49 50 0D 0A 01 0A")
VERSION_AT = 6
LONGEST_PAYLOAD = 2**31 - 1


def check_signature(data):
    """Section 4.1. Bytes are judged in their order, each "as soon as it has arrived". Returns the offset behind it."""
    for i, expected in enumerate(SIGNATURE_BYTES):
        if i == len(data):
            raise Refused(UNEXPECTED_END, "", "the file ends in the signature")
        if data[i] != expected:
            if i == VERSION_AT:
                raise Refused(UNSUPPORTED, "H", f"version {data[i]}")
            raise Refused(SIGNATURE, "", f"byte {i}")
    return len(SIGNATURE_BYTES)


def read_number(data, at):
    """A `number` of section 2 at offset `at`: (value, offset behind it), or None if `data` ends too early."""
    value = 0
    for i in range(5):
        if at + i >= len(data):
            return None
        byte = data[at + i]
        value |= (byte & 0x7F) << (7 * i)
        if value >= 2**32:
            raise Malformed("a number of more than 32 bits")
        if byte < 0x80:
            if byte == 0 and i > 0:
                raise Malformed("a number with a byte that it does not need")
            return value, at + i + 1
    raise Malformed("a number of more than five bytes")


def is_letter(byte):
    return 0x41 <= byte <= 0x5A or 0x61 <= byte <= 0x7A


class ChunkStart:
    """Type and length of a chunk whose payload may not be there yet.

    type: text; payload_at: offset of the payload in the file; length: of the payload in bytes; at: offset of the type.
    """

    def __init__(self, data, at):
        self.at = at
        if at >= len(data):
            raise Refused(UNEXPECTED_END, "", "the file ends where a chunk should begin")
        type_length = 4 if 0x61 <= data[at] <= 0x7A else 1
        raw = data[at : at + type_length]
        if len(raw) < type_length:
            raise Refused(UNEXPECTED_END, "", "the file ends in a chunk's type")
        self.type = raw.decode("latin-1")
        if not all(is_letter(b) for b in raw):
            raise Refused(MALFORMED, self.type, "a type that is not of letters")
        try:
            number = read_number(data, at + type_length)
        except Malformed as e:
            raise Refused(MALFORMED, self.type, f"the length: {e}") from None
        if number is None:
            raise Refused(UNEXPECTED_END, self.type, "the file ends in a chunk's length")
        self.length, self.payload_at = number
        if self.length > LONGEST_PAYLOAD:
            raise Refused(MALFORMED, self.type, "a length over 2^31 - 1")

    def is_ancillary(self):
        return len(self.type) == 4

    def available(self, data):
        """What the file has of the payload."""
        return data[self.payload_at : self.payload_at + self.length]

    def is_complete(self, data):
        """Whether the payload and its CRC are there."""
        return self.payload_at + self.length + 4 <= len(data)

    def end(self):
        """Offset behind the chunk."""
        return self.payload_at + self.length + 4

    def crc_is_right(self, data):
        """Section 4.2: the CRC is of type, length and payload. The chunk must be complete."""
        crc_at = self.payload_at + self.length
        stored = int.from_bytes(data[crc_at : crc_at + 4], "little")
        return zlib.crc32(data[self.at : crc_at]) == stored
