//! How much texture there shall be at each node of the map: what the source has, the rendering has not, and
//! the eye misses.

use core::array;

use super::bands::Content;
use super::cells::Cells;
use crate::encode::error::Result;
use crate::encode::progress::Observer;
use crate::encode::rows::mirrored;
use crate::texture::OCTAVES;

/// The weights of the two rows, or columns, of cells on each side of a node, from the outer one on: a window
/// of about 7 pixels of deviation.
const AROUND: [f32; 4] = [0.125, 0.375, 0.375, 0.125];
/// Those of a node and its neighbours, which smooth what was found.
const SMOOTHING: [f32; 3] = [0.25, 0.5, 0.25];
/// The mean magnitude of a normal distribution of deviation 1.
const MEAN_MAGNITUDE: f32 = 0.797_884_6;
/// The variance of each band (rows), from the finest, in the isotropic pattern of each octave (columns), as it is
/// found.
const RESPONSES: [[f32; OCTAVES]; OCTAVES] = [[0.943, 0.274], [0.015, 0.147]];
/// The direction of streaks alone.
const MOST_DIRECTION: f32 = 1.375;
/// A variance that is nothing, as of a difference of quantization steps of 16 bits.
const NOTHING: f32 = 1e-9;

// Constants: docs/tuning.md, "Texture".
/// The amplitude of each octave, from the finest, as a multiple of what was found, at strength 50.
const SHARES: [f32; OCTAVES] = [1.65, 1.25];
/// The most energy of a band that is added, as a multiple of what is missing: of grains such as those of film, which
/// have no structure at all, there shall be about as many as there are.
const MOST_ENERGY: f32 = 1.15;
/// The share of repeated pixels from which on a picture is drawn or dithered, and has no texture; up to half of it,
/// what is there is random.
const MOST_REPEATED: f32 = 0.5;
/// The direction for an excess of one slope over the other, as a share of both.
const DIRECTION: f32 = 1.5;
/// A variance of slopes that has no direction.
const LEAST_SLOPE: f32 = 1e-7;

/// What is wanted at the nodes of a map: amplitudes in samples, and the direction, which is positive for horizontal
/// streaks. Of the latter, a decoder takes a little less.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Strength {
    pub(super) amplitudes: [f32; OCTAVES],
    pub(super) direction: f32,
}

impl Strength {
    #[inline(always)]
    fn add(&mut self, weight: f32, other: &Self) {
        for octave in 0..OCTAVES {
            self.amplitudes[octave] += weight * other.amplitudes[octave];
        }
        self.direction += weight * other.direction;
    }
}

/// The strengths at all nodes, row by row: one column and one row more than there are cells.
pub(super) fn strengths(
    cells: &Cells,
    factor: f32,
    observer: &mut Observer<'_>,
) -> Result<Vec<Strength>> {
    let columns = cells.columns + 1;
    let rows = observer.map(0..cells.rows + 1, |row| found_in_row(cells, row))?;
    let smoothed = observer.map(0..rows.len(), |row| {
        let mut line = vec![Strength::default(); columns];
        for (tap, weight) in SMOOTHING.into_iter().enumerate() {
            let near = &rows[mirrored(row as isize + tap as isize - 1, rows.len())];
            line.iter_mut().zip(near).for_each(|(sum, other)| sum.add(weight, other));
        }
        let smoothed = rows[row].iter().enumerate().map(|(column, found)| {
            let mut sum = Strength::default();
            for (tap, weight) in SMOOTHING.into_iter().enumerate() {
                sum.add(weight, &line[mirrored(column as isize + tap as isize - 1, columns)]);
            }
            // Texture must not run into what is smooth.
            let least = |octave: usize| sum.amplitudes[octave].min(found.amplitudes[octave]);
            let amplitudes = array::from_fn(|octave| least(octave) * SHARES[octave] * factor);
            Strength { amplitudes, ..sum }
        });
        smoothed.collect::<Vec<_>>()
    })?;
    Ok(smoothed.concat())
}

