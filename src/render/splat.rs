//! A Gaussian as the inner loop wants it, and where on the output it may be visible.

use super::footprint::Ellipses;
use super::view::View;
use crate::gaussian::Gaussian;
#[cfg(any(feature = "encode", all(test, feature = "std")))]
use crate::gaussian::inverse_cholesky;
use crate::simd::LANES;

/// One Gaussian in output pixels: at a distance of (dx, dy) from its centre (x, y) lies the point
/// (u, v) = (i11 dx, w dx + i22 dy) of its kernel (spec, sections 9.2 and 9.3).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Splat {
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) i11: f32,
    pub(crate) w: f32,
    pub(crate) i22: f32,
    pub(crate) color: [f32; 4],
}

/// Splats that stand together in the file; at the end some that touch nothing.
pub(crate) type Block = [Splat; LANES];

/// Puts the splats of at most so many Gaussians, all of which are drawn, first into a block, with all
/// distances multiplied by `scale`. Returns their outlines.
#[inline(always)]
pub(super) fn fill<'a>(
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

/// The outlines of at most so many splats.
#[cfg(feature = "encode")]
#[inline(always)]
pub(super) fn ellipses_of(splats: &[Splat]) -> Ellipses {
    let mut all = Ellipses::NOWHERE;
    let ([x, y], [i11, w, i22]) = (&mut all.center, &mut all.cholesky);
    for (lane, splat) in splats.iter().enumerate() {
        (x[lane], y[lane]) = (splat.x, splat.y);
        (i11[lane], w[lane], i22[lane]) = (splat.i11, splat.w, splat.i22);
    }
    // The inverse of the inverse.
    all.cholesky = all.inverse_cholesky(1.0);
    all
}

impl Splat {
    /// A splat that touches no picture: in place of a Gaussian that is not drawn.
    pub(crate) const NOWHERE: Self =
        Self { x: -4e9, y: -4e9, i11: 1.0, w: 0.0, i22: 1.0, color: [0.0; 4] };

    /// A Gaussian in a picture of the stored size; `None` for one that is not drawn.
    #[cfg(any(feature = "encode", all(test, feature = "std")))]
    #[inline(always)]
    pub(crate) fn new(gaussian: &Gaussian) -> Option<Self> {
        let Gaussian { center: [x, y], cholesky, color } = *gaussian;
        let [i11, w, i22] = inverse_cholesky(cholesky);
        gaussian.is_drawable().then_some(Self { x, y, i11, w, i22, color })
    }

    /// Where the pixel centre (px, py) lies in the kernel.
    pub(super) fn uv(&self, px: f32, py: f32) -> (f32, f32) {
        let (dx, dy) = (px - self.x, py - self.y);
        (self.i11 * dx, self.w * dx + self.i22 * dy)
    }
}
