//! Where splats may show: sixteen at a time, in loops over lanes that the compiler vectorizes.

use super::view::View;
use crate::gaussian::{Gaussian, inverse_cholesky};
use crate::math;
use crate::simd::LANES;

/// The centres and Cholesky factors of sixteen splats in output pixels, one per lane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ellipses {
    /// x, y.
    pub(super) center: [[f32; LANES]; 2],
    /// l11, l21, l22.
    pub(super) cholesky: [[f32; LANES]; 3],
}

impl Ellipses {
    /// Ellipses that are all far from every picture.
    pub(super) const NOWHERE: Self =
        Self { center: [[-4e9; LANES]; 2], cholesky: [[1.0; LANES], [0.0; LANES], [1.0; LANES]] };

    /// Sets a lane to a Gaussian in output pixels, without the filter of the view.
    #[inline(always)]
    pub(super) fn set(&mut self, lane: usize, gaussian: &Gaussian, view: &View) {
        let [sx, sy] = view.scale;
        let Gaussian { center: [cx, cy], cholesky: [l11, l21, l22], .. } = gaussian;
        let ([x, y], [a, b, c]) = (&mut self.center, &mut self.cholesky);
        (x[lane], y[lane]) = (cx * sx, cy * sy);
        (a[lane], b[lane], c[lane]) = (l11 * sx, l21 * sy, l22 * sy);
    }

    /// Widens the ellipses by the filter of a view, if it has one. Returns the factors of the
    /// amplitudes, which keep the integrals as they were (spec, section 9.2).
    #[inline(always)]
    pub(super) fn widen(&mut self, view: &View) -> [f32; LANES] {
        let mut amplitudes = [1.0; LANES];
        if view.filter == [0.0; 2] {
            return amplitudes;
        }
        let [fx, fy] = view.filter;
        let [l11, l21, l22] = &mut self.cholesky;
        for lane in 0..LANES {
            let (a, b, c) = (l11[lane], l21[lane], l22[lane]);
            let wide11 = math::sqrt(a * a + fx);
            let wide21 = (a * b) / wide11;
            // yy + fy - wide21^2, without cancellation: l21^2 - wide21^2 = l21^2 fx / wide11^2.
            let rest = b / wide11;
            let wide22 = math::sqrt((c * c + fy) + (rest * rest) * fx);
            amplitudes[lane] = (a / wide11) * (c / wide22);
            (l11[lane], l21[lane], l22[lane]) = (wide11, wide21, wide22);
        }
        amplitudes
    }

    /// The inverses (i11, w, i22) of the Cholesky factors, multiplied by `scale`.
    #[inline(always)]
    pub(super) fn inverse_cholesky(&self, scale: f32) -> [[f32; LANES]; 3] {
        let [l11, l21, l22] = &self.cholesky;
        let mut inverse = [[0.0; LANES]; 3];
        let [i11, w, i22] = &mut inverse;
        for lane in 0..LANES {
            let [a, b, c] = inverse_cholesky([l11[lane], l21[lane], l22[lane]]);
            (i11[lane], w[lane], i22[lane]) = (a * scale, b * scale, c * scale);
        }
        inverse
    }
}

/// The outlines of sixteen splats, one per lane. Each contains every pixel whose *computed* weight
/// is not 0: it is an ellipse that is slightly larger than the one where q equals the cut-off.
#[derive(Clone, Copy, Debug)]
pub(super) struct Footprints {
    x: [f32; LANES],
    y: [f32; LANES],
    /// Half of the height, without the margin.
    reach: [f32; LANES],
    margin_x: [f32; LANES],
    margin_y: [f32; LANES],
    /// dy of the rightmost point, and minus dy of the leftmost point.
    tip: [f32; LANES],
    /// dx of the middle of a horizontal chord, divided by its dy.
    slope: [f32; LANES],
    /// Half of the horizontal chord through the centre.
    half_width: [f32; LANES],
    inverse_reach: [f32; LANES],
}

