"""Request, grid and the sum of the Gaussians (sections 9.1 to 9.4)."""

import math
from dataclasses import dataclass

import numpy as np

from .arith import F, exp
from .errors import RequestError
from .header import EXPONENTIAL

LARGEST_OUTPUT = 2**23  # pixels
BLOCK = 4096            # pixels of the grid that are evaluated at once, more only in a single row


@dataclass
class Request:
    """Section 9.1. size: (W, H); region: (x, y, width, height) in output pixels; None stands for the default."""

    size: tuple = None
    region: tuple = None
    first: int = None
    model: int = None
    texture: bool = True

    def resolve(self, header):
        """The request with the defaults filled in, after checks."""
        size = self.size or (header.width, header.height)
        region = self.region or (0, 0, *size)
        model = header.model if self.model is None else self.model
        x, y, width, height = region
        if not all(1 <= side <= LARGEST_OUTPUT for side in size):
            raise RequestError("an output size out of range")
        if x < 0 or y < 0 or width < 1 or height < 1 or x + width > size[0] or y + height > size[1]:
            raise RequestError("a region that is empty or not inside the output")
        if self.first is not None and self.first < 0:
            raise RequestError("a negative number of Gaussians")
        if header.model & ~model:  # bit 0 is alpha, bit 1 is colour
            raise RequestError("a colour model that lacks a channel")
        return Request(size, region, self.first, model, self.texture)


