//! Smaller copies of a source.

use super::error::Result;
use super::progress::Observer;
use super::source::Source;

/// The averages of a source over squares of `side` pixels, interleaved. Colours count as they show: times alpha.
pub(crate) fn averages(
    source: &Source<'_>,
    side: usize,
    observer: &mut Observer<'_>,
) -> Result<Vec<u16>> {
    let ([width, height], channels) = (source.size(), source.color().channels());
    let rows = observer.map(0..height.div_ceil(side), |row| {
        let mut averages = Vec::with_capacity(width.div_ceil(side) * channels);
        for left in (0..width).step_by(side) {
            let (mut sums, mut weights) = ([0; 4], [0; 4]);
            for y in row * side..(row * side + side).min(height) {
                for x in left..(left + side).min(width) {
                    let pixel = (y * width + x) * channels;
                    let sample = |channel| u64::from(source.wide_sample(pixel + channel));
                    for channel in 0..channels {
                        let is_seen_through = source.is_premultiplied() && channel + 1 < channels;
                        let weight = if is_seen_through { sample(channels - 1) } else { 1 };
                        sums[channel] += weight * sample(channel);
                        weights[channel] += weight;
                    }
                }
            }
            let average = |(sum, weight): (u64, u64)| ((sum + weight / 2) / weight.max(1)) as u16;
            averages.extend(sums.into_iter().zip(weights).take(channels).map(average));
        }
        averages
    })?;
    Ok(rows.concat())
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
