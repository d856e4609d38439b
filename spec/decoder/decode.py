"""The file as a whole: order of chunks, layers, texture, and what is kept after an error (sections 4.4, 5.4, 5.7, 11).

Where a chunk breaks several rules, this decoder decides in the order in which the bytes arrive: type, place, length,
what the first bytes of a payload say about its length, then the CRC, and all else that the payload says.
"""

from dataclasses import dataclass, field

import numpy as np

from . import limits
from .arith import F, quiet
from .container import ChunkStart, check_signature, read_number
from .errors import MALFORMED, UNEXPECTED_END, UNSUPPORTED, LimitExceeded, Malformed, Refused, Unsupported
from .header import ENTROPY, LONGEST, PACKED, Fields, Header, Steps, USUAL_GEOMETRY, read_header, step_of_code
from .metadata import check_colors, orientation, read_bounds, read_text
from .packed import bits_of_gaussian, check_padding, decode_gaussians, layer_bytes
from .tree import ceil_div, decode_layer

CRITICAL = ("H", "L", "E")
AT_MOST_ONE = ("cICP", "mDCV", "cLLI", "iCCP", "eXIf", "xMPd", "bNDS", "tXTR")
METADATA = ("cICP", "mDCV", "cLLI", "iCCP", "eXIf", "xMPd", "tEXt")
NODE_DISTANCE = 8  # pixels from a node of a texture's map to the next


@dataclass
class Picture:
    """What has been decoded. components: for each layer (count, 5 + channels) in the header's parameterization."""

    header: Header
    components: list = field(default_factory=list)
    map: np.ndarray = None    # Gaussians of the texture's map, (count, 8), parameterization 1
    bounds: list = None       # of the layers, section 5.6
    texts: list = field(default_factory=list)
    metadata: dict = field(default_factory=dict)  # type: payload

    def kept(self):
        return sum(len(c) for c in self.components)

    def all_components(self):
        empty = np.zeros((0, 5 + self.header.channels), dtype=F)
        return np.concatenate([empty] + self.components)


def map_size(header):
    """Section 5.7: MX, MY in nodes."""
    return ceil_div(header.width, NODE_DISTANCE) + 1, ceil_div(header.height, NODE_DISTANCE) + 1


def check_limits(header):
    """Section 10, for what the header declares."""
    if max(header.width, header.height) > limits.SIDE or header.width * header.height > limits.PIXELS:
        raise LimitExceeded("too many pixels")
    if header.gaussians > limits.GAUSSIANS:
        raise LimitExceeded("too many Gaussians")
    if header.layers > limits.LAYERS:
        raise LimitExceeded("too many layers")


