//! The quartic kernel of one Gaussian, evaluated at pixels in SIMD code.

use core::ops::Range;

use fearless_simd::{Simd, f32x16};

use crate::encode::sample_tile::centers;
use crate::gaussian::{Gaussian, inverse_cholesky};
use crate::kernel::QUARTIC_RADIUS;
use crate::render::simd_kernel::Quartic;
use crate::simd::LANES;

/// The values of a vector.
pub(crate) type Lanes = [f32; LANES];

/// The weights of a Gaussian at the pixels of a picture, and where they are not 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KernelWeights {
    center: [f32; 2],
    /// The inverse of the Cholesky factor.
    inverse: [f32; 3],
    /// At a distance (dx, dy) from the centre, the weight is positive where |dx - `shear` dy| < h,
    /// with h^2 = `squared_half_width` - `falloff` dy^2.
    shear: f32,
    squared_half_width: f32,
    falloff: f32,
}

impl KernelWeights {
    pub(crate) fn new(gaussian: &Gaussian) -> Self {
        let inverse = inverse_cholesky(gaussian.cholesky);
        let [i11, w, i22] = inverse;
        let a = i11 * i11 + w * w;
        let ratio = i11 * i22 / a;
        Self {
            center: gaussian.center,
            inverse,
            shear: -w * i22 / a,
            squared_half_width: QUARTIC_RADIUS * QUARTIC_RADIUS / a,
            falloff: ratio * ratio,
        }
    }

    /// The vectors of a row in which weights are positive, out of `vectors` that begin at the
    /// column `first_column`.
    #[inline(always)]
    pub(crate) fn span(&self, first_column: usize, y: usize, vectors: usize) -> Range<usize> {
        let dy = y as f32 + 0.5 - self.center[1];
        let squared = self.squared_half_width - self.falloff * dy * dy;
        if squared <= 0.0 {
            return 0..0;
        }
        let half = squared.sqrt();
        let middle = self.center[0] + self.shear * dy - 0.5 - first_column as f32;
        // Casts saturate.
        let first = ((middle - half) * (1.0 / LANES as f32)) as usize;
        let last = ((middle + half) * (1.0 / LANES as f32)) as usize;
        first..(last + 1).min(vectors)
    }

    /// The weights at the sixteen pixels from (x, y) on.
    #[inline(always)]
    pub(crate) fn at<S: Simd>(&self, simd: S, x: usize, y: usize) -> f32x16<S> {
        let root = kernel_root(simd, self.local(simd, x, y));
        root * root
    }

    /// The sixteen pixels from (x, y) on in the Gaussian's own frame: (u, v), where q = u^2 + v^2.
    #[inline(always)]
    pub(crate) fn local<S: Simd>(&self, simd: S, x: usize, y: usize) -> [f32x16<S>; 2] {
        let [i11, w, i22] = self.inverse;
        let dx = centers(simd, x as u32) - self.center[0];
        [dx * i11, dx * w + i22 * (y as f32 + 0.5 - self.center[1])]
    }
}

/// The square root of the quartic kernel, 1 - q / 4, and 0 beyond the cut-off.
#[inline(always)]
pub(crate) fn kernel_root<S: Simd>(simd: S, [u, v]: [f32x16<S>; 2]) -> f32x16<S> {
    Quartic.root(simd, u * u + v * v)
}
