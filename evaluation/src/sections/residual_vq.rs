//! Residual vector quantization (RVQ) of colours, trained as in GaussianImage: code books start
//! from k-means and follow the colours as moving averages, and a commitment loss pulls each colour
//! to its entries.

use std::sync::Arc;

use image_gip::training::VectorQuantizer;

use crate::gip;

/// Code books, of which each stores what those before it leave, and entries of each:
/// GaussianImage's, as all constants here.
const STAGES: usize = 2;
const ENTRIES: usize = 8;
/// Iterations of k-means.
const KMEANS: u32 = 5;
/// The share of a moving average that one iteration of training keeps.
const DECAY: f32 = 0.8;
/// The weight of the commitment loss: the mean squared distance of a channel to the stored one, in
/// each stage, beside the mean squared error of a sample.
const COMMITMENT: f32 = 1.0;
/// Added to the number of colours of an entry, so that there is a mean of none (Laplace smoothing).
const SMOOTHING: f32 = 1e-5;

/// Bits of a colour: indices of fixed length, as the paper counts them.
pub(super) const BITS: f64 = STAGES as f64 * ENTRIES.ilog2() as f64;
/// Bytes of the code books, as 32-bit floats.
pub(super) const CODE_BOOK_BYTES: f64 = (STAGES * ENTRIES * size_of::<Color>()) as f64;

type Color = [f32; 3];

/// The quantizer of colours at one iteration of training.
#[derive(Clone, Debug)]
pub(super) struct ResidualVq {
    /// Of the picture, in all and for each Gaussian.
    pixels: f32,
    pixels_per_gaussian: f32,
    /// One for each stage; none before training.
    code_books: Vec<CodeBook>,
}

impl ResidualVq {
    /// For a picture of so many pixels.
    pub(super) fn new(pixels: f64) -> Self {
        Self { pixels: pixels as f32, pixels_per_gaussian: 0.0, code_books: Vec::new() }
    }

    /// This quantizer an iteration later, or at the first one.
    fn following(&self, trained: &[&[f32]]) -> Self {
        let mut rest: Vec<Color> = trained.iter().map(|color| to_color(color)).collect();
        let mut rng = fastrand::Rng::with_seed(gip::SEED);
        let code_books = (0..STAGES).map(|stage| {
            let known = self.code_books.get(stage);
            let code_book = known.cloned().unwrap_or_else(|| CodeBook::kmeans(&rest, &mut rng));
            let next = code_book.following(&rest);
            for color in &mut rest {
                *color = difference(color, &code_book.entries[code_book.nearest(color)]);
            }
            next
        });
        Self {
            pixels: self.pixels,
            code_books: code_books.collect(),
            pixels_per_gaussian: self.pixels / trained.len() as f32,
        }
    }

    /// The nearest entry of each stage, with what it leaves of the colour.
    fn stages(&self, color: &[f32]) -> impl Iterator<Item = (Color, Color)> {
        let mut rest = to_color(color);
        self.code_books.iter().map(move |code_book| {
            let entry = code_book.entries[code_book.nearest(&rest)];
            rest = difference(&rest, &entry);
            (entry, rest)
        })
    }
}

impl VectorQuantizer for ResidualVq {
    fn adapted(&self, trained: &[&[f32]]) -> Arc<dyn VectorQuantizer> {
        Arc::new(self.following(trained))
    }

    fn quantize(&self, values: &mut [f32]) {
        let mut sum = Color::default();
        for (entry, _) in self.stages(values) {
            sum.iter_mut().zip(entry).for_each(|(sum, part)| *sum += part);
        }
        values.copy_from_slice(&sum);
    }

    fn add_gradient(&self, trained: &[f32], gradient: &mut [f32]) {
        // Means over samples and over channels of Gaussians, as sums over samples.
        let weight = COMMITMENT * self.pixels_per_gaussian;
        for (_, rest) in self.stages(trained) {
            gradient.iter_mut().zip(rest).for_each(|(sum, part)| *sum += weight * part);
        }
    }
}

/// The code book of one stage, whose entries are the means of the colours assigned to them.
#[derive(Clone, Debug)]
struct CodeBook {
    entries: [Color; ENTRIES],
    /// Sum and number of the colours assigned to each entry.
    sums: [Color; ENTRIES],
    counts: [f32; ENTRIES],
}

impl CodeBook {
    /// Clusters of colours, from some of the colours as first entries.
    fn kmeans(colors: &[Color], rng: &mut fastrand::Rng) -> Self {
        let mut entries = [Color::default(); ENTRIES];
        let chosen = rng.choose_multiple(colors, ENTRIES);
        for (entry, color) in entries.iter_mut().zip(chosen.into_iter().cycle()) {
            *entry = *color;
        }
        let mut code_book =
            Self { entries, sums: [Color::default(); ENTRIES], counts: [0.0; ENTRIES] };
        for _ in 0..KMEANS {
            (code_book.sums, code_book.counts) = code_book.assigned(colors);
            let means = code_book.sums.iter().zip(&code_book.counts);
            for (entry, (sum, &count)) in code_book.entries.iter_mut().zip(means) {
                if count > 0.0 {
                    *entry = sum.map(|sum| sum / count);
                }
            }
        }
        code_book
    }

