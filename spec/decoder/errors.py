"""Kinds of error (section 1), and errors that do not concern the file (sections 9.1 and 10)."""

SIGNATURE = "signature"
MALFORMED = "malformed"
UNSUPPORTED = "unsupported"
UNEXPECTED_END = "unexpected end"


class Refused(Exception):
    """The file is refused: `kind` is one of the four above, `chunk` the type of the chunk ("" if none is known)."""

    def __init__(self, kind, chunk, text):
        name = " " + chunk.encode("unicode_escape").decode() if chunk else ""  # a damaged type can be any bytes
        super().__init__(f"{kind}{name}: {text}")
        self.kind = kind
        self.chunk = chunk


class Malformed(Exception):
    """A rule is broken inside a payload. `decode` turns it into `Refused` with the chunk's type."""

    kind = MALFORMED


class Unsupported(Exception):
    """A payload requires something that version 1 does not have. `decode` turns it into `Refused`."""

    kind = UNSUPPORTED


class LimitExceeded(Exception):
    """The file, or a request, asks for more than this decoder does (section 10). The file may be valid."""


class RequestError(Exception):
    """A request for a rendering is out of range (section 9.1): an error of the caller."""
