"""Texture (section 9.7). Arrays of points are indexed [y, x] and binary32 unless something else is said."""

import numpy as np

from .arith import F, clamp
from .header import QUARTIC
from .model import CHOLESKY, drawn
from .render import Grid, Scene, add_gaussians
from .work import check_work

MAP_BASE = [F(0), F(0), F(32768) / F(65535)]
ISOTROPIC, HORIZONTAL, VERTICAL = 0, 1, 2  # patterns
S = [F(2.0**-10), F(1.82) * F(2.0**-14)]   # by octave
T = [F(1.23) * F(2.0**-10), F(1.72) * F(2.0**-14)]


def sums_of_map(components, columns, rows):
    """m0, m1, m2 at each node: shape (rows, columns, 3). components: of the map's Gaussians, (n, 8)."""
    sums = np.empty((rows, columns, 3), dtype=F)
    sums[:] = MAP_BASE
    grid = Grid((columns, rows), (columns, rows), QUARTIC)
    scene = Scene(drawn(CHOLESKY, components), grid, QUARTIC, None)
    check_work(scene, (0, 0), columns, rows)
    add_gaussians(scene, sums, (0, 0))
    return sums


def gains_of_nodes(sums, grid):
    """g(o, p) at each node, shape (rows, columns), in a dictionary."""
    nearest = np.minimum(F(grid.output_width) / F(grid.stored_width), F(grid.output_height) / F(grid.stored_height))
    fade = clamp(F(8) * nearest - F(1), 0, 1)
    d = sums[:, :, 2] * F(4) - F(2)
    h = clamp(d - F(0.375), 0, 1)
    v = clamp(F(-0.375) - d, 0, 1)
    i = np.sqrt(F(1) - (h + v) * (h + v))
    gains = {}
    for o in (0, 1):
        a = clamp((sums[:, :, o] - F(2.0**-7)) * F(0.5), 0, 1) * fade
        gains[o, ISOTROPIC] = (a * i) * S[o]
        gains[o, HORIZONTAL] = (a * h) * T[o]
        gains[o, VERTICAL] = (a * v) * T[o]
    return gains


def numbers(o, p, xs, ys):
    """The noise A, B, C of blocks (X, Y), X of xs and Y of ys: binary32, shape (len(ys), len(xs)) each."""
    modulus = 2**32

    def product(a, factor):  # modulo 2^32, in unsigned integers of 64 bits
        return a * np.uint64(factor) % np.uint64(modulus)

    def shifted(a, n):
        return a >> np.uint64(n)

    k = 3 * o + p + 1
    s = ((8 * ys + k) % modulus).astype(np.uint64)
    s = product(s ^ shifted(s, 16), 0x21F0AAAD)
    s = product(s ^ shifted(s, 15), 0x735A2D97)
    s = s ^ shifted(s, 15)
    x = (xs % modulus).astype(np.uint64)
    r = (product(x, 0x9E3779B1)[np.newaxis, :] + s[:, np.newaxis]) % np.uint64(modulus)
    r = product(r ^ shifted(r, 15), 0x2C1B3C6D)

    def signed(bits):
        bits = bits.astype(np.int64)
        return np.where(bits >= 1024, bits - 2048, bits).astype(F)

    eleven = np.uint64(2**11 - 1)
    return signed(shifted(r, 21)), signed(shifted(r, 10) & eleven), signed(r & eleven)


