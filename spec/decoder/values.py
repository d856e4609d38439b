"""The entropy coding: from codes to values (section 7.5)."""

import numpy as np

from .arith import F, clamp, exp

SQRT_2 = F(2.0**0.5)
A, B, C, D = F(0.57735026), F(0.70710677), F(0.4082483), F(-0.8164966)
UNITS = 128  # units of coordinates in a pixel


def exp20(x):
    """e of section 7.5: exp of an argument that is first clamped to [-20, 20]."""
    return exp(clamp(x, -20, 20))


def fine_of(exponent):
    """2^-n for the step exponent n, 0 to 7; exact."""
    return F(2.0**-exponent)


class Shape:
    """s, l11, l21 and l22 of a Gaussian, in pixels, all binary32."""

    def __init__(self, steps, exponent, size, ratio, slant):
        fine = fine_of(exponent)
        self.s = exp20(F(size) * (steps.size * fine))
        t = exp20(F(ratio) * (steps.ratio * fine))
        self.l11 = self.s * t
        self.l22 = self.s / t
        self.l21 = F(slant) * (steps.slant * fine) * self.l22


def position_bits(steps, exponent, factor, side):
    """Section 7.4, position: the number of plain bits b along an axis.

    factor: l11 for x, l22 for y; side: of the cell along the axis in pixels, a power of two.
    """
    d = ((steps.position * fine_of(exponent)) * factor) * SQRT_2
    _, exponent_above = np.frexp(d)  # d = m 2^e with 0.5 <= m < 1, so floor(log2 d) = e - 1
    f = min(6, -(int(exponent_above) - 1))
    return max(0, f + side.bit_length() - 1)


def amplitudes(steps, codes, s):
    """The amplitudes of all channels (a list of binary32) from the codes of the colour axes."""
    axes = [F(code) * (step / s) for code, step in zip(codes, steps.axes)]
    if len(axes) < 3:
        return axes
    u, v, w = axes[:3]
    red = A * u + B * v + C * w
    green = A * u + F(0) * v + D * w
    blue = A * u - B * v + C * w
    return [red, green, blue] + axes[3:]


def coordinate_in_pixels(coordinate, root):
    """From units, counted from the corner of the grid, to pixels of the picture. root: its side in pixels."""
    return F(coordinate - root * UNITS) / F(UNITS)
