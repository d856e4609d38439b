"""The file as a whole: order of chunks, layers, texture, what is skipped, and what is kept after an error (sections
4.3, 4.4, 5.4, 5.7, 11).

The first error that the bytes show is the one that is reported ("Order of errors" in section 11): what is wrong with a
type or a length, then what both show together, then, in a layer of the packed coding, what has arrived of the payload,
then the CRC, and then all else that the payload says. An ancillary chunk that breaks a rule is no error: it is skipped
once its CRC has been found right.
"""

from dataclasses import dataclass, field

import numpy as np

from . import limits
from .arith import F, quiet
from .container import ChunkStart, check_signature, read_number
from .errors import MALFORMED, UNEXPECTED_END, UNSUPPORTED, LimitExceeded, Malformed, Refused, Unsupported
from .header import ENTROPY, LONGEST, PACKED, Fields, Header, Steps, USUAL_GEOMETRY, read_header, step_of_code
from .metadata import LENGTHS, check_code_points, orientation, read_bounds, read_text
from .packed import bits_of_gaussian, check_padding, check_started, decode_gaussians, layer_bytes
from .tree import ceil_div, check_density, decode_layer

CRITICAL = ("H", "L", "E")
AT_MOST_ONE = ("cICP", "mDCV", "cLLI", "iCCP", "eXIF", "xMPD", "bNDS", "tXTR")
BEFORE_LAYERS = ("cICP", "mDCV", "cLLI", "iCCP")
METADATA = ("cICP", "mDCV", "cLLI", "iCCP", "eXIF", "xMPD", "tEXt")
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
    skipped: list = field(default_factory=list)   # types of the ancillary chunks that break a rule, in their order

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
        self.seen = set()        # types of the complete chunks, without those that are skipped
        self.metadata_bytes = 0  # as section 10 counts them, without those that are skipped

    def run(self):
        at = check_signature(self.data)
        while "E" not in self.seen:
            at = self.chunk(at)

    def chunk(self, at):
        """One chunk at the offset `at`; returns the offset behind it."""
        chunk = ChunkStart(self.data, at)
        try:
            self.check_start(chunk)
            if not chunk.is_complete(self.data):
                if chunk.type == "L" and self.picture.header.coding == PACKED:
                    self.incomplete_layer(chunk)
                raise Refused(UNEXPECTED_END, chunk.type, "the file ends in a chunk")
            if not chunk.crc_is_right(self.data):
                raise Malformed("a wrong CRC")
            if chunk.is_ancillary():
                self.ancillary(chunk)
            else:
                self.critical(chunk.type, chunk.available(self.data))
                self.seen.add(chunk.type)
        except (Malformed, Unsupported) as e:
            raise Refused(e.kind, chunk.type, str(e)) from None
        return chunk.end()

    def check_start(self, chunk):
        """Section 11: what type and length show together. Of several errors, those of the place come first."""
        if (chunk.type == "H") != (self.picture is None):
            raise Malformed("H is not the first chunk, or not the only one")
        if chunk.type == "L" and self.layers == self.picture.header.layers:
            raise Malformed("more layers than declared")
        if chunk.type == "E" and self.layers < self.picture.header.layers:
            raise Malformed("fewer layers than declared")
        if not chunk.is_ancillary() and chunk.type not in CRITICAL:
            raise Unsupported("an unknown critical chunk")
        if chunk.type == "H" and chunk.length > LONGEST:
            raise Unsupported("a header of more than 255 bytes")
        if chunk.type == "E" and chunk.length > 0:
            raise Malformed("E with a payload")
        if chunk.type in METADATA and not self.flaw(chunk):
            too_long = chunk.length > limits.METADATA_CHUNK
            if too_long or self.metadata_bytes + self.cost(chunk) > limits.METADATA:
                raise LimitExceeded("too much metadata")

    def cost(self, chunk):
        """Section 10: what a chunk of metadata adds to all metadata, in bytes."""
        return chunk.length + (limits.TEXT_EXTRA if chunk.type == "tEXt" else 0)

    def flaw(self, chunk):
        """The rule that an ancillary chunk breaks by its number, place or length alone; "" if there is none.

        What is skipped for this reason takes no memory, so that limits do not concern it.
        """
        if chunk.type in AT_MOST_ONE and chunk.type in self.seen:
            return "a second chunk of this type"
        if chunk.type in BEFORE_LAYERS and self.layers > 0:
            return "after the first layer"
        if chunk.length != LENGTHS.get(chunk.type, chunk.length):
            return "a wrong length"
        return ""

    def ancillary(self, chunk):
        """Section 4.3: an ancillary chunk whose CRC is right; it is skipped if it breaks a rule."""
        try:
            if self.flaw(chunk):
                raise Malformed(self.flaw(chunk))
            self.ancillary_content(chunk.type, chunk.available(self.data))
        except (Malformed, Unsupported):
            self.picture.skipped.append(chunk.type)
            return
        self.seen.add(chunk.type)
        if chunk.type in METADATA:
            self.metadata_bytes += self.cost(chunk)

    def ancillary_content(self, type, payload):
        """Sections 5.5 to 5.7. A type that is not known is passed over."""
        if type == "tXTR":
            self.picture.map = self.texture(payload)
        elif type == "bNDS":
            self.picture.bounds = read_bounds(payload, self.picture.header.layers)
        elif type == "tEXt":
            self.picture.texts.append(read_text(payload))
        elif type in METADATA:
            if type == "eXIF" and self.layers > 0 and orientation(payload) != 1:
                raise Malformed("an orientation after the first layer")
            if type == "cICP":
                check_code_points(payload)
            self.picture.metadata[type] = payload

    def critical(self, type, payload):
        """The payload of a critical chunk whose CRC is right. `E` has none."""
        if type == "H":
            header = read_header(payload)
            check_limits(header)
            self.picture = Picture(header)
        elif type == "L":
            self.layer(payload)

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
        head = self.layer_head(payload, len(payload))
        if head is None:
            raise Malformed("a layer that ends in its number of Gaussians")
        count, at = head
        stream = payload[at:]
        if header.coding == ENTROPY:
            components = decode_layer(stream, count, header.width, header.height, header.steps)
        else:
            check_padding(header.quantizers, stream, count)
            components = decode_gaussians(header.quantizers, stream, count)
        self.picture.components.append(components)
        self.layers += 1

    def incomplete_layer(self, chunk):
        """Section 11: the complete Gaussians of a layer of the packed coding in which the file ends are kept.

        Its number, its length and its values count before the CRC does; the padding does not. That a layer is too short
        for its number is not among what counts at once, so that it is not an error here.
        """
        quantizers = self.picture.header.quantizers
        payload = chunk.available(self.data)
        head = self.layer_head(payload, chunk.length)
        if head is None:
            return
        count, at = head
        stream = payload[at:]
        arrived = min(count, len(stream) * 8 // bits_of_gaussian(quantizers))
        components = decode_gaussians(quantizers, stream, arrived)
        if arrived < count:
            check_started(quantizers, stream, arrived)
        self.picture.components.append(components)

    def texture(self, payload):
        """Section 5.7: the Gaussians of the map."""
        columns, rows = map_size(self.picture.header)
        fields = Fields(payload)
        step = step_of_code(fields.u16())
        count = fields.number()
        if not 1 <= count <= columns * rows:
            raise Malformed("a number of Gaussians out of range")
        check_density(fields.rest(), count)  # before the limit: what is skipped for it costs nothing
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
