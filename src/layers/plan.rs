//! How the Gaussians of a file are shared out among its layers, and how many of them a small output
//! takes. Files of either coding have their strongest Gaussians first, so that every prefix of a file
//! is a picture.

/// Of a small output: pixels for which one Gaussian is enough.
const PIXELS_PER_GAUSSIAN: u64 = 12;
/// A thumbnail takes at least one out of so many of a file's Gaussians: with fewer it is not the same
/// picture, however small.
const LEAST_THUMBNAIL: u64 = 6;

/// How many of a file's Gaussians make a fair preview of a size in pixels.
pub(crate) fn gaussians_for(all: u32, width: u32, height: u32) -> u32 {
    let all = u64::from(all);
    let shown = u64::from(width) * u64::from(height) / PIXELS_PER_GAUSSIAN;
    shown.clamp(all / LEAST_THUMBNAIL, all) as u32
}

#[cfg(feature = "encode")]
mod shares {
    /// The layers of a packed file, as shares of its Gaussians: each ends with a checksum, and the
    /// first already shows the picture.
    const PACKED: [f64; 4] = [0.125, 0.125, 0.25, 0.5];
    /// Fewest Gaussians of a packed file with layers: 64 in the smallest.
    const LEAST_PACKED: usize = 512;

    /// The first layers of an entropy-coded file, as shares of its Gaussians: a tenth of the file
    /// already shows the picture, and both together are enough for a thumbnail.
    pub(crate) const FIRST_ENTROPY: [f64; 2] = [0.04, 0.13];
    /// Fewest Gaussians of an entropy-coded file with such layers.
    const LEAST_ENTROPY: usize = 250;
    /// Fewest Gaussians that are worth being decoded by several threads.
    const LEAST_PARALLEL: usize = 2048;
    /// The largest layer's share of them: those of the layers before it take more time each.
    const LARGEST: f64 = 0.52;
    /// Most Gaussians in a layer, so that many threads can be used.
    const MOST_IN_LAYER: usize = 16_384;
    /// More Gaussians than this make a large picture, of which a region is decoded from few layers:
    /// they have at most so many then.
    pub(crate) const MOST_WHOLE: usize = 32_768;
    const MOST_IN_SMALL_LAYER: usize = 320;
    /// A file of more layers than this says where they show.
    const MOST_WITHOUT_BOUNDS: usize = 8;

    /// The sizes of the layers of a packed file with `count` Gaussians.
    pub(crate) fn packed_layers(count: usize) -> Vec<usize> {
        if count == 0 {
            return Vec::new();
        }
        if count < LEAST_PACKED {
            return vec![count];
        }
        let mut sizes: Vec<_> = PACKED.map(|share| (share * count as f64) as usize).into();
        // Rounding leaves a few over.
        let last = sizes.len() - 1;
        sizes[last] += count - sizes.iter().sum::<usize>();
        sizes
    }

    /// How many Gaussians, the strongest ones, each of the first layers of an entropy-coded file with
    /// `count` Gaussians takes; the others follow by where they are.
    pub(crate) fn first_entropy_layers(count: usize) -> impl Iterator<Item = usize> {
        let shares = if count < LEAST_ENTROPY { &[][..] } else { &FIRST_ENTROPY };
        shares.iter().map(move |share| (share * count as f64) as usize)
    }

    /// Most Gaussians in a layer of an entropy-coded file with `count` Gaussians.
    pub(crate) fn most_in_entropy_layer(count: usize) -> usize {
        match count {
            0..LEAST_PARALLEL => count,
            LEAST_PARALLEL..=MOST_WHOLE => ((LARGEST * count as f64) as usize).min(MOST_IN_LAYER),
            // As many layers as a header can declare.
            _ => MOST_IN_SMALL_LAYER.max(count / usize::from(u16::MAX / 2)),
        }
    }

    /// Whether a file of so many layers says where they show.
    pub(crate) fn has_bounds(layers: usize) -> bool {
        layers > MOST_WITHOUT_BOUNDS
    }
}

#[cfg(feature = "encode")]
pub(crate) use shares::*;