/// What was found at a row of nodes, before it is smoothed.
fn found_in_row(cells: &Cells, row: usize) -> Vec<Strength> {
    // The cells beyond an edge are those before it.
    let within = |at: isize, length: usize| {
        let (at, last) = (if at < 0 { -1 - at } else { at }, length as isize - 1);
        (if at > last { 2 * last + 1 - at } else { at }).clamp(0, last) as usize
    };
    let blend = |sums: &mut [Content; 2], weight, around: &[Content; 2]| {
        sums.iter_mut().zip(around).for_each(|(sum, content)| sum.add(weight, content));
    };
    let mut line = vec![[Content::default(); 2]; cells.columns];
    for (tap, weight) in AROUND.into_iter().enumerate() {
        let row = within((row + tap) as isize - 2, cells.rows);
        let near = &cells.content[row * cells.columns..][..cells.columns];
        for (sums, [source, rendering]) in line.iter_mut().zip(near) {
            blend(sums, weight, &[source.inverted(), *rendering]);
        }
    }
    let at_node = |column: usize| {
        let mut around = [Content::default(); 2];
        for (tap, weight) in AROUND.into_iter().enumerate() {
            let column = within((column + tap) as isize - 2, cells.columns);
            blend(&mut around, weight, &line[column]);
        }
        found(around[0].inverted(), around[1])
    };
    (0..=cells.columns).map(at_node).collect()
}

/// What was found around a node, given the content of the source and of the rendering.
fn found(source: Content, rendering: Content) -> Strength {
    let variance = |root: f32| (root * root / MEAN_MAGNITUDE).powi(2);
    // Up to a deviation of a level of 255, noise has as many equal pixels as what is drawn; it does not show.
    let random = ((MOST_REPEATED - source.repeated) / (0.5 * MOST_REPEATED)).clamp(0.0, 1.0);
    let missing: [f32; OCTAVES] = array::from_fn(|octave| {
        let there = variance(source.magnitudes[octave]);
        let missing = (there - variance(rendering.magnitudes[octave])).max(0.0);
        // Where edges are, the robust variance is less than the variance: structure is no texture.
        let texture = (there / (source.energies[octave] + NOTHING)).min(1.0).sqrt() * random;
        // What the rendering has for the greater part, it has at the right places.
        let share = missing / (there + NOTHING);
        let all = (source.energies[octave] - rendering.energies[octave]).max(0.0);
        (missing * texture * share * share).min(MOST_ENERGY * all / SHARES[octave].powi(2))
    });
    let amplitudes = solved(missing).map(f32::sqrt);
    let [columns, rows] = [0, 1].map(|axis| {
        let missing = variance(source.slopes[axis]) - variance(rendering.slopes[axis]);
        missing.max(0.0) + LEAST_SLOPE
    });
    let excess = (rows - columns) / (rows + columns);
    let direction = (DIRECTION * excess).clamp(-MOST_DIRECTION, MOST_DIRECTION);
    Strength { amplitudes, direction }
}

/// The variances of isotropic patterns, none of them negative, that come nearest to variances of bands: of
/// those solutions in which some of the patterns are left out, the best one that has no negative variance.
fn solved(bands: [f32; OCTAVES]) -> [f32; OCTAVES] {
    let product = |a: usize, b: [f32; OCTAVES]| -> f32 {
        (0..OCTAVES).map(|band| RESPONSES[band][a] * b[band]).sum()
    };
    let mut best = ([0.0; OCTAVES], 0.0);
    for used in 1..1 << OCTAVES {
        let is_used = |octave: usize| used >> octave & 1 == 1;
        let normal: [[f32; OCTAVES]; OCTAVES] = array::from_fn(|a| {
            array::from_fn(|b| match is_used(a) && is_used(b) {
                true => product(a, RESPONSES.map(|responses| responses[b])),
                false => f32::from(u8::from(a == b)),
            })
        });
        let wanted: [f32; OCTAVES] =
            array::from_fn(|octave| if is_used(octave) { product(octave, bands) } else { 0.0 });
        let solution = quotient(normal, wanted);
        // By so much the squared error is lower than that of no pattern.
        let gain: f32 =
            solution.iter().zip(wanted).map(|(variance, wanted)| variance * wanted).sum();
        if gain > best.1 && solution.iter().all(|&variance| variance >= 0.0) {
            best = (solution, gain);
        }
    }
    best.0
}

