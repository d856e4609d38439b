//! Gaussians in the form that the inner loop uses.

use super::footprint::Ellipses;
use super::view::View;
use crate::gaussian::Gaussian;
#[cfg(any(feature = "encode", all(test, feature = "std")))]
use crate::gaussian::inverse_cholesky;
use crate::simd::LANES;

/// A Gaussian in output pixels. The kernel's point for a distance of (dx, dy) from the centre (x,
/// y) is (u, v) = (i11 dx, w dx + i22 dy) (spec, sections 9.2 and 9.3).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Splat {
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) i11: f32,
    pub(crate) w: f32,
    pub(crate) i22: f32,
    /// The amplitude in each channel.
    pub(crate) color: [f32; 4],
}

/// Splats that follow each other in the file. A block with fewer is filled up with
/// [`Splat::NOWHERE`].
pub(crate) type Block = [Splat; LANES];

/// Sets the first splats of a block to Gaussians, all of which are drawn. Their distances are
/// multiplied by `scale`, which is that of the kernel. Returns their ellipses.
#[inline(always)]
pub(super) fn fill_block<'a>(
    block: &mut Block,
    gaussians: impl Iterator<Item = &'a Gaussian> + Clone,
    view: &View,
    scale: f32,
) -> Ellipses {
    let mut ellipses = Ellipses::NOWHERE;
    for (lane, gaussian) in gaussians.clone().enumerate() {
        ellipses.set(lane, gaussian, view);
    }
    let amplitudes = ellipses.widen(view);
    let inverse = ellipses.inverse_cholesky(scale);
    let ([x, y], [i11, w, i22]) = (&ellipses.center, &inverse);
    for (lane, (splat, gaussian)) in block.iter_mut().zip(gaussians).enumerate() {
        *splat = Splat {
            x: x[lane],
            y: y[lane],
            i11: i11[lane],
            w: w[lane],
            i22: i22[lane],
            color: gaussian.color.map(|c| c * amplitudes[lane]),
        };
    }
    ellipses
}

/// The ellipses of at most sixteen splats.
#[cfg(feature = "encode")]
#[inline(always)]
pub(super) fn ellipses_of(splats: &[Splat]) -> Ellipses {
    let mut all = Ellipses::NOWHERE;
    let ([x, y], [i11, w, i22]) = (&mut all.center, &mut all.cholesky);
    for (lane, splat) in splats.iter().enumerate() {
        (x[lane], y[lane]) = (splat.x, splat.y);
        (i11[lane], w[lane], i22[lane]) = (splat.i11, splat.w, splat.i22);
    }
    // Here `cholesky` has inverses; the inverse of an inverse is the factor itself.
    all.cholesky = all.inverse_cholesky(1.0);
    all
}

impl Splat {
    /// A splat that is far from every picture. It stands for a Gaussian that is not drawn.
    pub(crate) const NOWHERE: Self =
        Self { x: -4e9, y: -4e9, i11: 1.0, w: 0.0, i22: 1.0, color: [0.0; 4] };

    /// The splat of a Gaussian in an output of the stored size; `None` if it is not drawn.
    #[cfg(any(feature = "encode", all(test, feature = "std")))]
    #[inline(always)]
    pub(crate) fn new(gaussian: &Gaussian) -> Option<Self> {
        let Gaussian { center: [x, y], cholesky, color } = *gaussian;
        let [i11, w, i22] = inverse_cholesky(cholesky);
        gaussian.is_drawable().then_some(Self { x, y, i11, w, i22, color })
    }

    /// The kernel's point (u, v) for the pixel centre (px, py).
    pub(super) fn uv(&self, px: f32, py: f32) -> (f32, f32) {
        let (dx, dy) = (px - self.x, py - self.y);
        (self.i11 * dx, self.w * dx + self.i22 * dy)
    }
}
