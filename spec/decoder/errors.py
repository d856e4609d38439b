"""Kinds of error (section 1), and an error that does not concern the file (section 9.1)."""

SIGNATURE = "signature"
MALFORMED = "malformed"
UNSUPPORTED = "unsupported"
UNEXPECTED_END = "unexpected end"
LIMIT = "limit"


class Refused(Exception):
    """The file is refused.

    kind: one of the first four above; chunk: the type of the chunk, "" if none is known.
    """

    def __init__(self, kind, chunk, text):
        name = " " + chunk.encode("unicode_escape").decode() if chunk else ""  # a damaged type can be any bytes
        super().__init__(f"{kind}{name}: {text}")
        self.kind = kind
        self.chunk = chunk


class Malformed(Exception):
    """A chunk breaks a rule. `decode` turns it into `Refused` with the chunk's type, or skips an ancillary chunk."""

    kind = MALFORMED


class Unsupported(Exception):
    """A chunk requires something that version 1 does not have. `decode` does with it as with `Malformed`."""

    kind = UNSUPPORTED


class LimitExceeded(Exception):
    """The file, or a request, asks for more than this decoder does (section 10). The file may be valid.

    There is no chunk.
    """

    kind = LIMIT
    chunk = ""


class RequestError(Exception):
    """A request for a rendering is out of range (section 9.1): an error of the caller."""
