//! Differences in all channels and on all scales, added up to one distance.

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::difference::{RADIUS, Sums, add, differences};
use super::light::Samples;
use super::norms::Measured;
use super::pyramid::{self, ROWS, Shown};
use crate::encode::rows::{Border, Group, Rows};

/// What SSIMULACRA2 multiplies the sum of its norms by.
const SCALE: f64 = 0.956_238_26;

/// What is known of a rendering on all scales.
#[derive(Debug)]
pub(super) struct Scales {
    measured: Vec<Measured>,
    /// One for all that is measured.
    comparisons: Vec<Comparison>,
}

/// What is known of a rendering in a channel and on a scale.
#[derive(Debug)]
struct Comparison {
    rows: Rows,
    /// How many rows were compared, and the sums over them.
    compared: usize,
    sums: Sums,
}

impl Scales {
    /// What SSIMULACRA2 measures of a picture of a size, unless it is too small.
    pub(super) fn of_metric(size: [usize; 2]) -> Option<Self> {
        Measured::by_metric(size).map(|measured| Self::new(size, Border::Zeros, measured))
    }

    /// The same of a small picture among its mirror images, as a part of a large one; `None` of a large
    /// one.
    pub(super) fn of_mirrored(size: [usize; 2]) -> Option<Self> {
        let scales = || Self::new(size, Border::Mirrored, Measured::of_large());
        (!Measured::is_large(size)).then(scales)
    }

    fn new(size: [usize; 2], border: Border, measured: Vec<Measured>) -> Self {
        let comparison = |found: &Measured| {
            let size = size.map(|side| side.div_ceil(1 << found.scale));
            let rows = Rows::new(size, border, ROWS >> found.scale);
            Comparison { rows, compared: 0, sums: Sums::default() }
        };
        Self { comparisons: measured.iter().map(comparison).collect(), measured }
    }

    /// Size in bytes of all that is held for strips of so many rows.
    pub(super) fn memory(&self, rows: usize) -> usize {
        let groups = rows.div_ceil(ROWS);
        self.comparisons.iter().map(|found| found.rows.memory(groups, 2 * RADIUS)).sum()
    }

    /// Takes in the next rows, from the row `first` on.
    pub(super) fn see<A: Samples, B: Samples>(
        &mut self,
        source: &Shown<'_, A>,
        rendering: &Shown<'_, B>,
        first: usize,
        rows: usize,
        level: Level,
    ) {
        let Self { measured, comparisons } = self;
        let blank: Vec<Vec<Group>> = (0..rows.div_ceil(ROWS))
            .map(|_| comparisons.iter_mut().map(|found| found.rows.blank()).collect())
            .collect();
        let filled = blank.into_par_iter().enumerate().map(|(index, mut groups)| {
            let y = first + index * ROWS;
            dispatch!(level, simd => {
                pyramid::fill(simd, source, y, 0, measured, &mut groups);
                pyramid::fill(simd, rendering, y, 1, measured, &mut groups);
            });
            groups
        });
        for groups in filled.collect::<Vec<_>>() {
            for (comparison, group) in comparisons.iter_mut().zip(groups) {
                comparison.rows.push(group);
            }
        }
        self.compare(level);
    }

    /// Compares all rows whose surroundings are known.
    fn compare(&mut self, level: Level) {
        let ready = |comparison: &Comparison| {
            let known = comparison.rows.known();
            let is_all = known == comparison.rows.height;
            if is_all { known } else { known.saturating_sub(RADIUS) }
        };
        let tasks: Vec<_> = (self.comparisons.iter().enumerate())
            .flat_map(|(index, found)| (found.compared..ready(found)).map(move |y| (index, y)))
            .collect();
        let comparisons = &self.comparisons;
        let compared = tasks.par_iter().map(
            |&(index, y)| dispatch!(level, simd => differences(simd, &comparisons[index].rows, y)),
        );
        // Added row by row, so that the sums depend neither on the threads nor on the strips.
        for (sums, (index, y)) in compared.collect::<Vec<_>>().into_iter().zip(tasks) {
            let comparison = &mut self.comparisons[index];
            add(&mut comparison.sums, sums);
            comparison.compared = y + 1;
            comparison.rows.forget((y + 1).saturating_sub(RADIUS));
        }
    }

    /// The weighted sum of norms, after the last rows.
    pub(super) fn distance(&self) -> f64 {
        let found = self.measured.iter().zip(&self.comparisons);
        let weighted = found.map(|(measured, Comparison { rows, sums, .. })| {
            measured.weighted(sums, (rows.width * rows.height) as f64)
        });
        SCALE * weighted.sum::<f64>()
    }
}
