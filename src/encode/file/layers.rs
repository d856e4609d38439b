//! Gaussians divided into the layers of a file, as `layers::plan` plans them, and coded.

use rayon::prelude::*;

use crate::chunk::ChunkType;
use crate::coding::entropy::{Code, EncodedLayer, LayerCoder};
use crate::coding::layer_count::LayerCount;
use crate::coding::packed::{self, Quantizer};
use crate::container::Header;
use crate::encode::error::Result;
use crate::encode::progress::Observer;
use crate::gaussian::MAX_COMPONENTS;
use crate::layers::bounds::LayerBounds;
use crate::layers::plan;

/// The layers of a packed file, from codes in the order of the file: the numbers of their Gaussians, and their bytes.
pub(super) fn write_packed_layers(
    codes: &[[u32; MAX_COMPONENTS]],
    quantizers: &[Quantizer],
) -> Vec<(usize, Vec<u8>)> {
    let mut rest = codes;
    let layer = |count| {
        let (layer, later) = rest.split_at(count);
        rest = later;
        (count, packed::write_layer(layer, quantizers))
    };
    plan::packed_layers(codes.len()).into_iter().map(layer).collect()
}

/// The number of the layers of `count` Gaussians in a packed file, and their bytes, their framing included.
pub(super) fn packed_layers_length(quantizers: &[Quantizer], count: usize) -> (usize, u64) {
    let layers = plan::packed_layers(count);
    let last = layers.len().saturating_sub(1);
    let layer = |(number, &count): (usize, &usize)| {
        let codes = packed::packed_length(quantizers, count as u32) as usize;
        let count = LayerCount::written(count as u32, number == last);
        ChunkType::LAYER.framed(count.len() + codes) as u64
    };
    (layers.len(), layers.iter().enumerate().map(layer).sum())
}

/// The layers of an entropy-coded file. Sorts the codes into the order of the file, and rounds
/// their centres to their position intervals, as the decoder reads them. The first layer has as many
/// Gaussians as there is `room` for, in bytes; without that, its usual share.
pub(super) fn write_entropy_layers(
    coder: &LayerCoder<'_>,
    codes: &mut [Code],
    room: Option<usize>,
    observer: &mut Observer<'_>,
) -> Result<Vec<EncodedLayer>> {
    let layers = divide(coder, codes, room, observer)?;
    let layers = observer.map(layers.into_iter(), |codes| written(coder, codes))?;
    Ok(layers.into_iter().flatten().collect())
}

/// The layers that codes make: one, unless they take so few bytes, as many equal ones do, that a decoder would
/// refuse it. The fewer there are, the more bytes each takes.
fn written(coder: &LayerCoder<'_>, codes: &mut [Code]) -> Vec<EncodedLayer> {
    let layer = coder.write(codes);
    if LayerCoder::check_count(layer.count() as u32, &layer.bytes).is_ok() {
        return vec![layer];
    }
    let half = codes.len() / 2;
    coder.cut(codes, half);
    let (first, second) = codes.split_at_mut(half);
    [written(coder, first), written(coder, second)].into_iter().flatten().collect()
}

/// The payload of `bNDS`: the bounds of every layer (spec, section 5.6). `None` for a file of so
/// few layers that it has no `bNDS`. The codes are in the order of the layers.
pub(super) fn bounds_payload(
    coder: &LayerCoder<'_>,
    codes: &[Code],
    layers: &[EncodedLayer],
    header: &Header,
    observer: &mut Observer<'_>,
) -> Result<Option<Vec<u8>>> {
    if !plan::has_bounds(layers.len()) {
        return Ok(None);
    }
    let mut rest = codes;
    let layers_of_codes = layers.iter().map(|layer| {
        let (codes, later) = rest.split_at(layer.count());
        rest = later;
        codes
    });
    let bounds = observer.map(layers_of_codes, |codes| {
        let gaussians = codes.iter().map(|code| {
            let shape = coder.quantization.shape(code);
            coder.quantization.gaussian(code, &shape, &coder.grid, header.color)
        });
        LayerBounds::of(gaussians, header).to_entry()
    })?;
    Ok(Some(bounds.concat()))
}