class Decoder:
    """Goes through the chunks of a file. `picture` holds what counts so far; it is None before `H` is complete."""

    def __init__(self, data):
        self.data = data
        self.picture = None
        self.layers = 0          # complete ones
        self.seen = set()        # types of the complete chunks
        self.metadata_bytes = 0  # as section 10 counts them

    def run(self):
        at = check_signature(self.data)
        while "E" not in self.seen:
            at = self.chunk(at)

    def chunk(self, at):
        """One chunk at the offset `at`; returns the offset behind it."""
        chunk = ChunkStart(self.data, at)
        try:
            self.check_place(chunk)
            self.check_length(chunk)
            if not chunk.is_complete(self.data):
                if chunk.type == "L":
                    self.incomplete_layer(chunk)
                raise Refused(UNEXPECTED_END, chunk.type, "the file ends in a chunk")
            if not chunk.crc_is_right(self.data):
                raise Malformed("a wrong CRC")
            self.content(chunk.type, chunk.available(self.data))
        except (Malformed, Unsupported) as e:
            raise Refused(e.kind, chunk.type, str(e)) from None
        self.seen.add(chunk.type)
        return chunk.end()

    def check_place(self, chunk):
        """Section 4.4, and whether the type is known (section 4.3)."""
        if not chunk.is_ancillary() and chunk.type not in CRITICAL:
            raise Unsupported("an unknown critical chunk")
        if (chunk.type == "H") != (self.picture is None):
            raise Malformed("H is not the first chunk")
        if chunk.type in AT_MOST_ONE and chunk.type in self.seen:
            raise Malformed("a second chunk of this type")
        if chunk.type == "L" and self.layers == self.picture.header.layers:
            raise Malformed("more layers than declared")
        if chunk.type == "E" and self.layers < self.picture.header.layers:
            raise Malformed("fewer layers than declared")

    def check_length(self, chunk):
        """What a length alone can break, and section 10."""
        if chunk.type == "H" and chunk.length > LONGEST:
            raise Malformed("a header of more than 255 bytes")
        if chunk.type == "E" and chunk.length > 0:
            raise Malformed("E with a payload")
        if chunk.type in METADATA:
            self.metadata_bytes += chunk.length + (limits.TEXT_EXTRA if chunk.type == "tEXt" else 0)
            if chunk.length > limits.METADATA_CHUNK or self.metadata_bytes > limits.METADATA:
                raise LimitExceeded("too much metadata")

    def content(self, type, payload):
        """The payload of a chunk whose CRC is right."""
        if type == "H":
            header = read_header(payload)
            check_limits(header)
            self.picture = Picture(header)
        elif type == "L":
            self.layer(payload)
        elif type == "tXTR":
            self.picture.map = self.texture(payload)
        elif type == "bNDS":
            self.picture.bounds = read_bounds(payload, self.picture.header.layers)
        elif type == "tEXt":
            self.picture.texts.append(read_text(payload))
        elif type in METADATA:
            if type == "eXIf" and self.layers > 0 and orientation(payload) != 1:
                raise Malformed("an orientation after the first layer")
            check_colors(type, payload)
            self.picture.metadata[type] = payload

    def layer_head(self, payload, complete_length):
        """Section 5.4: (number of Gaussians, offset of their bytes), or None if the payload ends in the number.

        payload: what is there of it; complete_length: in bytes, as declared.
        """
        header = self.picture.header
        remaining = header.gaussians - self.picture.kept()
        later = header.layers - self.layers - 1  # layers after this one
        if later == 0:
            count, at = remaining, 0
        else:
            number = read_number(payload, 0)
            if number is None:
                if len(payload) == complete_length:
                    raise Malformed("a layer that ends in its number of Gaussians")
                return None
            count, at = number
            if not 1 <= count <= remaining - later:
                raise Malformed("a number of Gaussians out of range")
        if header.coding == PACKED and complete_length - at != layer_bytes(header.quantizers, count):
            raise Malformed("a layer of another length than that of its Gaussians")
        return count, at

    def layer(self, payload):
        """Section 5.4: a complete layer."""
        header = self.picture.header
        count, at = self.layer_head(payload, len(payload))
        stream = payload[at:]
        if header.coding == ENTROPY:
            components = decode_layer(stream, count, header.width, header.height, header.steps)
        else:
            check_padding(header.quantizers, stream, count)
            components = decode_gaussians(header.quantizers, stream, count)
        self.picture.components.append(components)
        self.layers += 1

    def incomplete_layer(self, chunk):
        """Section 11: the complete Gaussians of a layer of the packed coding in which the file ends are kept."""
        header = self.picture.header
        payload = chunk.available(self.data)
        head = self.layer_head(payload, chunk.length)
        if head is None or header.coding == ENTROPY:
            return
        count, at = head
        arrived = min(count, (len(payload) - at) * 8 // bits_of_gaussian(header.quantizers))
        self.picture.components.append(decode_gaussians(header.quantizers, payload[at:], arrived))

    def texture(self, payload):
        """Section 5.7: the Gaussians of the map."""
        columns, rows = map_size(self.picture.header)
        fields = Fields(payload)
        step = step_of_code(fields.u16())
        count = fields.number()
        if not 1 <= count <= columns * rows:
            raise Malformed("a number of Gaussians out of range")
        if count > limits.GAUSSIANS:
            raise LimitExceeded("too many Gaussians in a texture's map")
        steps = Steps([step] * 3, *USUAL_GEOMETRY)
        return decode_layer(fields.rest(), count, columns, rows, steps)


def decode(data):
    """(picture, error) of the bytes of a file.

    picture: a `Picture`, or None if `H` is not complete; error: None if the file is sound, else a `Refused` or a
    `LimitExceeded`. With an error the picture is the best that the bytes before it allow.
    """
    decoder = Decoder(data)
    error = None
    with quiet():
        try:
            decoder.run()
        except (Refused, LimitExceeded) as e:
            error = e
    return decoder.picture, error
