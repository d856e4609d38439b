//! The activity of a picture: how much its luma varies around each place, on each scale.

use core::ops::Range;

use fearless_simd::{Level, dispatch};

use crate::encode::source::{SPAN, Source};

/// Scales on which errors count: single pixels, and means over 2 x 2 and 4 x 4 pixels.
pub(crate) const SCALES: usize = 3;
/// Side in pixels of the blocks that have weights, which is that of the coarsest scale.
pub(crate) const BLOCK: usize = 1 << (SCALES - 1);

// Constants: docs/tuning.md, "What a person sees".
/// What is added to a variance: the square of a few quantization steps of 8 bits.
pub(super) const LEAST_VARIANCE: f64 = (4.0 / 255.0) * (4.0 / 255.0);
/// The variances are those in square boxes with these radii in pixels.
pub(super) const RADII: [usize; 3] = [2, 5, 14];

/// Where luma comes from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Luma<'a> {
    pub(super) source: &'a Source<'a>,
    /// The share of each colour channel.
    pub(super) shares: &'a [f32],
    /// What the colours are seen over, where a full sample is 1; `None` for colours as they are.
    pub(super) background: Option<f32>,
}

/// Rows of means of luma over squares of pixels. At the edges of the picture, fewer pixels are in a square.
#[derive(Debug)]
struct Plane {
    /// The index in the picture of the first row.
    first: usize,
    width: usize,
    /// Row by row.
    values: Vec<f32>,
}

impl Plane {
    fn rows(&self) -> Range<usize> {
        self.first..self.first + self.values.len() / self.width
    }

    fn row(&self, row: usize) -> &[f32] {
        &self.values[(row - self.first) * self.width..][..self.width]
    }
}

/// Adds to every block of some rows of blocks the mean logarithm of the variances in the boxes around its
/// values, on each scale: that of the product over all [`RADII`]. `rows` are those of the blocks.
pub(super) fn add_logarithms(luma: &Luma<'_>, rows: Range<usize>, blocks: &mut [[f32; SCALES]]) {
    dispatch!(Level::new(), _ => {
        let planes = planes(luma, rows.clone());
        for (scale, plane) in planes.iter().enumerate() {
            add_of_scale(plane, scale, rows.clone(), blocks);
        }
    });
}

/// A radius in pixels of a scale, rounded.
fn scaled(radius: usize, scale: usize) -> usize {
    ((radius + (1 << scale) / 2) >> scale).max(1)
}

/// Size in bytes of what [`add_logarithms`] needs for so many rows of blocks.
pub(super) fn memory(source: &Source<'_>, blocks: usize) -> usize {
    let [width, height] = source.size();
    let rows = (blocks * BLOCK + 2 * margin()).min(height);
    // A quarter and a sixteenth of the values on the other scales; sums for each radius, and products.
    let planes = width * rows * 21 / 16 * size_of::<f32>();
    planes + width * (RADII.len() * 5 + 1) * size_of::<f64>()
}

/// Rows of pixels that the largest box of the coarsest scale reaches beyond its block.
fn margin() -> usize {
    scaled(RADII[RADII.len() - 1], SCALES - 1) * BLOCK
}

/// The luma around some rows of blocks on all scales.
#[inline(always)]
fn planes(luma: &Luma<'_>, blocks: Range<usize>) -> [Plane; SCALES] {
    let [width, height] = luma.source.size();
    let first = (blocks.start * BLOCK).saturating_sub(margin());
    let end = (blocks.end * BLOCK + margin()).min(height);
    let mut planes: [Plane; SCALES] = core::array::from_fn(|scale| {
        let (side, width) = (1 << scale, width.div_ceil(1 << scale));
        let rows = end.div_ceil(side) - first / side;
        Plane { first: first / side, width, values: vec![0.0; rows * width] }
    });
    for y in first..end {
        let [fine, coarser @ ..] = &mut planes;
        let line = &mut fine.values[(y - first) * width..][..width];
        read_line(luma, y, line);
        for (scale, plane) in (1..).zip(coarser) {
            let (side, row) = (1 << scale, (y >> scale) - plane.first);
            let sums = &mut plane.values[row * plane.width..][..plane.width];
            let count = side.min(height - (y >> scale << scale)) as f32;
            for (sum, part) in sums.iter_mut().zip(line.chunks(side)) {
                *sum += part.iter().sum::<f32>() / (part.len() as f32 * count);
            }
        }
    }
    planes
}

