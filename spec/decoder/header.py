"""The header `H` with its quantizers or steps (sections 5.1 to 5.3 and 6)."""

import math
from dataclasses import dataclass

import numpy as np

from .arith import F, bits
from .container import read_number
from .errors import Malformed, Unsupported

LONGEST = 255           # bytes
LARGEST_SIDE = 2**20    # pixels
MOST_LAYERS = 65_535

PACKED, ENTROPY = 0, 1            # codings
EXPONENTIAL, QUARTIC = 0, 1       # kernels
MODELS = ["Gray", "GrayAlpha", "Rgb", "Rgba"]  # by the code of the colour model
CHANNELS = [1, 2, 3, 4]
FLOAT, LINEAR, LOGARITHMIC = 0, 1, 2  # kinds of quantizer


@dataclass
class Quantizer:
    """Section 6. kind: 0 to 2; depth: bits of a code; scale, offset: binary32, None in kind 0."""

    kind: int
    depth: int
    scale: object = None
    offset: object = None


@dataclass
class Steps:
    """Section 5.3. axes: one binary32 for each colour axis; the others are binary32."""

    axes: list
    position: object
    size: object
    ratio: object
    slant: object


@dataclass
class Header:
    """Sides in stored pixels; base: a binary32 for each channel, 1.0 is a full sample; cutoff: of kernel 0, squared."""

    model: int
    depth: int              # bits per sample, 8 or 16
    coding: int
    kernel: int
    parameterization: int
    width: int
    height: int
    gaussians: int
    layers: int
    base: np.ndarray
    cutoff: object
    quantizers: list        # packed coding
    steps: Steps            # entropy coding

    @property
    def channels(self):
        return CHANNELS[self.model]


class Fields:
    """Reads the fields of a payload one after the other."""

    def __init__(self, payload):
        self.payload = payload
        self.at = 0

    def unsigned(self, size):
        raw = self.payload[self.at : self.at + size]
        if len(raw) < size:
            raise Malformed("a payload that is shorter than its fields")
        self.at += size
        return int.from_bytes(raw, "little")

    def u8(self):
        return self.unsigned(1)

    def u16(self):
        return self.unsigned(2)

    def f32(self):
        return bits(self.unsigned(4))

    def number(self):
        result = read_number(self.payload, self.at)
        if result is None:
            raise Malformed("a payload that is shorter than its fields")
        value, self.at = result
        return value

    def rest(self):
        return self.payload[self.at :]


# Section 5.3: the usual steps of position, size, ratio and slant.
# (Rounded twice, to binary64 and to binary32; these four come out as when rounded once.)
USUAL_GEOMETRY = tuple(F(math.sqrt(square)) for square in (1.2, 0.6, 0.75, 3))
LARGEST_STEP_CODE = 0xF000


def step_of_code(code):
    """Section 5.3: the step with a code of 16 bits."""
    if code > LARGEST_STEP_CODE:
        raise Unsupported("a step over 2^10")
    return bits(0x35800000 + code * 2**12)


def step_of_ratio(first, code):
    """Section 5.3: the step that is told by its ratio to the first one."""
    step = first * bits(0x3B800000 + code * 2**19)
    if not F(2.0**-20) <= step <= F(2.0**10):
        raise Malformed("a step that is not within 2^-20 to 2^10")
    return step


def read_steps(fields, channels, in_header):
    """Section 5.3, entropy coding. in_header: whether the steps of geometry are there."""
    first = step_of_code(fields.u16())
    axes = [first] + [step_of_ratio(first, fields.u8()) for _ in range(channels - 1)]
    geometry = [step_of_code(fields.u16()) for _ in range(4)] if in_header else USUAL_GEOMETRY
    return Steps(axes, *geometry)


def read_quantizer(fields):
    """Section 6: an entry of the header. Each field is checked before the next one is read."""
    kind = fields.u8()
    if kind not in (FLOAT, LINEAR, LOGARITHMIC):
        raise Unsupported(f"a quantizer of kind {kind}")
    depth = fields.u8()
    if depth == 0:
        raise Malformed("a bit depth of 0")
    if kind == FLOAT:
        if depth != 32:
            raise Unsupported(f"a float of {depth} bits")
        return Quantizer(kind, depth)
    if depth > 16:
        raise Unsupported(f"a bit depth of {depth}")
    scale = fields.f32()
    if not F(0) < scale <= F(2.0**32):
        raise Malformed("a scale out of range")
    offset = fields.f32()
    if not F(-(2.0**32)) <= offset <= F(2.0**32):
        raise Malformed("an offset out of range")
    return Quantizer(kind, depth, scale, offset)


def read_side(fields):
    side = fields.number()
    if side == 0:
        raise Malformed("a width or height of 0")
    if side > LARGEST_SIDE:
        raise Unsupported("a width or height over 2^20")
    return side


def read_header(payload):
    """Section 5.1: fields are checked in their order. The CRC has been found right, and the payload is not too long."""
    fields = Fields(payload)
    form = fields.u8()
    model = form & 3
    depth = 16 if form & 4 else 8
    coding = form >> 3 & 1
    kernel = form >> 4 & 1
    shape = form >> 5 & 3  # parameterization, or whether steps of geometry are in the header
    if form >> 7:
        raise Unsupported("bit 7 of the format")
    if shape > (2 if coding == PACKED else 1):
        raise Unsupported("parameterization or form of steps")
    width, height = read_side(fields), read_side(fields)
    gaussians = fields.number()
    layers = 0
    if gaussians > 0:
        layers = fields.number()
        if not 1 <= layers <= gaussians:  # before the next check, as in the table
            raise Malformed("a number of layers out of range")
        if layers > MOST_LAYERS:
            raise Unsupported("more than 65535 layers")
    if depth == 8:
        base = [F(fields.u8()) / F(255) for _ in range(CHANNELS[model])]
    else:
        base = [F(fields.u16()) / F(65535) for _ in range(CHANNELS[model])]
    cutoff = None
    if kernel == EXPONENTIAL:
        cutoff = fields.f32()
        if cutoff > F(64):
            raise Unsupported("a cut-off over 64")
        if not F(0) < cutoff:  # NaN is not
            raise Malformed("a cut-off that is not over 0")
    quantizers, steps = None, None
    if gaussians > 0:
        if coding == PACKED:
            quantizers = [read_quantizer(fields) for _ in range(5 + CHANNELS[model])]
        else:
            steps = read_steps(fields, CHANNELS[model], shape == 1)
    if fields.rest():
        raise Malformed("a header that is longer than its fields")
    parameterization = shape if coding == PACKED else 1
    return Header(model, depth, coding, kernel, parameterization, width, height, gaussians, layers,
                  np.array(base, dtype=F), cutoff, quantizers, steps)
