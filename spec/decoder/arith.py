"""Binary32 arithmetic (sections 2 and 3).

Every operation on `numpy.float32` values or arrays is one IEEE 754 operation with one rounding; NumPy neither fuses
operations nor flushes subnormal numbers. Overflow and NaN are to be silent, so callers work inside `quiet()`.
"""

import numpy as np

F = np.float32


def quiet():
    """A context in which infinities and NaN arise without a warning."""
    return np.errstate(all="ignore")


def bits(u32):
    """The binary32 with the bits `u32`."""
    return np.array(u32, dtype=np.uint32).view(F)[()]


def clamp(x, low, high):
    """x clamped to [low, high]; elementwise."""
    return np.minimum(np.maximum(x, F(low)), F(high))


LOG2_E = bits(0x3FB8AA3B)
EXP = [bits(b) for b in (0x39218489, 0x3AAEC3FF, 0x3C1D955B, 0x3D635847, 0x3E75FDF0, 0x3F317218, 0x3F800000)]


def exp(x):
    """exp of section 3.1, for finite x; elementwise."""
    y = clamp(x * LOG2_E, -126, 126)
    n = np.rint(y)
    f = y - n
    p = EXP[0]
    for c in EXP[1:]:
        p = p * f + c
    return p * np.ldexp(F(1), n.astype(np.int32))


TWO_OVER_PI = bits(0x3F22F983)
HALF_PI_HIGH = bits(0x3FC90000)
HALF_PI_LOW = bits(0x39FDAA22)
S0, S1, S2 = bits(0xB94CA1F9), bits(0x3C08839E), bits(0xBE2AAAA3)
K0, K1, K2 = bits(0x37CCF5CE), bits(0xBAB6061A), bits(0x3D2AAAA5)


def sin_cos(x):
    """(sin x, cos x) of section 3.2, for |x| <= 1024; x is an array."""
    n = np.rint(x * TWO_OVER_PI)
    r = (x - n * HALF_PI_HIGH) - n * HALF_PI_LOW
    r2 = r * r
    s = ((S0 * r2 + S1) * r2 + S2) * r2 * r + r
    c = ((K0 * r2 + K1) * r2 + K2) * r2 * r2 - F(0.5) * r2 + F(1)
    quarter = n.astype(np.int64) % 4
    sin = np.choose(quarter, [s, c, -s, -c])
    cos = np.choose(quarter, [c, -s, -c, s])
    return sin, cos