#[expect(clippy::needless_range_loop, reason = "every loop is over lanes")]
impl Footprints {
    /// The outlines of ellipses, for a cut-off of the squared Mahalanobis distance.
    #[inline(always)]
    pub(super) fn new(ellipses: &Ellipses, cutoff: f32) -> Self {
        const NONE: [f32; LANES] = [0.0; LANES];
        let Ellipses { center: [x, y], cholesky: [l11, l21, l22] } = ellipses;
        let mut all = Self {
            x: *x,
            y: *y,
            reach: NONE,
            margin_x: NONE,
            margin_y: NONE,
            tip: NONE,
            slope: NONE,
            half_width: NONE,
            inverse_reach: NONE,
        };
        let radius = math::sqrt(cutoff);
        let inverse_radius = 1.0 / radius;
        for lane in 0..LANES {
            let (x, y) = (x[lane], y[lane]);
            let (l11, l21, l22) = (l11[lane], l21[lane], l22[lane]);
            // Rounding moves the computed edge: along x by a few units in the last place, along y
            // by as many units of the larger of l21 and l22, since w dx + i22 dy cancels in a long
            // thin ellipse. Hence the ellipse is made larger by eight of these units.
            let l11 = l11 * (1.0 + 1e-6);
            let l22 = l22 + (l21.abs() + l22) * 1e-6;
            let sigma_y = math::sqrt(l21 * l21 + l22 * l22);
            let inverse = 1.0 / sigma_y;
            all.reach[lane] = radius * sigma_y;
            all.margin_x[lane] = 0.01 + (x.abs() + radius * l11) * 4e-6;
            all.margin_y[lane] = 0.01 + (y.abs() + radius * sigma_y) * 4e-6;
            all.tip[lane] = radius * l21;
            all.slope[lane] = (l11 * l21) * (inverse * inverse);
            all.half_width[lane] = (l11 * l22) * inverse * radius;
            all.inverse_reach[lane] = inverse * inverse_radius;
        }
        all
    }

    /// Where the outlines begin and end along y, in pixels.
    #[inline(always)]
    pub(super) fn rows(&self) -> [[f32; LANES]; 2] {
        let mut ends = [[0.0; LANES]; 2];
        for lane in 0..LANES {
            let reach = self.reach[lane] + self.margin_y[lane];
            ends[0][lane] = self.y[lane] - reach;
            ends[1][lane] = self.y[lane] + reach;
        }
        ends
    }

    /// Where the parts of the outlines between `top` and `bottom` begin and end along x. All are in
    /// pixels.
    #[inline(always)]
    pub(super) fn columns(&self, top: f32, bottom: f32) -> [[f32; LANES]; 2] {
        let mut ends = [[0.0; LANES]; 2];
        for lane in 0..LANES {
            let (reach, margin) = (self.reach[lane], self.margin_y[lane]);
            let low = larger(top - self.y[lane] - margin, -reach);
            let high = smaller(bottom - self.y[lane] + margin, reach);
            // The end of a chord moves monotonically on both sides of the tip, so the outermost end
            // is at the height nearest to the tip.
            let end = |tip: f32, half_width: f32, margin: f32| {
                let dy = smaller(larger(tip, low), high);
                let t = dy * self.inverse_reach[lane];
                let chord = math::sqrt(larger(1.0 - t * t, 0.0));
                self.x[lane] + margin + self.slope[lane] * dy + half_width * chord
            };
            let (tip, half) = (self.tip[lane], self.half_width[lane]);
            ends[0][lane] = end(-tip, -half, -self.margin_x[lane]);
            ends[1][lane] = end(tip, half, self.margin_x[lane]);
        }
        ends
    }

    /// Upper bounds of the widths of all parts of the outlines that are `height` pixels high, in
    /// pixels.
    #[inline(always)]
    pub(super) fn widest(&self, height: f32) -> [f32; LANES] {
        let mut widths = [0.0; LANES];
        for lane in 0..LANES {
            let reach = height + 2.0 * self.margin_y[lane];
            let chord = self.half_width[lane] + self.margin_x[lane];
            widths[lane] = 2.0 * chord + self.slope[lane].abs() * reach;
        }
        widths
    }
}

/// The larger of two numbers. One instruction, unlike `f32::max`, which also handles NaN.
#[inline(always)]
pub(super) fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The smaller of two numbers. One instruction, unlike `f32::min`, which also handles NaN.
#[inline(always)]
pub(super) fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}