/// Divides codes into the layers of an entropy-coded file: first the strongest ones, then the
/// others by position.
fn divide<'a>(
    coder: &LayerCoder<'_>,
    codes: &'a mut [Code],
    room: Option<usize>,
    observer: &mut Observer<'_>,
) -> Result<Vec<&'a mut [Code]>> {
    let count = codes.len();
    let most = plan::most_in_entropy_layer(count);
    observer.poll()?;
    codes.par_sort_by_key(|code| core::cmp::Reverse(code.energy()));
    observer.poll()?;
    let first = room.map_or(0, |room| count_within(coder, codes, room));
    let (first, mut rest) = codes.split_at_mut(first);
    let mut parts = Vec::new();
    let (mut shared, mut before) = (0, first.len());
    for share in plan::first_entropy_layers(count) {
        // The Gaussians of the first layer belong to the usual ones. One with few others is left out.
        shared += share;
        if shared > 2 * before {
            let (part, later) = rest.split_at_mut(shared - before);
            parts.push(part);
            (rest, before) = (later, shared);
        }
    }
    parts.push(rest);
    let mut layers = divide_by_position(coder, parts, most, observer)?;
    layers.insert(0, first);
    layers.retain(|layer| !layer.is_empty());
    Ok(layers)
}

/// How many of the first codes take at most so many bytes as a layer.
fn count_within(coder: &LayerCoder<'_>, codes: &[Code], room: usize) -> usize {
    let fits = |count: usize| {
        codes.get(..count).is_some_and(|codes| coder.write(&mut codes.to_vec()).bytes.len() <= room)
    };
    // The largest power of two that fits, and from there in steps of half of the one before.
    let mut count = 0;
    while fits((2 * count).max(1)) {
        count = (2 * count).max(1);
    }
    let mut step = count / 2;
    while step > 0 {
        if fits(count + step) {
            count += step;
        }
        step /= 2;
    }
    count
}

/// Divides each of the parts by position into layers of `most` codes; the last layer of a part may have
/// fewer.
fn divide_by_position<'a>(
    coder: &LayerCoder<'_>,
    mut parts: Vec<&'a mut [Code]>,
    most: usize,
    observer: &mut Observer<'_>,
) -> Result<Vec<&'a mut [Code]>> {
    // In halves, so that every code is moved a few times only.
    while parts.iter().any(|part| part.len() > most) {
        let halves = observer.map(parts.into_iter(), |part| {
            let layers = part.len().div_ceil(most);
            let first = part.len().min(layers.div_ceil(2) * most);
            if first < part.len() {
                coder.cut(part, first);
            }
            part.split_at_mut(first)
        })?;
        parts = halves.into_iter().flat_map(<[_; 2]>::from).collect();
        parts.retain(|part| !part.is_empty());
    }
    Ok(parts)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coding::entropy::CenterGrid;
    use crate::encode::progress::unobserved;
    use crate::encode::rate_model;

    #[test]
    fn about_half_of_the_gaussians_are_in_the_largest_layer_but_not_too_many() {
        let quantization = rate_model::quantization(0.0, &[1.0; 3]);
        let coder = LayerCoder {
            quantization: &quantization,
            grid: CenterGrid::new(640, 480),
            channels: 3,
        };
        for (count, largest, number) in [
            (0, 0, 0),
            (249, 249, 1),
            (2047, 1700, 3),
            (6000, 3120, 4),
            (32_000, 16_383, 4),
            (70_000, 320, 220),
        ] {
            let mut random = fastrand::Rng::with_seed(count as u64);
            let mut code = || Code {
                color: [random.i32(-9..9), 0, 0, 0],
                center: [random.u32(0..80_000), random.u32(0..60_000)],
                ..Code::default()
            };
            let mut codes: Vec<Code> = (0..count).map(|_| code()).collect();
            let layers = unobserved(|observer| divide(&coder, &mut codes, None, observer));
            let sizes: Vec<usize> = layers.iter().map(|layer| layer.len()).collect();
            assert_eq!(sizes.iter().sum::<usize>(), count);
            assert_eq!(sizes.len(), number, "{sizes:?}");
            assert_eq!(sizes.iter().max().copied().unwrap_or(0), largest, "{sizes:?}");
            let thumbnail = sizes.iter().take(2).sum::<usize>();
            assert!(count > plan::MOST_WHOLE || thumbnail >= count / 6, "{sizes:?}");
        }
    }
}
