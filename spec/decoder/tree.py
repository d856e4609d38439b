"""The entropy coding: a layer (section 7.4)."""

import numpy as np

from .arith import F
from .entropy import EntropyReader
from .errors import Malformed
from .values import UNITS, Shape, amplitudes, coordinate_in_pixels, fine_of, position_bits

LARGEST_EXPONENT = 7
DENSEST = 4  # Gaussians for each byte


def ceil_div(a, b):
    return -(-a // b)


def root_side(width, height):
    """The side of a root in pixels: the least power of two that is at least 8 and a 16th of the longer side."""
    side = 8
    while 16 * side < max(width, height):
        side *= 2
    return side


def magnitude_class(magnitude):
    """m of section 7.4: 0 for 0, 1 for 1, 2 for 2 to 3, 3 for 4 to 7, 4 for more."""
    return min(magnitude.bit_length(), 4)


def check_density(stream, count):
    """The number of Gaussians that some bytes, from the state on, can have at most."""
    if count > DENSEST * len(stream):
        raise Malformed("more than four Gaussians for each byte")


class LayerReader:
    """Reads the Gaussians of one layer of a picture of width x height pixels."""

    def __init__(self, stream, count, width, height, steps):
        check_density(stream, count)
        self.reader = EntropyReader(stream)
        self.steps = steps
        self.root = root_side(width, height)
        self.columns = ceil_div(width, self.root) + 2
        self.rows = ceil_div(height, self.root) + 2
        self.gaussians = []  # each x, y, l11, l21, l22, amplitudes

    def read(self, count):
        self.cell(0, 0, self.columns * self.root, self.rows * self.root, count)
        self.reader.finish()
        return self.gaussians

    def cell(self, x, y, width, height, count):
        """A cell with `count` >= 1 Gaussians. Its corner (x, y) is counted from that of the grid; all in pixels."""
        is_root = width <= self.root and height <= self.root
        is_pixel = width == 1 and height == 1
        if (count > 1 or not is_root) and not is_pixel:
            first = self.share(count)
            if width >= height:
                part = self.first_part(width)
                parts = [(x, y, part, height, first), (x + part, y, width - part, height, count - first)]
            else:
                part = self.first_part(height)
                parts = [(x, y, width, part, first), (x, y + part, width, height - part, count - first)]
            for *rectangle, n in parts:
                if n > 0:
                    self.cell(*rectangle, n)
        else:
            for _ in range(count):
                self.gaussian(x, y, width, height)

    def first_part(self, side):
        """The length of the first part of a side that is divided, in pixels."""
        if side > self.root:
            return ceil_div(side // self.root, 2) * self.root
        return side // 2

    def share(self, n):
        """How many of a cell's n Gaussians lie in its first part."""
        if n < 16:
            first = self.reader.symbol(157 + n)
            largest = n
        else:
            s = self.reader.symbol(173 + n.bit_length() - 1)
            low = ceil_div(s * (n + 1), 16)
            largest = ceil_div((s + 1) * (n + 1), 16) - 1
            first = low + self.reader.plain((largest - low).bit_length())
        if first > largest:
            raise Malformed("more Gaussians in a part than possible")
        return first

    def gaussian(self, x, y, width, height):
        """Attributes and position of a Gaussian in a cell that is not split; its sides are powers of two."""
        level = (width.bit_length() - 1) + (height.bit_length() - 1)
        n = self.reader.symbol(0)
        if n > LARGEST_EXPONENT:
            raise Malformed("a step exponent over 7")
        codes = self.colour_codes(n)
        size, ratio, slant = self.shape_codes(n, level)
        shape = Shape(self.steps, n, size, ratio, slant)
        bits_x = position_bits(self.steps, n, shape.l11, width)
        bits_y = position_bits(self.steps, n, shape.l22, height)
        centre_x = self.coordinate(x, width, bits_x)
        centre_y = self.coordinate(y, height, bits_y)
        self.gaussians.append([centre_x, centre_y, shape.l11, shape.l21, shape.l22,
                               *amplitudes(self.steps, codes, shape.s)])

    def colour_codes(self, n):
        """The codes of the colour axes (item 2), as many as there are channels."""
        k = max(0, n - 3)
        magnitude = self.reader.symbol(1 + n)
        if magnitude == 15:
            magnitude += self.reader.excess()
        magnitude = magnitude * 2**k + self.reader.plain(k)
        negative = magnitude != 0 and self.reader.plain(1) == 1
        codes = [-magnitude if negative else magnitude]
        for a in range(1, len(self.steps.axes)):
            m = magnitude_class(abs(codes[-1]))
            code = self.reader.signed(9 + 40 * (a - 1) + 5 * n + m, k)
            codes.append(-code if negative else code)
        return codes

    def shape_codes(self, n, level):
        """The codes of size, ratio and slant (items 3 to 5)."""
        k = max(0, n - 2)
        r = min(n, 2)
        expected = (F(0.1) + F(0.19) * F(level)) / (self.steps.size * fine_of(n))
        size = self.reader.signed(129 + r, k) + int(expected)  # int() truncates towards zero
        ratio = self.reader.signed(132 + r, k)
        q = ratio * 4 // 2**n  # ratio * 2^(2 - n), rounded down
        j = min(max(q // 3 + 3, 0), 6)
        slant = self.reader.signed(135 + 7 * r + j, k)
        return size, ratio, slant

    def coordinate(self, corner, side, bits):
        """Reads a coordinate with `bits` plain bits, in a cell's side of which all are in pixels; the result too."""
        p = self.reader.plain(bits)
        part = side * UNITS // 2**bits  # units; at least 2
        return coordinate_in_pixels(corner * UNITS + p * part + part // 2, self.root)


def decode_layer(stream, count, width, height, steps):
    """The Gaussians of a layer: binary32, shape (count, 5 + channels): x, y, l11, l21, l22, amplitudes."""
    gaussians = LayerReader(stream, count, width, height, steps).read(count)
    return np.array(gaussians, dtype=F)
