//! How the Gaussians of a file are divided into layers, and how many of them a small output needs.
//! In both codings the strongest Gaussians come first, so that every prefix of a file gives a
//! picture.

use crate::container::Header;

// Constants: docs/tuning.md, "Layers and the decoder".
/// In a small output, one Gaussian is enough for this many pixels.
const PIXELS_PER_GAUSSIAN: u64 = 16;
/// A preview has the Gaussians of the first layers, which are one in this many of the file's. With fewer, it
/// would differ visibly, however small it is; layers after them may be only a part of the picture each.
const PREVIEW_DIVISOR: u32 = 6;

impl Header {
    /// How many Gaussians are enough for a preview of this size in pixels: the first sixth, which are the
    /// strongest, if that is at least one for 16 pixels, or all. A preview of a part lacks small things,
    /// such as text.
    #[must_use]
    pub fn gaussians_for(&self, width: u32, height: u32) -> u32 {
        gaussians_for(self.gaussians, width, height)
    }
}

/// [`Header::gaussians_for`] of a file with so many Gaussians.
fn gaussians_for(all: u32, width: u32, height: u32) -> u32 {
    let first = all / PREVIEW_DIVISOR;
    let shown = u64::from(width) * u64::from(height) / PIXELS_PER_GAUSSIAN;
    if shown <= u64::from(first) { first } else { all }
}

#[cfg(feature = "encode")]
mod shares {
    /// The layers of a file with the packed coding, as fractions of its Gaussians. The first is
    /// enough to recognize the picture.
    const PACKED: [f64; 4] = [0.125, 0.125, 0.25, 0.5];
    /// A file with the packed coding and fewer Gaussians than this has one layer. With more, the
    /// smallest layer has at least 64.
    const LEAST_PACKED: usize = 512;

    /// The first layers of an entropy-coded file, as fractions of its Gaussians. With the first, a
    /// tenth of the file is enough to recognize the picture; both together are enough for a
    /// thumbnail.
    const FIRST_ENTROPY: [f64; 2] = [0.04, 0.13];
    /// An entropy-coded file with fewer Gaussians than this has no such layers.
    const LEAST_ENTROPY: usize = 250;
    /// A file with fewer Gaussians than this need not be decoded on several threads.
    const LEAST_PARALLEL: usize = 4096;
    /// Most of a file's Gaussians in one layer, as a fraction: two threads then take the same time.
    /// It is over one half because Gaussians of the first layers take more time each.
    const LARGEST: f64 = 0.52;
    /// Most Gaussians in a layer, so that many threads can be used, and its number takes two bytes.
    const MOST_IN_LAYER: usize = 16_383;
    /// A file with more Gaussians than this is a large picture, which has small layers, so that a
    /// region needs few of them.
    pub(crate) const MOST_WHOLE: usize = 32_768;
    /// Most Gaussians in a layer of a large picture.
    const MOST_IN_SMALL_LAYER: usize = 320;
    /// A file with more layers than this has bounds of its layers.
    const MOST_WITHOUT_BOUNDS: usize = 8;

    /// The numbers of Gaussians in the layers of a file with the packed coding and `count`
    /// Gaussians.
    pub(crate) fn packed_layers(count: usize) -> Vec<usize> {
        if count == 0 {
            return Vec::new();
        }
        if count < LEAST_PACKED {
            return vec![count];
        }
        let mut sizes: Vec<_> = PACKED.map(|share| (share * count as f64) as usize).into();
        // The last layer also gets those that rounding has left over.
        let last = sizes.len() - 1;
        sizes[last] += count - sizes.iter().sum::<usize>();
        sizes
    }

    /// The numbers of Gaussians in the first layers of an entropy-coded file with `count`
    /// Gaussians. These layers have the strongest Gaussians; the layers after them divide the
    /// others by position.
    pub(crate) fn first_entropy_layers(count: usize) -> impl Iterator<Item = usize> {
        let shares = if count < LEAST_ENTROPY { &[][..] } else { &FIRST_ENTROPY };
        shares.iter().map(move |share| (share * count as f64) as usize)
    }

    /// Most Gaussians in a layer of an entropy-coded file with `count` Gaussians.
    pub(crate) fn most_in_entropy_layer(count: usize) -> usize {
        match count {
            0..LEAST_PARALLEL => count,
            LEAST_PARALLEL..=MOST_WHOLE => ((LARGEST * count as f64) as usize).min(MOST_IN_LAYER),
            // At least so many that a header can declare the number of layers.
            _ => MOST_IN_SMALL_LAYER.max(count / usize::from(u16::MAX / 2)),
        }
    }

    /// Whether a file with this many layers has bounds of its layers.
    pub(crate) fn has_bounds(layers: usize) -> bool {
        layers > MOST_WITHOUT_BOUNDS
    }
}

#[cfg(feature = "encode")]
pub(crate) use shares::*;

#[cfg(all(test, feature = "encode"))]
mod tests {
    use super::*;

    #[test]
    fn packed_layers_have_all_gaussians_and_none_is_empty() {
        assert_eq!(packed_layers(0), []);
        assert_eq!(packed_layers(511), [511]);
        assert_eq!(packed_layers(512), [64, 64, 128, 256]);
        for count in 1..5000 {
            let sizes = packed_layers(count);
            assert_eq!(sizes.iter().sum::<usize>(), count);
            assert!(sizes.iter().all(|&size| size > 0), "{count}: {sizes:?}");
        }
    }

    #[test]
    fn the_layers_of_any_file_can_be_declared() {
        for count in
            [0, 1, 249, 250, 2047, 2048, 32_768, 32_769, 1 << 20, 1 << 22, u32::MAX as usize]
        {
            let first: Vec<usize> = first_entropy_layers(count).collect();
            let rest = count - first.iter().sum::<usize>();
            let most = most_in_entropy_layer(count).max(1);
            let layers: usize = first.iter().chain([&rest]).map(|size| size.div_ceil(most)).sum();
            assert!(u16::try_from(layers).is_ok(), "{count}: {layers} layers");
        }
    }

    #[test]
    fn a_small_output_needs_a_sixth_of_the_gaussians_or_all() {
        assert_eq!(gaussians_for(6000, 1, 1), 1000);
        assert_eq!(gaussians_for(6000, 160, 100), 1000);
        assert_eq!(gaussians_for(6000, 160, 102), 6000);
        assert_eq!(gaussians_for(6000, 4000, 3000), 6000);
        assert_eq!(gaussians_for(u32::MAX, u32::MAX, u32::MAX), u32::MAX);
        assert_eq!(gaussians_for(0, 100, 100), 0);
    }
}
