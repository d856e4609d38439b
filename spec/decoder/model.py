"""Gaussians: shapes and what is drawn (section 8)."""

from dataclasses import dataclass

import numpy as np

from .arith import F, sin_cos

COVARIANCE, CHOLESKY, ROTATION_SCALE = 0, 1, 2


@dataclass
class Gaussians:
    """Those that are drawn, in the order of the file, in stored pixels.

    x, y, l11, l21, l22: binary32, shape (n,); amplitudes: binary32, shape (n, channels).
    """

    x: np.ndarray
    y: np.ndarray
    l11: np.ndarray
    l21: np.ndarray
    l22: np.ndarray
    amplitudes: np.ndarray


def factor(parameterization, a, b, c):
    """Sections 8.2 to 8.4: (l11, l21, l22) of shapes (a, b, c); NaN in what can not be computed."""
    if parameterization == COVARIANCE:
        l11 = np.sqrt(a)
        l21 = b / l11
        l22 = np.sqrt(c - l21 * l21)
    elif parameterization == CHOLESKY:
        l11, l21, l22 = a, b, c
    else:
        in_range = np.abs(c) <= F(1024)
        s, k = sin_cos(np.where(in_range, c, F(0)))
        a2, b2 = a * a, b * b
        l11 = np.sqrt((k * k) * a2 + (s * s) * b2)
        l21 = ((k * s) * (a2 - b2)) / l11
        l22 = (a * b) / l11
        l11 = np.where(in_range, l11, F(np.nan))  # so that section 8.5 leaves it out
    return l11, l21, l22


def within(values, low, high):
    """Whether values are within [low, high]; NaN is not."""
    return (values >= F(low)) & (values <= F(high))


def drawn(parameterization, components):
    """The drawn ones (section 8.5) of Gaussians with components of shape (n, 5 + channels)."""
    x, y, a, b, c = (components[:, i] for i in range(5))
    amplitudes = components[:, 5:]
    l11, l21, l22 = factor(parameterization, a, b, c)
    large = 2.0**24
    keep = (
        within(x, -large, large)
        & within(y, -large, large)
        & within(l11, 2.0**-12, large)
        & within(l22, 2.0**-12, large)
        & within(l21, -large, large)
        & within(amplitudes, -65536, 65536).all(axis=1)
    )
    return Gaussians(x[keep], y[keep], l11[keep], l21[keep], l22[keep], amplitudes[keep])
