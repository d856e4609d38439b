//! The trained values of all Gaussians, and Adam.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::parameterization::{self, Frame};
use super::training;
use crate::gaussian::{MAX_COMPONENTS, Parameterization};

/// The components of a Gaussian in the order of the file: centre, shape, colour.
pub(crate) type Row = [f32; MAX_COMPONENTS];

/// Largest magnitude of a trained colour: large ones that cancel make the picture depend on
/// rounding.
const MAX_COLOR: f32 = 8.0;

/// Gaussians that are stepped, and whose sums are taken, in one go.
const CHUNK: usize = 256;

/// Adam's state of one Gaussian.
#[derive(Clone, Copy, Debug)]
struct AdamState {
    mean: Row,
    square: Row,
    /// Steps since birth, for the bias correction of newcomers.
    age: u32,
}

impl AdamState {
    const NEW: Self = Self { mean: [0.0; MAX_COMPONENTS], square: [0.0; MAX_COMPONENTS], age: 0 };
}

/// Trained values and their optimizer state; one entry per Gaussian in both.
#[derive(Debug, Default)]
pub(crate) struct Parameters {
    pub(crate) values: Vec<Row>,
    moments: Vec<AdamState>,
}

/// What does not change from one Gaussian to the next.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Domain {
    pub(crate) parameterization: Parameterization,
    pub(crate) channels: usize,
    /// Width and height of the picture.
    pub(crate) size: Vec2,
}

impl Domain {
    /// Largest standard deviation that is trained: twice the picture.
    fn max_deviation(self) -> f32 {
        2.0 * self.size.max_element()
    }

    /// The values nearest to `row` that make a Gaussian worth storing.
    pub(crate) fn confined(self, mut row: Row) -> Row {
        let shape =
            parameterization::confined(self.parameterization, shape_of(&row), self.max_deviation());
        row[2..5].copy_from_slice(&shape.to_array());
        self.confine_rest(&mut row);
        row
    }

    fn confine_rest(self, row: &mut Row) {
        // A centre farther outside widens the range that positions are quantized in and shows
        // little.
        let margin = 8.0 + 0.05 * self.size;
        for (value, (low, high)) in row[..2]
            .iter_mut()
            .zip([(-margin.x, self.size.x + margin.x), (-margin.y, self.size.y + margin.y)])
        {
            *value = value.clamp(low, high);
        }
        for value in &mut row[5..] {
            *value = value.clamp(-MAX_COLOR, MAX_COLOR);
        }
    }
}

/// The shape components of a row.
pub(crate) fn shape_of(row: &Row) -> Vec3 {
    Vec3::from_slice(&row[2..5])
}

impl Parameters {
    pub(crate) fn len(&self) -> usize {
        self.values.len()
    }

    /// Adds Gaussians, and no room for more.
    pub(crate) fn extend(&mut self, rows: &[Row]) {
        self.values.reserve_exact(rows.len());
        self.values.extend_from_slice(rows);
        self.moments.reserve_exact(rows.len());
        self.moments.resize(self.values.len(), AdamState::NEW);
    }

    /// Goes back to other values, for as many Gaussians as they are; Adam starts anew.
    pub(crate) fn replace(&mut self, values: Vec<Row>) {
        self.moments.clear();
        self.moments.resize(values.len(), AdamState::NEW);
        self.values = values;
    }

    /// Removes the Gaussians that `keep` does not want, asked by index.
    pub(crate) fn retain(&mut self, keep: impl Fn(usize) -> bool) {
        let mut index = 0..;
        self.values.retain(|_| keep(index.next().expect("endless")));
        let mut index = 0..;
        self.moments.retain(|_| keep(index.next().expect("endless")));
    }

