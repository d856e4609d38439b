"""From a picture and a request to samples (sections 9.4 to 9.6)."""

import numpy as np

from . import limits
from .arith import F, clamp, quiet
from .decode import map_size
from .errors import LimitExceeded
from .model import drawn
from .render import Grid, Request, Scene, add_gaussians
from .texture import gains_of_nodes, sums_of_map, texture_of_grid
from .work import check_work

AT_ONCE = 2**18  # pixels of the grid: a band of output rows covers no more of them, unless it is a single row
ALPHA_MORE = F(2.0**-16)
GRAY, GRAY_ALPHA, RGB, RGBA = 0, 1, 2, 3


def covered(first, count, output, grid):
    """Section 9.5: the columns (or rows) of the grid that output columns cover: (first, one behind the last)."""
    return first * grid // output, -(-(first + count) * grid // output)


def overlaps(X, i, output, grid):
    """o(i) of output column X and column i of the grid; integers, or arrays of them. Not positive: no overlap."""
    return np.minimum((X + 1) * grid, (i + 1) * output) - np.maximum(X * grid, i * output)


class Rendering:
    """One rendering. Limits are checked before memory is allocated."""

    def __init__(self, picture, request):
        header = picture.header
        self.header = header
        self.request = request = request.resolve(header)
        self.grid = Grid(request.size, (header.width, header.height), header.kernel)
        x, y, width, height = request.region
        left, right = covered(x, width, request.size[0], self.grid.width)
        top, bottom = covered(y, height, request.size[1], self.grid.height)
        pixels = (right - left) * (bottom - top)
        if max(width, height) > limits.SIDE or width * height > limits.PIXELS or pixels > limits.PIXELS:
            raise LimitExceeded("too many pixels")
        self.has_alpha = header.model in (GRAY_ALPHA, RGBA)
        components = picture.all_components()[: request.first]
        gaussians = drawn(header.parameterization, components)
        self.scene = Scene(gaussians, self.grid, header.kernel, header.cutoff)
        check_work(self.scene, (left, top), right - left, bottom - top)
        self.gains = None
        if picture.map is not None and request.texture:
            self.gains = gains_of_nodes(sums_of_map(picture.map, *map_size(header)), self.grid)

    def sums(self, x, y, width, height):
        """Section 9.4: the sums of pixels of the grid, from column x and row y on: (height, width, channels)."""
        sums = np.empty((height, width, self.header.channels), dtype=F)
        sums[:] = self.header.base
        if self.gains is not None:
            colours = self.header.channels - self.has_alpha
            sums[:, :, :colours] += texture_of_grid(self.gains, self.grid, x, y, width, height)[:, :, np.newaxis]
        add_gaussians(self.scene, sums, (x, y))
        return sums

    def floats(self, first_row, rows):
        """Section 9.5: the samples as floats of rows of the region: (rows, width, channels)."""
        x, y, width, _ = self.request.region
        y += first_row
        W, H = self.request.size
        left, right = covered(x, width, W, self.grid.width)
        top, bottom = covered(y, rows, H, self.grid.height)
        sums = self.sums(left, top, right - left, bottom - top)
        if (W, H) == (self.grid.width, self.grid.height):
            return sums
        values = clamp(sums, 0, 1)
        if self.has_alpha:
            values[:, :, :-1] = values[:, :, :-1] * (values[:, :, -1:] + ALPHA_MORE)
        return np.stack([self.averages(values, left, top, y + row) for row in range(rows)])

    def averages(self, values, left, top, Y):
        """The averages of output row Y: (width, channels). values: of the grid, from column left and row top on."""
        x, _, width, _ = self.request.region
        W, H = self.request.size
        GX, GY = self.grid.width, self.grid.height
        column = np.zeros(values.shape[1:], dtype=F)
        for j in range(*covered(Y, 1, H, GY)):
            column = column + F(overlaps(Y, j, H, GY)) * values[j - top]
        column = column / F(GY)
        X = np.arange(x, x + width)
        first = X * GX // W
        behind = -(-(X + 1) * GX // W)
        mean = np.zeros((width, values.shape[2]), dtype=F)
        for step in range(int((behind - first).max())):
            i = first + step
            o = overlaps(X, i, W, GX).astype(F)[:, np.newaxis]
            nearest = np.minimum(i, behind - 1)  # any column there is, for output columns that cover fewer
            further = mean + o * column[nearest - left]
            mean = np.where((i < behind)[:, np.newaxis], further, mean)
        mean = mean / F(GX)
        if self.has_alpha:
            mean[:, :-1] = mean[:, :-1] / (mean[:, -1:] + ALPHA_MORE)
        return mean

    def integers(self, floats):
        """Section 9.5: samples as integers at the depth of the header."""
        full = F(2**self.header.depth - 1)
        return np.floor(clamp(floats, 0, 1) * full + F(0.5)).astype(np.uint16)

    def widened(self, samples):
        """Section 9.6: samples in the requested colour model."""
        colours = samples[:, :, : self.header.channels - self.has_alpha]
        alpha = samples[:, :, -1:] if self.has_alpha else np.full_like(samples[:, :, :1], 2**self.header.depth - 1)
        if self.request.model in (RGB, RGBA) and colours.shape[2] == 1:
            colours = np.repeat(colours, 3, axis=2)
        return np.concatenate([colours, alpha], axis=2) if self.request.model in (GRAY_ALPHA, RGBA) else colours

    def run(self):
        """Samples of the region: unsigned integers of 16 bits, (height, width, channels of the requested model)."""
        x, _, width, height = self.request.region
        W, H = self.request.size
        left, right = covered(x, width, W, self.grid.width)
        rows_of_grid = -(-self.grid.height // H)  # that an output row covers, about
        rows = max(1, AT_ONCE // ((right - left) * rows_of_grid))
        bands = []
        for first in range(0, height, rows):
            floats = self.floats(first, min(rows, height - first))
            bands.append(self.widened(self.integers(floats)))
        return np.concatenate(bands)


def render(picture, request=Request()):
    """The samples of a picture: unsigned integers of 16 bits, (height, width, channels)."""
    with quiet():
        return Rendering(picture, request).run()