def grid_side(output, stored):
    """Section 9.2: GX or GY from the side of the output and that of the stored picture, in pixels."""
    if output >= stored:
        return output
    k = 0
    while (output + 1) * 8 * 2**k < stored:
        k += 1
    return -(-stored // 2**k)


class Grid:
    """Section 9.2. size: (W, H) of the whole output; stored: (W0, H0); all sides in pixels."""

    def __init__(self, size, stored, kernel):
        self.output_width, self.output_height = size
        self.stored_width, self.stored_height = stored
        self.width = grid_side(size[0], stored[0])
        self.height = grid_side(size[1], stored[1])
        d = F(12) if kernel == EXPONENTIAL else F(6)
        self.sx = F(self.width) / F(stored[0])
        self.sy = F(self.height) / F(stored[1])
        self.fx = (F(1) - self.sx * self.sx) / d if self.sx < 1 else F(0)
        self.fy = (F(1) - self.sy * self.sy) / d if self.sy < 1 else F(0)


class Scene:
    """Gaussians in pixels of a grid (section 9.2), ready to be summed.

    x, y, i11, i22, w: binary32, shape (n,); amplitudes: binary32, (n, channels);
    reach: a number that is at least the largest |u| and |v| with a weight over 0.
    """

    def __init__(self, gaussians, grid, kernel, cutoff):
        self.kernel = kernel
        self.cutoff = cutoff
        # u * u can be rounded down, and below 2^-126 by more than a small part of it.
        squared = 1.0 if cutoff is None else float(cutoff)
        self.reach = math.sqrt(squared * (1 + 2**-20) + 2**-140)
        self.x = gaussians.x * grid.sx
        self.y = gaussians.y * grid.sy
        l11 = gaussians.l11 * grid.sx
        l21 = gaussians.l21 * grid.sy
        l22 = gaussians.l22 * grid.sy
        self.amplitudes = gaussians.amplitudes
        if grid.fx != 0 or grid.fy != 0:
            m11 = np.sqrt(l11 * l11 + grid.fx)
            r = l21 / m11
            m21 = (l11 * l21) / m11
            m22 = np.sqrt((l22 * l22 + grid.fy) + (r * r) * grid.fx)
            g = (l11 / m11) * (l22 / m22)
            self.amplitudes = self.amplitudes * g[:, np.newaxis]
            l11, l21, l22 = m11, m21, m22
        self.i11 = F(1) / l11
        self.i22 = F(1) / l22
        self.w = -((l21 * self.i11) * self.i22)
        if kernel != EXPONENTIAL:
            self.i11 = self.i11 * F(0.5)
            self.i22 = self.i22 * F(0.5)
            self.w = self.w * F(0.5)

    def weights(self, n, columns, rows):
        """Section 9.3: weights of Gaussian n at pixels; columns, rows: integers; shape (rows, columns)."""
        dx = (columns.astype(F) + F(0.5)) - self.x[n]
        dy = (rows.astype(F) + F(0.5)) - self.y[n]
        u = self.i11[n] * dx
        v = (self.w[n] * dx)[np.newaxis, :] + (self.i22[n] * dy)[:, np.newaxis]
        uu = (u * u)[np.newaxis, :]
        if self.kernel == EXPONENTIAL:
            q = uu + v * v
            return np.where(q <= self.cutoff, exp(q * F(-0.5)), F(0))
        t = (F(1) - uu) - v * v
        return np.where(t > 0, t * t, F(0))

    # What follows only saves time. It finds rows and columns of pixels outside of which a weight is 0 for sure, in
    # binary64 and with margins for the roundings of section 9.3: |u| and |v| are at most `reach` (r) where a weight is
    # not 0. The computed u is (1 + e) i11 dx' with dx' = px - x and |e| < 2^-22. The computed v differs from
    # w dx' + i22 dy' by less than 2^-21 (|w dx'| + |i22 dy'|), and |w dx'| < 2 (r + |i22 dy'|) where |v| <= r.
    # The bounds are widened by 2^-18 of these terms and by a pixel.

    def rows_of(self):
        """For all Gaussians at once the least and the largest y, in pixels, at which weights may be over 0."""
        i22 = self.i22.astype(np.float64)
        along = np.abs(self.w.astype(np.float64)) * self.reach / self.i11.astype(np.float64)
        dy = (self.reach + along) / i22 * (1 + 2**-18) + 1
        y = self.y.astype(np.float64)
        return y - dy, y + dy

    def columns_of(self, n, first_row, last_row):
        """The same for x of Gaussian n, for rows from first_row to last_row."""
        x, y, i11, i22, w = (float(a[n]) for a in (self.x, self.y, self.i11, self.i22, self.w))
        widest = self.reach * (1 + 2**-18) / i11
        low, high = -widest, widest  # of dx
        if w != 0:
            from_rows = (i22 * (first_row + 0.5 - y), i22 * (last_row + 0.5 - y))
            reach = self.reach + 2**-18 * (self.reach + max(abs(r) for r in from_rows))
            ends = ((-reach - max(from_rows)) / w, (reach - min(from_rows)) / w)
            low, high = max(low, min(ends)), min(high, max(ends))
        return x + low - 1, x + high + 1


def to_pixels(low, high, first, last):
    """The pixels from `first` to `last` whose squares touch [low, high]: (first, last); comparisons come first."""
    if not (low < last + 1 and high > first):
        return 0, -1
    return math.floor(max(low, first)), math.floor(min(high, last))


def add_gaussian(scene, n, sums, corner, rows):
    """Adds Gaussian n to the sums in the rows (first, last); halves them where that makes blocks smaller."""
    height, width, channels = sums.shape
    x0, y0 = corner
    low, high = scene.columns_of(n, *rows)
    left, right = to_pixels(low, high, x0, x0 + width - 1)
    if right < left:
        return
    area = (rows[1] - rows[0] + 1) * (right - left + 1)
    if area > BLOCK and rows[1] > rows[0]:
        middle = (rows[0] + rows[1]) // 2
        add_gaussian(scene, n, sums, corner, (rows[0], middle))
        add_gaussian(scene, n, sums, corner, (middle + 1, rows[1]))
        return
    weights = scene.weights(n, np.arange(left, right + 1), np.arange(rows[0], rows[1] + 1))
    block = sums[rows[0] - y0 : rows[1] - y0 + 1, left - x0 : right - x0 + 1]
    for c in range(channels):
        block[:, :, c] += scene.amplitudes[n, c] * weights


def add_gaussians(scene, sums, corner):
    """Section 9.4: adds all Gaussians in their order.

    sums: binary32, shape (height, width, channels), changed; corner: column and row of the grid of sums[0, 0].
    """
    first, last = corner[1], corner[1] + sums.shape[0] - 1
    low, high = scene.rows_of()
    for n in np.nonzero((low < last + 1) & (high > first))[0]:
        rows = to_pixels(float(low[n]), float(high[n]), first, last)
        add_gaussian(scene, n, sums, corner, rows)
