//! The order in which Gaussians are optimized: in rounds, and in each by bands of the picture, which
//! are independent of each other.
//!
//! Large windows come first: they overlap many others. A band is at least twice as high as the windows
//! that are assigned to it. A window that crosses the border of two bands lies inside one band of a
//! second division, which is shifted by half the height of a band.

use core::cmp::Reverse;
use core::ops::Range;

use rayon::prelude::*;

// Constants: docs/tuning.md, "Not measured".
/// The least height of a band in rows, unless the picture is lower.
const LEAST_HEIGHT: usize = 32;

/// Nanoseconds of work for a pixel of a window, and for a window.
const WORK_OF_PIXEL: f64 = 0.7;
const WORK_OF_WINDOW: f64 = 2000.0;
/// The work of a band in a round, so that the caller is asked often enough whether to go on. The clock does not
/// decide that: what Gaussians change beyond their band is drawn after the round, so files depend on it.
const MOST_WORK: f64 = 4e6;

/// The height of the bands for windows of so many rows, in a picture of so many. Their number is a
/// power of two, so that threads have about the same to do.
fn band_height(rows: usize, of_picture: usize) -> usize {
    let most = of_picture / rows.max(LEAST_HEIGHT / 2) / 2;
    of_picture.div_ceil(1 << most.checked_ilog2().unwrap_or(0))
}

/// A Gaussian with its place in the order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Entry {
    /// The height of its band.
    height: Reverse<u32>,
    is_shifted: bool,
    /// The index of its band.
    band: u32,
    area_class: Reverse<u32>,
    /// Which of the Gaussians it is.
    pub(super) index: u32,
}

impl Entry {
    /// The place of Gaussian number `index`, which has a window with these columns and rows in a picture
    /// of a height.
    pub(super) fn new(index: usize, [columns, rows]: [Range<usize>; 2], of_picture: usize) -> Self {
        let height = band_height(rows.len(), of_picture);
        let last = rows.end - 1;
        Self {
            height: Reverse(height as u32),
            is_shifted: rows.start / height != last / height,
            // A shifted band has the number of the unshifted one that begins in its middle.
            band: (last / height) as u32,
            area_class: Reverse((columns.len() * rows.len()).ilog2()),
            index: index as u32,
        }
    }

    /// About how many nanoseconds it takes.
    fn work(&self) -> f64 {
        WORK_OF_PIXEL * f64::from(self.area_class.0).exp2() + WORK_OF_WINDOW
    }
}

/// Gaussians that are optimized at a time: those of some bands, which are independent of each other.
#[derive(Debug, PartialEq)]
pub(super) struct Round<'a> {
    /// The heights of the first band of the picture and of the others.
    pub(super) heights: [usize; 2],
    /// The bands that have some, in order.
    pub(super) bands: Vec<BandEntries<'a>>,
}

/// The Gaussians of a band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BandEntries<'a> {
    /// The number of the band.
    pub(super) band: usize,
    pub(super) entries: &'a [Entry],
    /// About how many nanoseconds they take.
    pub(super) work: f64,
}

impl<'a> Round<'a> {
    /// All rounds, one after the other. Sorts the entries.
    pub(super) fn all(entries: &'a mut [Entry]) -> Vec<Self> {
        entries.par_sort_unstable();
        let phase = |entry: &Entry| (entry.height, entry.is_shifted);
        let mut rounds = Vec::new();
        for of_phase in entries.chunk_by(|a, b| phase(a) == phase(b)) {
            let mut rest: Vec<_> = of_phase.chunk_by(|a, b| a.band == b.band).collect();
            while !rest.is_empty() {
                rounds.push(Self::first_of(&mut rest));
            }
        }
        rounds
    }

    /// A round with the first Gaussians of each band, which are taken from `rest`.
    fn first_of(rest: &mut Vec<&'a [Entry]>) -> Self {
        let Entry { height: Reverse(height), is_shifted, .. } = rest[0][0];
        let height = height as usize;
        let mut bands = Vec::with_capacity(rest.len());
        for entries in &mut *rest {
            let mut work = 0.0;
            let is_enough = |entry: &Entry| {
                work += entry.work();
                work >= MOST_WORK
            };
            let count = entries.iter().position(is_enough).map_or(entries.len(), |last| last + 1);
            let (first, others) = entries.split_at(count);
            bands.push(BandEntries { band: first[0].band as usize, entries: first, work });
            *entries = others;
        }
        rest.retain(|entries| !entries.is_empty());
        Self { heights: [if is_shifted { height / 2 } else { height }, height], bands }
    }

    /// About how many nanoseconds it takes one thread.
    pub(super) fn work(&self) -> f64 {
        self.bands.iter().map(|of_band| of_band.work).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rows of a band.
    fn rows(round: &Round<'_>, band: usize, of_picture: usize) -> Range<usize> {
        let [first, height] = round.heights;
        let start = |band: usize| if band == 0 { 0 } else { first + (band - 1) * height };
        start(band)..start(band + 1).min(of_picture)
    }

    #[test]
    fn every_window_is_once_inside_of_its_band() {
        let mut random = fastrand::Rng::with_seed(4);
        for of_picture in [1, 7, 31, 32, 33, 64, 100, 512, 1357] {
            let mut windows = Vec::new();
            for _ in 0..400 {
                let length = random.usize(1..=of_picture).min(random.usize(1..200));
                let start = random.usize(..=of_picture - length);
                windows.push([0..random.usize(1..3000), start..start + length]);
            }
            let entries = windows.iter().enumerate();
            let entries = entries.map(|(at, window)| Entry::new(at, window.clone(), of_picture));
            let mut entries: Vec<Entry> = entries.collect();
            let mut found = vec![0; windows.len()];
            for round in Round::all(&mut entries) {
                assert!(round.bands.is_sorted_by(|a, b| a.band < b.band));
                for &BandEntries { band, entries: of_band, .. } in &round.bands {
                    let rows = rows(&round, band, of_picture);
                    let work: f64 = of_band[1..].iter().map(Entry::work).sum();
                    assert!(work < MOST_WORK);
                    for entry in of_band {
                        let window = &windows[entry.index as usize][1];
                        assert!(
                            rows.start <= window.start && window.end <= rows.end,
                            "{window:?} of {of_picture} is not in {rows:?}"
                        );
                        found[entry.index as usize] += 1;
                    }
                }
            }
            assert!(found.iter().all(|&times| times == 1), "{of_picture}: {found:?}");
        }
    }

    #[test]
    fn large_windows_come_first() {
        let windows = [10, 900, 40, 300, 10].map(|rows| [0..50, 0..rows]);
        let entries = windows.iter().enumerate();
        let mut entries: Vec<Entry> =
            entries.map(|(at, window)| Entry::new(at, window.clone(), 1000)).collect();
        let rounds = Round::all(&mut entries);
        let order: Vec<u32> = rounds
            .iter()
            .flat_map(|round| round.bands.iter().flat_map(|of_band| of_band.entries))
            .map(|entry| entry.index)
            .collect();
        assert_eq!(order, [1, 3, 2, 0, 4]);
    }
}
