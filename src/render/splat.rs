//! A Gaussian as the inner loop wants it, and where on the output it may be visible.

use super::footprint::LANES;
use super::view::View;
use crate::gaussian::{Gaussian, inverse_cholesky};
use crate::math;

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
    /// The Cholesky factor in output pixels, for its footprint.
    pub(super) cholesky: [f32; 3],
}

/// Splats that stand together in the file; at the end some that touch nothing.
pub(crate) type Block = [Splat; LANES];

/// A block of at most so many splats.
#[cfg(all(test, feature = "std"))]
pub(super) fn block_of(splats: &[Splat]) -> Block {
    let mut block = [Splat::NOWHERE; LANES];
    block[..splats.len()].copy_from_slice(splats);
    block
}

impl Splat {
    /// A splat that touches no picture: in place of a Gaussian that is not drawn.
    pub(crate) const NOWHERE: Self = Self {
        x: -4e9,
        y: -4e9,
        i11: 1.0,
        w: 0.0,
        i22: 1.0,
        color: [0.0; 4],
        cholesky: [1.0, 0.0, 1.0],
    };

    /// `None` for a Gaussian that is not drawn.
    #[inline(always)]
    pub(crate) fn new(gaussian: &Gaussian, view: &View) -> Option<Self> {
        let ([x, y], cholesky, amplitude) = Self::outline(gaussian, view)?;
        let [i11, w, i22] = inverse_cholesky(cholesky);
        let color = match amplitude {
            Some(amplitude) => gaussian.color.map(|c| c * amplitude),
            None => gaussian.color,
        };
        Some(Self { x, y, i11, w, i22, color, cholesky })
    }

    /// The centre and the Cholesky factor in output pixels, and by what widening changed the
    /// amplitude, if anything. `None` for a Gaussian that is not drawn.
    #[inline(always)]
    pub(super) fn outline(
        gaussian: &Gaussian,
        view: &View,
    ) -> Option<([f32; 2], [f32; 3], Option<f32>)> {
        if !gaussian.is_drawable() {
            return None;
        }
        let [sx, sy] = view.scale;
        let center = [gaussian.center[0] * sx, gaussian.center[1] * sy];
        let [l11, l21, l22] = gaussian.cholesky;
        let [l11, l21, l22] = [l11 * sx, l21 * sy, l22 * sy];
        if view.filter == [0.0; 2] {
            return Some((center, [l11, l21, l22], None));
        }
        let [fx, fy] = view.filter;
        let wide11 = math::sqrt(l11 * l11 + fx);
        let wide21 = (l11 * l21) / wide11;
        // yy + fy - wide21^2 without its cancellation: l21^2 - wide21^2 = l21^2 fx / wide11^2.
        let rest = l21 / wide11;
        let wide22 = math::sqrt((l22 * l22 + fy) + (rest * rest) * fx);
        // Widening keeps the integral, so the amplitude falls as the area grows.
        let amplitude = (l11 / wide11) * (l22 / wide22);
        Some((center, [wide11, wide21, wide22], Some(amplitude)))
    }

    /// The same with all distances multiplied.
    #[inline(always)]
    pub(super) fn scaled(self, scale: f32) -> Self {
        let Self { i11, w, i22, .. } = self;
        Self { i11: i11 * scale, w: w * scale, i22: i22 * scale, ..self }
    }

    /// Where the pixel centre (px, py) lies in the kernel.
    pub(super) fn uv(&self, px: f32, py: f32) -> (f32, f32) {
        let (dx, dy) = (px - self.x, py - self.y);
        (self.i11 * dx, self.w * dx + self.i22 * dy)
    }
}
