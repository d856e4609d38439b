//! A Gaussian as the inner loop wants it, and where on the output it may be visible.

use super::view::View;
use crate::gaussian::{Gaussian, inverse_cholesky};
use crate::math;

/// One Gaussian in output pixels: q = (i11 dx)^2 + (w dx + i22 dy)^2 with
/// (dx, dy) = pixel centre - (x, y) (spec, sections 9.2 and 9.3).
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
    pub(crate) fn new(gaussian: &Gaussian, view: &View) -> Option<Self> {
        if !gaussian.is_drawable() {
            return None;
        }
        let [sx, sy] = view.scale;
        let [l11, l21, l22] = gaussian.cholesky;
        let mut cholesky = [l11 * sx, l21 * sy, l22 * sy];
        let mut color = gaussian.color;
        if view.filter != [0.0; 2] {
            let [fx, fy] = view.filter;
            let [l11, l21, l22] = cholesky;
            let wide11 = math::sqrt(l11 * l11 + fx);
            let wide21 = (l11 * l21) / wide11;
            // yy + fy - wide21^2 without its cancellation: l21^2 - wide21^2 = l21^2 fx / wide11^2.
            let rest = l21 / wide11;
            let wide22 = math::sqrt((l22 * l22 + fy) + (rest * rest) * fx);
            // Widening keeps the integral, so the amplitude falls as the area grows.
            let amplitude = (l11 / wide11) * (l22 / wide22);
            color = color.map(|c| c * amplitude);
            cholesky = [wide11, wide21, wide22];
        }
        let [i11, w, i22] = inverse_cholesky(cholesky);
        let (x, y) = (gaussian.center[0] * sx, gaussian.center[1] * sy);
        Some(Self { x, y, i11, w, i22, color, cholesky })
    }

    /// The squared Mahalanobis distance of the pixel centre (px, py).
    pub(crate) fn q(&self, px: f32, py: f32) -> f32 {
        let (dx, dy) = (px - self.x, py - self.y);
        let u = self.i11 * dx;
        let v = self.w * dx + self.i22 * dy;
        u * u + v * v
    }
}