/// The solution of two linear equations, by Cramer's rule.
fn quotient(matrix: [[f32; OCTAVES]; OCTAVES], values: [f32; OCTAVES]) -> [f32; OCTAVES] {
    let determinant = |[a, b]: [[f32; OCTAVES]; OCTAVES]| a[0] * b[1] - a[1] * b[0];
    let whole = determinant(matrix);
    array::from_fn(|octave| {
        let mut replaced = matrix;
        for (row, value) in replaced.iter_mut().zip(values) {
            row[octave] = value;
        }
        determinant(replaced) / whole
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coding::entropy::CenterGrid;
    use crate::color::ColorModel;
    use crate::container::Metadata;
    use crate::encode::file::FileLayout;
    use crate::encode::progress::unobserved;
    use crate::encode::rate_model;
    use crate::encode::source::Source;
    use crate::gaussian::{Gaussian, Parameterization};
    use crate::kernel::Kernel;
    use crate::limits::Limits;
    use crate::render::{Picture, RenderOptions};
    use crate::texture::{Texture, amplitude_sum};

    /// Two bands of cells: on the left content `a`, and content `b` on the right.
    fn halves(a: [Content; 2], b: [Content; 2]) -> Vec<Strength> {
        let (columns, rows) = (12, 6);
        let content = (0..columns * rows).map(|at| if at % columns < 6 { a } else { b }).collect();
        let cells = Cells { columns, rows, content };
        let found = unobserved(|observer| strengths(&cells, 1.0, observer));
        assert_eq!(found.len(), 13 * 7);
        found
    }

    /// Normal noise of these deviations in each band.
    fn noise(deviations: [f32; OCTAVES]) -> Content {
        let root = |deviation: f32| (deviation * MEAN_MAGNITUDE).sqrt();
        Content {
            magnitudes: deviations.map(root),
            slopes: [root(deviations[0]); 2],
            energies: deviations.map(|deviation| deviation * deviation),
            repeated: 0.0,
        }
    }

    /// The same with as much structure that its energy is four times that of the noise.
    fn grains(deviations: [f32; OCTAVES]) -> Content {
        let noise = noise(deviations);
        Content { energies: noise.energies.map(|energy| 4.0 * energy), ..noise }
    }

    #[test]
    fn what_is_missing_is_found_and_what_is_smooth_stays_so() {
        for octave in 0..OCTAVES {
            let deviations = RESPONSES.map(|responses| 0.1 * responses[octave].sqrt());
            let found = halves([grains(deviations), noise([0.0; 2])], [noise([0.0; 2]); 2]);
            for row in found.chunks_exact(13) {
                for (column, strength) in row.iter().enumerate() {
                    for (other, amplitude) in strength.amplitudes.into_iter().enumerate() {
                        let expected = if other == octave { 0.071 * SHARES[octave] } else { 0.0 };
                        match column {
                            0..4 => assert!((amplitude - expected).abs() < 0.01, "{strength:?}"),
                            8.. => assert!(amplitude < 1e-4, "{strength:?}"),
                            // Halfway the more is missing the nearer to where it is.
                            _ => assert!(amplitude < expected + 0.01, "{strength:?}"),
                        }
                    }
                    assert!(strength.direction.abs() < 1e-3);
                }
            }
        }
    }

    const SIDE: usize = 512;

    fn source(samples: &[u16]) -> Source<'_> {
        let source = Source::new_u16(SIDE as u32, SIDE as u32, ColorModel::Gray, samples);
        source.expect("the sizes agree")
    }

    #[test]
    fn patterns_have_the_responses_that_are_stated() {
        let amplitude = 0.1;
        let blank = vec![0; SIDE * SIDE];
        let (metadata, limits) = (Metadata::default(), Limits::none());
        let (kernel, parameterization) = (Kernel::Quartic, Parameterization::Cholesky);
        let layout =
            FileLayout::new(&source(&blank), [0.5; 4], kernel, parameterization, &metadata);
        let gray = Picture::new(layout.header(), &[], &limits, 0);
        for octave in 0..OCTAVES {
            // Gray with a texture of one octave everywhere.
            let mut color = [0.0; 4];
            color[octave] = amplitude_sum(amplitude);
            let gaussian = Gaussian { center: [32.0; 2], cholesky: [2000.0, 0.0, 2000.0], color };
            let quantization = rate_model::quantization(0.01_f64.log2(), &[1.0; 3]);
            let grid = CenterGrid::new(65, 65);
            let mut codes = [quantization.code(&gaussian, 7, &grid, ColorModel::Rgb)];
            let payload = Texture::to_payload(&mut codes, quantization.color[0], layout.header());
            let texture =
                Texture::parse(&payload, layout.header(), |_| Ok(())).expect("it was just written");
            let mut samples = vec![0; SIDE * SIDE];
            let textured =
                Picture::new(layout.header(), &[], &limits, 0).with_texture(Some(&texture));
            textured.render_u16(&RenderOptions::new(), &mut samples).expect("no limits");

            let cells = unobserved(|observer| Cells::new(&source(&samples), &gray, observer));
            for (band, responses) in RESPONSES.iter().enumerate() {
                let roots = cells.content.iter().map(|[source, _]| source.magnitudes[band]);
                let root = roots.sum::<f32>() / cells.content.len() as f32;
                let found = (root * root / MEAN_MAGNITUDE / amplitude).powi(2);
                let stated = responses[octave];
                assert!((found - stated).abs() < 0.01, "{band}, {octave}: {found}, {stated}");
            }
        }
    }

    #[test]
    fn a_rendering_that_has_the_texture_or_more_gets_none() {
        let [less, more] = [grains([0.05, 0.03]), grains([0.08, 0.05])];
        for strength in halves([less, less], [less, more]) {
            assert!(strength.amplitudes.iter().all(|&amplitude| amplitude < 1e-4));
        }
        // Half of it is there, and less than half of the amplitude is added.
        let half = grains([0.05 * 0.707, 0.03 * 0.707]);
        let [all, some] = [noise([0.0; 2]), half]
            .map(|there| halves([less, there], [less, there])[20].amplitudes);
        assert!(some[0] > 0.1 * all[0] && some[0] < 0.5 * all[0], "{some:?}, {all:?}");
    }

    #[test]
    fn lone_edges_count_less_than_noise_of_the_same_energy() {
        let noisy = noise([0.1, 0.05]);
        let edges = Content { magnitudes: noisy.magnitudes.map(|root| 0.6 * root), ..noisy };
        let nothing = noise([0.0; 2]);
        let found = halves([noisy, nothing], [edges, nothing]);
        let (of_noise, of_edges) = (found[0].amplitudes[0], found[12].amplitudes[0]);
        assert!(of_edges < 0.7 * of_noise, "{of_edges}, {of_noise}");
    }

    #[test]
    fn what_is_drawn_or_dithered_gets_none() {
        let repeated = |repeated: f32| Content { repeated, ..grains([0.05, 0.03]) };
        let nothing = noise([0.0; 2]);
        let amplitudes =
            |share| halves([repeated(share), nothing], [repeated(share), nothing])[20].amplitudes;
        assert_eq!(amplitudes(0.2), amplitudes(0.0));
        assert_eq!(amplitudes(0.5), [0.0; 2]);
        assert!(amplitudes(0.4)[0] < 0.7 * amplitudes(0.0)[0]);
    }

    #[test]
    fn streaks_have_a_direction() {
        let steep = |slopes: [f32; 2]| Content { slopes, ..noise([0.1, 0.05]) };
        let nothing = noise([0.0; 2]);
        let found = halves([steep([0.1, 0.3]), nothing], [steep([0.3, 0.1]), nothing]);
        // What changes across rows is horizontal.
        assert!(found[0].direction > 1.0 && found[12].direction < -1.0, "{found:?}");
    }

    #[test]
    fn variances_are_the_best_that_are_not_negative() {
        let mut rng = fastrand::Rng::with_seed(5);
        let error = |solution: [f32; OCTAVES], bands: [f32; OCTAVES]| -> f32 {
            let sum = |band: usize| -> f32 {
                (0..OCTAVES).map(|octave| RESPONSES[band][octave] * solution[octave]).sum()
            };
            (0..OCTAVES).map(|band| (sum(band) - bands[band]).powi(2)).sum()
        };
        for _ in 0..200 {
            let bands = [(); OCTAVES].map(|()| rng.f32() * rng.f32());
            let best = solved(bands);
            assert!(best.iter().all(|&variance| variance >= 0.0));
            for octave in 0..OCTAVES {
                for change in [-0.02, 0.02] {
                    let mut other = best;
                    other[octave] = (other[octave] + change).max(0.0);
                    assert!(
                        error(best, bands) <= error(other, bands) + 1e-5,
                        "{bands:?}: {best:?}"
                    );
                }
            }
        }
    }
}