    /// Sorts the Gaussians along a Z curve, so that what is near in the picture is near in memory.
    pub(crate) fn sort(&mut self) {
        let spread = |value: f32| {
            // A bit of the number, a bit of the other coordinate's, and so on.
            (0..16).fold(0, |sum, bit| sum | (value.max(0.0) as u32 >> bit & 1) << (2 * bit))
        };
        let mut order: Vec<(u32, u32)> = (0..)
            .zip(&self.values)
            .map(|(index, row)| (spread(row[0] / 4.0) | spread(row[1] / 4.0) << 1, index))
            .collect();
        order.par_sort_unstable();
        self.values = order.iter().map(|&(_, index)| self.values[index as usize]).collect();
        self.moments = order.iter().map(|&(_, index)| self.moments[index as usize]).collect();
    }

    /// Takes one step against the gradients that `gradient` tells by index and values; `factor`
    /// scales all learning rates. What `gradient` sums up beside them comes back by runs of
    /// [`CHUNK`] Gaussians.
    pub(crate) fn step<Sum: Default + Send>(
        &mut self,
        options: &training::Optimizer,
        bounds: Domain,
        factor: f32,
        gradient: impl Fn(usize, &Row, &mut Sum) -> Row + Sync,
    ) -> Vec<Sum> {
        let values = self.values.par_chunks_mut(CHUNK);
        let chunks = values.zip(self.moments.par_chunks_mut(CHUNK)).enumerate();
        let sums = chunks.map(|(chunk, (values, moments))| {
            let mut sum = Sum::default();
            let rows = values.iter_mut().zip(moments);
            for (index, (row, moments)) in (chunk * CHUNK..).zip(rows) {
                let gradient = gradient(index, row, &mut sum);
                // A Gaussian that floats cannot describe any more stands still until pruned.
                if gradient.iter().all(|value| value.is_finite()) {
                    step(row, moments, &gradient, options, bounds, factor);
                }
            }
            sum
        });
        sums.collect()
    }

    /// Bytes held.
    pub(crate) fn memory(&self) -> usize {
        self.values.capacity() * size_of::<Row>() + self.moments.capacity() * size_of::<AdamState>()
    }
}

fn step(
    row: &mut Row,
    moments: &mut AdamState,
    gradient: &Row,
    options: &training::Optimizer,
    bounds: Domain,
    factor: f32,
) {
    let relative = options.units == training::Units::Relative;
    let frame = if relative {
        Frame::relative(bounds.parameterization, shape_of(row))
    } else {
        Frame::ABSOLUTE
    };
    let mut gradient = *gradient;
    let center = frame.center.transpose() * Vec2::from_slice(&gradient);
    let shape = frame.shape.transpose() * shape_of(&gradient);
    gradient[..2].copy_from_slice(&center.to_array());
    gradient[2..5].copy_from_slice(&shape.to_array());

    let (beta1, beta2) = (options.beta1, options.beta2);
    moments.age += 1;
    let age = moments.age.min(i32::MAX as u32) as i32;
    let rate = factor / (1.0 - beta1.powi(age));
    let unbias = 1.0 / (1.0 - beta2.powi(age));
    let mut steps = [0.0; MAX_COMPONENTS];
    // Absent channels as well, whose gradients are zero: a loop of constant length is vector code.
    for index in 0..MAX_COMPONENTS {
        let (mean, square) = (&mut moments.mean[index], &mut moments.square[index]);
        *mean = beta1 * *mean + (1.0 - beta1) * gradient[index];
        *square = beta2 * *square + (1.0 - beta2) * (gradient[index] * gradient[index]);
        let root = (*square * unbias).sqrt() + options.epsilon;
        // 0 / 0: a parameter that no pixel depends on.
        steps[index] = if root > 0.0 { *mean * rate / root } else { 0.0 };
    }
    let center = frame.center * Vec2::from_slice(&steps) * options.center;
    let shape = shape_of(row) - frame.shape * shape_of(&steps) * options.shape;
    row[0] -= center.x;
    row[1] -= center.y;
    row[2..5].copy_from_slice(&shape.to_array());
    for (value, step) in row[5..].iter_mut().zip(&steps[5..]) {
        *value -= options.color * step;
    }
    // The paper's covariance may leave the positive definite ones; it is pruned then.
    if relative || bounds.parameterization != Parameterization::Covariance {
        *row = bounds.confined(*row);
    } else {
        bounds.confine_rest(row);
    }
}