/// The luma of a row of pixels.
#[inline(always)]
fn read_line(luma: &Luma<'_>, y: usize, line: &mut [f32]) {
    let Luma { source, shares, background } = *luma;
    let mut planes = [[0.0; SPAN]; 4];
    let full = f32::from(source.depth().max_sample());
    for (part, values) in line.chunks_mut(SPAN).enumerate() {
        source.read(part * SPAN, y, &mut planes);
        values.fill(0.0);
        for (plane, share) in planes.iter_mut().zip(shares) {
            if let Some(curve) = source.curve() {
                for sample in &mut plane[..values.len()] {
                    *sample = curve.at(*sample / full) * full;
                }
            }
            for x in 0..values.len() {
                values[x] += share / full * plane[x];
            }
        }
        if let Some(background) = background {
            let alpha = &planes[source.color().channels() - 1];
            for x in 0..values.len() {
                let alpha = alpha[x] / full;
                values[x] = values[x] * alpha + background * (1.0 - alpha);
            }
        }
    }
}

/// Sums over boxes of a radius that move down a plane.
struct Boxes {
    radius: usize,
    /// Of values and of squares, over the rows of the box in every column.
    columns: [Vec<f64>; 2],
    /// Of those from the first column on; before it, zeros for the columns that a box may reach beyond the
    /// edge, and behind the last one the sum of all.
    from_first: [Vec<f64>; 2],
    /// The reciprocals of the numbers of columns of each box.
    shares: Vec<f64>,
}

impl Boxes {
    fn new(radius: usize, width: usize) -> Self {
        let columns = |x: usize| (x + radius + 1).min(width) - x.saturating_sub(radius);
        Self {
            radius,
            columns: [(); 2].map(|()| vec![0.0; width]),
            from_first: [(); 2].map(|()| vec![0.0; width + 2 * radius + 1]),
            shares: (0..width).map(|x| 1.0 / columns(x) as f64).collect(),
        }
    }

    /// Adds the values of a row, and their squares, times a factor.
    #[inline(always)]
    fn add(&mut self, row: &[f32], factor: f64) {
        let [sums, squares] = &mut self.columns;
        let (sums, squares) = (&mut sums[..row.len()], &mut squares[..row.len()]);
        for x in 0..row.len() {
            let value = f64::from(row[x]);
            sums[x] += factor * value;
            squares[x] += factor * (value * value);
        }
    }

    /// Multiplies the numbers of a row by the variances in the boxes around its values, plus the least
    /// variance.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "see `fit/training_tile.rs`")]
    fn multiply(&mut self, rows: usize, products: &mut [f64]) {
        let width = products.len();
        let mut sum = [0.0; 2];
        for x in 0..width {
            for which in 0..2 {
                sum[which] += self.columns[which][x];
                self.from_first[which][self.radius + 1 + x] = sum[which];
            }
        }
        for which in 0..2 {
            self.from_first[which][self.radius + 1 + width..].fill(sum[which]);
        }
        let [sums, squares] = self.from_first.each_ref().map(|sums| {
            let end = 2 * self.radius + 1;
            (&sums[..width], &sums[end..][..width])
        });
        let (shares, of_row) = (&self.shares[..width], 1.0 / rows as f64);
        for x in 0..width {
            let share = shares[x] * of_row;
            let mean = (sums.1[x] - sums.0[x]) * share;
            let variance = (squares.1[x] - squares.0[x]) * share - mean * mean;
            products[x] *= variance.max(0.0) + LEAST_VARIANCE;
        }
    }
}

/// [`add_logarithms`] on one scale.
#[inline(always)]
fn add_of_scale(
    plane: &Plane,
    scale: usize,
    blocks: Range<usize>,
    of_blocks: &mut [[f32; SCALES]],
) {
    let side = BLOCK >> scale;
    let in_plane = plane.rows();
    let around = |row: usize, radius: usize| {
        row.saturating_sub(radius).max(in_plane.start)..(row + radius + 1).min(in_plane.end)
    };
    let first = blocks.start * side;
    let mut boxes = RADII.map(|radius| {
        let mut boxes = Boxes::new(scaled(radius, scale), plane.width);
        for row in around(first, boxes.radius) {
            boxes.add(plane.row(row), 1.0);
        }
        boxes
    });
    let columns = plane.width.div_ceil(side);
    // The product of all variances in a block is at least 10^-173.
    let mut products = vec![1.0; plane.width];
    let of_rows = blocks.zip(of_blocks.chunks_mut(columns));
    for (block, of_row) in of_rows {
        products.fill(1.0);
        let rows = block * side..((block + 1) * side).min(in_plane.end);
        for row in rows.clone() {
            for boxes in &mut boxes {
                if row > first {
                    let (before, now) = (around(row - 1, boxes.radius), around(row, boxes.radius));
                    if before.start < now.start {
                        boxes.add(plane.row(before.start), -1.0);
                    }
                    if before.end < now.end {
                        boxes.add(plane.row(before.end), 1.0);
                    }
                }
                boxes.multiply(around(row, boxes.radius).len(), &mut products);
            }
        }
        for (of_block, products) in of_row.iter_mut().zip(products.chunks(side)) {
            let product: f64 = products.iter().product();
            of_block[scale] += (product.ln() / (products.len() * rows.len()) as f64) as f32;
        }
    }
}
