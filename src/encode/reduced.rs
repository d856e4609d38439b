//! Smaller copies of a source.

use core::ops::Range;

use super::error::Result;
use super::progress::Observer;
use super::source::{Source, SourceSamples};

/// The averages of a source over squares of `side` pixels, interleaved. Colours count as they show: times alpha.
pub(crate) fn averages(
    source: &Source<'_>,
    side: usize,
    observer: &mut Observer<'_>,
) -> Result<Vec<u16>> {
    let ([width, height], channels) = (source.size(), source.color().channels());
    let rows = observer.map(0..height.div_ceil(side), |row| {
        let lines = row * side..(row * side + side).min(height);
        if source.is_premultiplied() {
            return averages_that_show(source, lines, side);
        }
        // By columns first, which is fast.
        let mut of_columns = vec![0_u64; width * channels];
        for y in lines.clone() {
            let samples = y * of_columns.len()..(y + 1) * of_columns.len();
            match source.samples() {
                SourceSamples::Eight(all) => add(&mut of_columns, &all[samples], 257),
                SourceSamples::Sixteen(all) => add(&mut of_columns, &all[samples], 1),
            }
        }
        let mut averages = Vec::with_capacity(width.div_ceil(side) * channels);
        for columns in of_columns.chunks(side * channels) {
            let weight = (columns.len() / channels * lines.len()) as u64;
            for channel in 0..channels {
                let sum = columns[channel..].iter().step_by(channels).sum();
                averages.push(rounded(sum, weight));
            }
        }
        averages
    })?;
    Ok(rows.concat())
}

/// Adds `scale` times each of some samples.
fn add<T: Copy + Into<u64>>(sums: &mut [u64], samples: &[T], scale: u64) {
    for (sum, &sample) in sums.iter_mut().zip(samples) {
        *sum += scale * sample.into();
    }
}

/// The averages of squares in the same rows, where colours count times alpha.
fn averages_that_show(source: &Source<'_>, lines: Range<usize>, side: usize) -> Vec<u16> {
    let ([width, _], channels) = (source.size(), source.color().channels());
    let mut averages = Vec::with_capacity(width.div_ceil(side) * channels);
    for left in (0..width).step_by(side) {
        let (mut sums, mut weights) = ([0; 4], [0; 4]);
        for y in lines.clone() {
            for x in left..(left + side).min(width) {
                let pixel = (y * width + x) * channels;
                let sample = |channel| u64::from(source.wide_sample(pixel + channel));
                for channel in 0..channels {
                    let weight = if channel + 1 < channels { sample(channels - 1) } else { 1 };
                    sums[channel] += weight * sample(channel);
                    weights[channel] += weight;
                }
            }
        }
        averages.extend((0..channels).map(|channel| rounded(sums[channel], weights[channel])));
    }
    averages
}

/// A sum of samples divided by that of their weights.
fn rounded(sum: u64, weight: u64) -> u16 {
    ((sum + weight / 2) / weight.max(1)) as u16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::ColorModel;
    use crate::encode::progress::unobserved;
    use crate::encode::testing::source;

    #[test]
    fn a_copy_has_the_averages_of_what_shows() {
        // Squares of 2 x 2, the last of which are cut off.
        let gray = source([3, 3], ColorModel::Gray, &[10, 20, 7, 30, 40, 9, 50, 70, 1]);
        let found = unobserved(|observer| averages(&gray, 2, observer));
        assert_eq!(found, [25, 8, 60, 1].map(|sample| sample * 257));
        let pixels = [[200, 50], [80, 150], [9, 0], [9, 0]];
        let seen = source([2, 2], ColorModel::GrayAlpha, pixels.as_flattened());
        let found = unobserved(|observer| averages(&seen, 2, observer));
        assert_eq!(found, [110 * 257, 50 * 257]);
        let all = seen.keeping_invisible(true);
        let found = unobserved(|observer| averages(&all, 2, observer));
        assert_eq!(found, [19_147, 50 * 257]);
    }
}
