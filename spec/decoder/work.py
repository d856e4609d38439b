"""Work of a rendering (section 10), counted before it begins.

All is in binary64, with ellipses that are smaller by a small part, and with tiles only as far as the region covers
them. So the count is never more than that of section 10, and nothing is refused that a decoder has to accept.
"""

import numpy as np

from . import limits
from .errors import LimitExceeded

TILE = 8              # pixels of the grid
SMALLER = 1 - 2**-20  # more than the roundings of binary64
AT_ONCE = 256         # Gaussians


class Ellipses:
    """Ellipses u^2 + v^2 <= reach^2 with u = i11 dx and v = w dx + i22 dy, of some Gaussians of a scene."""

    def __init__(self, scene, which):
        self.x, self.y, self.i11, self.i22, self.w = (
            a[which].astype(np.float64) for a in (scene.x, scene.y, scene.i11, scene.i22, scene.w))
        reach = (1.0 if scene.cutoff is None else float(scene.cutoff) ** 0.5) * SMALLER
        self.slope = np.hypot(self.i11, self.w)
        self.reach = reach
        self.height = reach * self.slope / (self.i11 * self.i22)  # from the centre to the uppermost point
        self.turn = -self.w * reach / (self.i11 * self.i22)       # dy of the rightmost point

    def right_end(self, n, dy):
        """dx of the right end of the line at dy through ellipse n, which it meets; n, dy: arrays.

        It solves (i11 dx)^2 + (w dx + i22 dy)^2 = reach^2.
        """
        across = self.i11[n] * self.i22[n] * dy
        root = np.sqrt(np.maximum((self.reach * self.slope[n]) ** 2 - across**2, 0))
        return (root - self.w[n] * self.i22[n] * dy) / self.slope[n] ** 2

    def ends(self, n, above, below):
        """x of the leftmost and of the rightmost point of ellipse n with a y from `above` to `below`, which exist."""
        above, below = above - self.y[n], below - self.y[n]
        above, below = np.maximum(above, -self.height[n]), np.minimum(below, self.height[n])
        right = self.right_end(n, np.clip(self.turn[n], above, below))
        # An ellipse is the same when turned by 180 degrees.
        left = -self.right_end(n, np.clip(self.turn[n], -below, -above))
        return self.x[n] + left, self.x[n] + right


def work_of_some(ellipses, corner, width, height):
    """Work of some Gaussians in what a region covers of the grid: from the corner (column, row) on, in pixels."""
    x0, y0 = corner
    low = np.clip(ellipses.y - ellipses.height - y0, 0, height + 1)
    high = np.clip(ellipses.y + ellipses.height - y0, -1, height)
    first = (low // TILE).astype(np.int64)
    last = np.minimum(high // TILE, (height - 1) // TILE).astype(np.int64)
    rows = np.where((low > height) | (high < 0), 0, last - first + 1)
    # A pair for each Gaussian n and each row of tiles through which it passes.
    n = np.repeat(np.arange(len(rows)), rows)
    row = np.arange(len(n)) - np.repeat(np.cumsum(rows) - rows, rows) + first[n]
    above = y0 + row * TILE
    below = np.minimum(above + TILE, y0 + height)
    left, right = (end - x0 for end in ellipses.ends(n, above, below))
    first_tile = np.clip(left, 0, width) // TILE
    last_tile = np.minimum(np.clip(right, 0, width) // TILE, (width - 1) // TILE)
    tiles = np.where((left > width) | (right < 0), 0, last_tile - first_tile + 1)
    met = np.bincount(n, tiles, minlength=len(rows)) > 0
    return int((np.maximum(tiles, 1) * met[n]).sum()) * TILE * TILE


def check_work(scene, corner, width, height):
    """Refuses a rendering that takes too much."""
    bound = limits.WORK_PER_PIXEL * width * height + limits.WORK_MORE
    work = 0
    for first in range(0, len(scene.x), AT_ONCE):
        ellipses = Ellipses(scene, slice(first, first + AT_ONCE))
        work += work_of_some(ellipses, corner, width, height)
        if work > bound:
            raise LimitExceeded("too much work")
