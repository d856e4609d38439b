//! Multiplication and addition with a single rounding, so that all machines get the same bits, but WebAssembly.

use fearless_simd::{Simd, SimdFloat, SimdInto};

/// [`MulAdd::fused_mul_add`] for vectors.
pub(crate) trait MulAdd<S: Simd>: Sized {
    /// `self` times `factor`, plus `summand`, rounded once; in WebAssembly, twice.
    ///
    /// WebAssembly has no instruction for it that is the same in all browsers, and with what emulates it an
    /// encoding takes 25 times as long as natively. So its files are others than those of native
    /// machines: as good, and the same in all browsers.
    ///
    /// x86 before 2013 has no instruction for it. What emulates it there is long, and called: inlined, it
    /// would be nearly all of the encoder's code.
    fn fused_mul_add(self, factor: impl SimdInto<Self, S>, summand: Self) -> Self;
}

impl<S: Simd, V: SimdFloat<S, Element = f32>> MulAdd<S> for V {
    #[inline(always)]
    fn fused_mul_add(self, factor: impl SimdInto<Self, S>, summand: Self) -> Self {
        let simd = self.token();
        let factor = factor.simd_into(simd);
        if cfg!(target_arch = "wasm32") {
            return self * factor + summand;
        }
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        if simd.level().as_avx2().is_none() {
            return emulated(simd, self, factor, summand);
        }
        self.mul_add_precise(factor, summand)
    }
}

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
#[inline(never)]
fn emulated<S: Simd, V: SimdFloat<S, Element = f32>>(
    simd: S,
    value: V,
    factor: V,
    summand: V,
) -> V {
    simd.vectorize(
        #[inline(always)]
        || value.mul_add_precise(factor, summand),
    )
}
