//! The norms that SSIMULACRA2 adds up, and their weights.

use super::difference::Sums;
use super::light::Channel;

/// Most scales of SSIMULACRA2.
const MOST_SCALES: usize = 6;
/// Scales with a norm of any weight: full size, a half, and so on.
pub(super) const SCALES: usize = 5;
/// The least side in pixels of a picture that SSIMULACRA2 measures, and of a scale that the next one is
/// made from.
const LEAST_SIDE: usize = 8;
/// Norms of a channel on a scale.
const NORMS: usize = 6;
/// The weights that are not 0, with their indices: first come those of the first channel on all scales.
/// Weights below 0.01 are left out.
const WEIGHTS: [(usize, f64); 25] = [
    (9, 1.104_172_64),
    (15, 1.842_245_55),
    (16, 11.441_172_6),
    (21, 1.878_759_5),
    (22, 10.949_069_91),
    (25, 0.967_793_71),
    (28, 0.998_176_7),
    (39, 7.466_890_33),
    (41, 17.445_833_98),
    (45, 6.683_678_15),
    (47, 1.027_889_94),
    (48, 225.205_153),
    (51, 19.213_238_19),
    (54, 176.393_175_98),
    (57, 24.433_01),
    (58, 0.285_208_03),
    (63, 34.779_063_44),
    (64, 44.835_625_33),
    (93, 8.826_982_76),
    (94, 23.192_433_44),
    (96, 95.108_049_88),
    (97, 0.986_397_8),
    (98, 0.983_438_28),
    (100, 171.266_725_59),
    (101, 0.980_785_89),
];

/// What of a picture has norms that count: a channel on a scale.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measured {
    pub(super) channel: Channel,
    /// The size is a 2^scale-th.
    pub(super) scale: usize,
    /// Those of structure, artifacts and lost detail: three means, and three fourth roots of means of
    /// fourth powers.
    weights: [f64; NORMS],
}

impl Measured {
    /// All that SSIMULACRA2 measures of a picture of a size, from the finest scale on; `None` of a
    /// picture that is too small for it. One with fewer scales has the first weights, so that its channels
    /// have other ones than those of a large picture: so does the reference.
    pub(super) fn by_metric(size: [usize; 2]) -> Option<Vec<Self>> {
        let is_measured = |size: &[usize; 2]| size.iter().all(|&side| side >= LEAST_SIDE);
        let next = |size: &[usize; 2]| is_measured(size).then(|| size.map(|side| side.div_ceil(2)));
        let scales = core::iter::successors(Some(size), next).take(MOST_SCALES).count();
        is_measured(&size).then(|| Self::of_scales(scales))
    }

    /// All that is measured of a large picture.
    pub(super) fn of_large() -> Vec<Self> {
        Self::of_scales(MOST_SCALES)
    }

    /// Whether SSIMULACRA2 gives a picture of a size the weights that people's judgement of large
    /// pictures led to.
    pub(super) fn is_large(size: [usize; 2]) -> bool {
        // The last scale is made from one of at least that side.
        size.iter().all(|&side| side.div_ceil(1 << (MOST_SCALES - 2)) >= LEAST_SIDE)
    }

    fn of_scales(scales: usize) -> Vec<Self> {
        let channels = [Channel::Opponent, Channel::Luma, Channel::Blue];
        let all = (0..scales.min(SCALES)).flat_map(|scale| {
            channels.into_iter().enumerate().map(move |(index, channel)| {
                let first = (index * scales + scale) * NORMS;
                let weights = core::array::from_fn(|norm| {
                    let found = WEIGHTS.iter().find(|&&(at, _)| at == first + norm);
                    found.map_or(0.0, |&(_, weight)| weight)
                });
                Self { channel, scale, weights }
            })
        });
        all.filter(|measured| measured.weights != [0.0; NORMS]).collect()
    }

    /// The weighted norms, from sums over pixels.
    pub(super) fn weighted(&self, sums: &Sums, pixels: f64) -> f64 {
        let mut norms = sums.map(|sum| sum / pixels);
        for norm in &mut norms[NORMS / 2..] {
            *norm = norm.sqrt().sqrt();
        }
        norms.iter().zip(self.weights).map(|(norm, weight)| norm * weight).sum()
    }
}