def gains_of_blocks(g, o, p, xs, ys):
    """gain(X, Y): shape (len(ys), len(xs)). g: g(o, p) at each node."""
    n = (4 if p == ISOTROPIC else 2) // 2**o
    e = F(0) if p == HORIZONTAL else F(0.5)
    f = F(0) if p == VERTICAL else F(0.5)
    rows, columns = g.shape
    left, right = np.clip(xs // n, 0, columns - 1), np.clip(xs // n + 1, 0, columns - 1)
    above, below = np.clip(ys // n, 0, rows - 1), np.clip(ys // n + 1, 0, rows - 1)
    along_x = (((xs % n).astype(F) + e) / F(n))[np.newaxis, :]
    along_y = (((ys % n).astype(F) + f) / F(n))[:, np.newaxis]

    def interpolated(row):
        first, second = g[np.ix_(row, left)], g[np.ix_(row, right)]
        return first + (second - first) * along_x

    upper, lower = interpolated(above), interpolated(below)
    return upper + (lower - upper) * along_y


def values_of_blocks(g, o, p, xs, ys):
    """V0 to V3: shape (4, len(ys), len(xs))."""
    gain = gains_of_blocks(g, o, p, xs, ys)
    a, b, c = (number * gain for number in numbers(o, p, xs, ys))
    return np.stack([a + (b + c), a - (b + c), (b - c) - a, -((b - c) + a)])


def pattern(g, o, p, xs, ys):
    """N(o, p) at points (x, y) of the lattice, x of xs and y of ys, which are ascending without gaps."""
    size = 2 if p == ISOTROPIC else 4
    block_xs = np.arange(xs[0] // size, xs[-1] // size + 2)  # one more than those of the points, for streaks
    block_ys = np.arange(ys[0] // size, ys[-1] // size + 2)
    values = values_of_blocks(g, o, p, block_xs, block_ys)
    column = (xs // size - block_xs[0])[np.newaxis, :]
    row = (ys // size - block_ys[0])[:, np.newaxis]
    r = (xs % size)[np.newaxis, :]
    q = (ys % size)[:, np.newaxis]
    if p == ISOTROPIC:
        return values[2 * q + r, row, column]
    if p == HORIZONTAL:
        this, following, part = values[q, row, column], values[q, row, column + 1], r
    else:
        this, following, part = values[r, row, column], values[r, row + 1, column], q
    return this + (following - this) * ((part.astype(F) + F(0.5)) / F(4))


def enlarged(old, first, wanted, axis):
    """Doubles an array of points along an axis. first: coordinate of old's first point; wanted: coordinates of points
    of the finer lattice, which lie at least one old point inside."""
    middle = wanted // 2 - first
    side = np.where(wanted % 2 == 0, middle - 1, middle + 1)
    return F(3) * old.take(middle, axis) + old.take(side, axis)


def texture_of_pixels(gains, xs, ys):
    """T_0 at stored pixels (x, y), x of xs and y of ys, which are ascending without gaps."""
    coarse_xs = np.arange(xs[0] // 2 - 1, xs[-1] // 2 + 2)
    coarse_ys = np.arange(ys[0] // 2 - 1, ys[-1] // 2 + 2)
    t1 = pattern(gains[1, ISOTROPIC], 1, ISOTROPIC, coarse_xs, coarse_ys)
    for p in (HORIZONTAL, VERTICAL):
        t1 = t1 + pattern(gains[1, p], 1, p, coarse_xs, coarse_ys)
    t0 = enlarged(enlarged(t1, coarse_xs[0], xs, 1), coarse_ys[0], ys, 0)
    for p in (ISOTROPIC, HORIZONTAL, VERTICAL):
        t0 = t0 + pattern(gains[0, p], 0, p, xs, ys)
    return t0


class Axis:
    """The pixels of the grid from `first`, `count` of them, along an axis of `grid` pixels for `stored` ones.

    needed: the stored pixels on which they depend; coefficients: c0 to c3 of each, or None on the stored grid.
    """

    def __init__(self, first, count, grid, stored):
        self.coefficients = None
        self.needed = np.arange(first, first + count)
        if grid <= stored:  # where it is less, fade is 0, and it does not matter which pixels are taken
            return
        at = (2 * self.needed + 1) * stored - grid
        b = at // (2 * grid)
        t = (at % (2 * grid)).astype(F) / F(2 * grid)
        self.needed = np.arange(b[0] - 1, b[-1] + 3)
        self.index = b - 1 - self.needed[0]
        self.coefficients = [
            ((F(1) - F(0.5) * t) * t - F(0.5)) * t,
            ((F(1.5) * t - F(2.5)) * t) * t + F(1),
            ((F(2) - F(1.5) * t) * t + F(0.5)) * t,
            ((F(0.5) * t - F(0.5)) * t) * t,
        ]

    def interpolate(self, texture, axis):
        """From the stored pixels `needed` along an axis of the array to the pixels of the grid."""
        if self.coefficients is None:
            return texture
        shape = (-1, 1) if axis == 0 else (1, -1)
        terms = [texture.take(self.index + i, axis) * self.coefficients[i].reshape(shape) for i in range(4)]
        return ((terms[0] + terms[1]) + terms[2]) + terms[3]


def texture_of_grid(gains, grid, x, y, width, height):
    """The texture of pixels of the grid, from column x and row y on: shape (height, width)."""
    along_x = Axis(x, width, grid.width, grid.stored_width)
    along_y = Axis(y, height, grid.height, grid.stored_height)
    texture = texture_of_pixels(gains, along_x.needed, along_y.needed)
    return along_x.interpolate(along_y.interpolate(texture, 0), 1)