    /// This code book an iteration later.
    fn following(&self, colors: &[Color]) -> Self {
        let (sums, counts) = self.assigned(colors);
        let mut next = self.clone();
        let average = |old: &mut f32, new: f32| *old = DECAY * *old + (1.0 - DECAY) * new;
        next.counts.iter_mut().zip(counts).for_each(|(old, new)| average(old, new));
        next.sums.iter_mut().flatten().zip(sums.as_flattened()).for_each(|(old, &new)| {
            average(old, new);
        });
        for (entry, (sum, count)) in next.entries.iter_mut().zip(next.sums.iter().zip(next.counts))
        {
            *entry = sum.map(|sum| sum / (count + SMOOTHING));
        }
        next
    }

    /// Sum and number of the colours nearest to each entry.
    fn assigned(&self, colors: &[Color]) -> ([Color; ENTRIES], [f32; ENTRIES]) {
        let (mut sums, mut counts) = ([Color::default(); ENTRIES], [0.0; ENTRIES]);
        for color in colors {
            let nearest = self.nearest(color);
            sums[nearest].iter_mut().zip(color).for_each(|(sum, part)| *sum += part);
            counts[nearest] += 1.0;
        }
        (sums, counts)
    }

    /// The index of the entry nearest to a colour.
    fn nearest(&self, color: &Color) -> usize {
        let distance = |index: &usize| -> f32 {
            difference(color, &self.entries[*index]).iter().map(|part| part * part).sum()
        };
        (0..ENTRIES).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
    }
}

fn to_color(values: &[f32]) -> Color {
    [values[0], values[1], values[2]]
}

fn difference(a: &Color, b: &Color) -> Color {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[cfg(test)]
mod tests {
    use super::*;

    const PIXELS: f64 = 1e4;

    fn mean_error(quantizer: &dyn VectorQuantizer, colors: &[&[f32]]) -> f32 {
        let errors = colors.iter().map(|color| {
            let mut stored = color.to_vec();
            quantizer.quantize(&mut stored);
            let parts = color.iter().zip(stored).map(|(value, stored)| (value - stored).powi(2));
            parts.sum::<f32>()
        });
        errors.sum::<f32>() / colors.len() as f32
    }

    fn random(count: usize, seed: u64) -> Vec<Color> {
        let mut rng = fastrand::Rng::with_seed(seed);
        (0..count).map(|_| core::array::from_fn(|_| rng.f32() - 0.5)).collect()
    }

    fn slices(colors: &[Color]) -> Vec<&[f32]> {
        colors.iter().map(|color| &color[..]).collect()
    }

    #[test]
    fn the_code_books_hold_64_colours() {
        let colors = random(2000, 1);
        let colors = slices(&colors);
        let quantizer = ResidualVq::new(PIXELS).adapted(&colors);
        let mut stored: Vec<[u32; 3]> = (colors.iter())
            .map(|color| {
                let mut color = to_color(color);
                quantizer.quantize(&mut color);
                color.map(f32::to_bits)
            })
            .collect();
        stored.sort_unstable();
        stored.dedup();
        assert!((48..=64).contains(&stored.len()), "{}", stored.len());
        assert_eq!((BITS, CODE_BOOK_BYTES), (6.0, 192.0));
        // One of 4 steps per channel leaves 3 / 12 / 4^2, a code book of 8 entries 3 / 12 / 2^2.
        let error = mean_error(&*quantizer, &colors);
        assert!((0.015..0.03).contains(&error), "{error}");
    }

    #[test]
    fn code_books_follow_the_colours() {
        let (before, after) = (random(500, 1), random(500, 2));
        let after: Vec<Color> = after.iter().map(|color| color.map(|x| 0.5 * x + 3.0)).collect();
        let after = slices(&after);
        let mut quantizer = ResidualVq::new(PIXELS).adapted(&slices(&before));
        assert!(mean_error(&*quantizer, &after) > 10.0);
        for _ in 0..40 {
            quantizer = quantizer.adapted(&after);
        }
        let error = mean_error(&*quantizer, &after);
        assert!(error < 0.03, "{error}");
    }

    #[test]
    fn few_equal_or_no_colours_are_stored_exactly() {
        for colors in [vec![], vec![[0.25, -0.5, 1.0]], vec![[0.25, -0.5, 1.0]; 3]] {
            let mut quantizer = ResidualVq::new(PIXELS).adapted(&slices(&colors));
            for _ in 0..3 {
                quantizer = quantizer.adapted(&slices(&colors));
            }
            let mut stored = [0.25, -0.5, 1.0];
            quantizer.quantize(&mut stored);
            assert!(stored.iter().all(|value| value.is_finite()));
            assert!(colors.is_empty() || mean_error(&*quantizer, &slices(&colors)) < 1e-8);
        }
    }

    #[test]
    fn the_gradient_is_that_of_the_commitment_loss() {
        let colors = random(300, 3);
        let quantizer = ResidualVq::new(PIXELS).following(&slices(&colors));
        // Half the sum of squared errors is 3 x pixels / 2 times their mean, and the loss of one
        // colour is divided by 3 x Gaussians.
        let loss = |color: &Color| -> f32 {
            let rests = quantizer.stages(color).flat_map(|(_, rest)| rest);
            PIXELS as f32 / 2.0 / 300.0 * rests.map(|part| part * part).sum::<f32>()
        };
        let color = colors[0];
        let mut gradient = [1.0; 3];
        quantizer.add_gradient(&color, &mut gradient);
        for channel in 0..3 {
            let moved = |by: f32| {
                let mut color = color;
                color[channel] += by;
                loss(&color)
            };
            let difference = (moved(1e-3) - moved(-1e-3)) / 2e-3;
            assert!((gradient[channel] - 1.0 - difference).abs() < 1e-2, "{gradient:?}");
        }
    }
}
