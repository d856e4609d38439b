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
    /// The Cholesky factor in output pixels, for [`Splat::footprint`].
    cholesky: [f32; 3],
}

impl Splat {
    /// A splat that touches no picture: in place of a Gaussian that is not drawn.
    #[cfg(feature = "encode")]
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

    /// An outline that holds every pixel whose *computed* q is at most `cutoff`.
    pub(crate) fn footprint(&self, cutoff: f32) -> Footprint {
        let radius = math::sqrt(cutoff);
        let [l11, l21, l22] = self.cholesky;
        // Rounding moves the computed edge: along x by a few units in the last place, along y by
        // as many units of the larger of l21 and l22 (w dx + i22 dy cancels in a needle). Widen
        // the ellipse by eight of them.
        let l11 = l11 * (1.0 + 1e-6);
        let l22 = l22 + (l21.abs() + l22) * 1e-6;
        let yy = l21 * l21 + l22 * l22;
        let sigma_y = math::sqrt(yy);
        let extent = [radius * l11, radius * sigma_y];
        Footprint {
            center: [self.x, self.y],
            extent,
            margin: [
                0.01 + (self.x.abs() + extent[0]) * 4e-6,
                0.01 + (self.y.abs() + extent[1]) * 4e-6,
            ],
            tip: radius * l21,
            slope: (l11 * l21) / yy,
            half_width: (l11 * l22) / sigma_y * radius,
            inverse_extent_y: 1.0 / extent[1],
        }
    }
}

/// An ellipse, a little larger than what a splat covers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footprint {
    center: [f32; 2],
    /// Half of the bounding box.
    extent: [f32; 2],
    margin: [f32; 2],
    /// dy of the rightmost point; of the leftmost point with the other sign.
    tip: f32,
    /// dx of the middle of a horizontal chord, per dy.
    slope: f32,
    /// Half of the chord through the centre.
    half_width: f32,
    inverse_extent_y: f32,
}

impl Footprint {
    /// The range of y that the footprint spans, in pixels.
    pub(crate) fn rows(&self) -> (f32, f32) {
        let reach = self.extent[1] + self.margin[1];
        (self.center[1] - reach, self.center[1] + reach)
    }

    /// The range of x that the part between the rows `top` and `bottom` spans, in pixels.
    pub(crate) fn columns(&self, top: f32, bottom: f32) -> (f32, f32) {
        let low = (top - self.center[1] - self.margin[1]).max(-self.extent[1]);
        let high = (bottom - self.center[1] + self.margin[1]).min(self.extent[1]);
        // A chord's end moves monotonically on either side of the tip, so the outermost end
        // lies at the row nearest to the tip.
        let end = |tip: f32, side: f32| {
            let dy = tip.max(low).min(high);
            let t = dy * self.inverse_extent_y;
            let chord = math::sqrt((1.0 - t * t).max(0.0));
            self.slope * dy + side * self.half_width * chord + side * self.margin[0]
        };
        (self.center[0] + end(-self.tip, -1.0), self.center[0] + end(self.tip, 1.0))
    }
}
