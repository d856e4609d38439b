//! Whether SIMD code or scalar code runs, and at which SIMD level.

#[cfg(feature = "std")]
use fearless_simd::{Level, dispatch};
use scalar::{SCALAR, Scalar};

/// Values that are processed together, one per lane: those of Gaussians, or of pixels.
pub(crate) const LANES: usize = 16;

/// The code that does the decoder's arithmetic. All choices give the same results, bit for bit.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Backend {
    /// Scalar code: the reference in tests, and the only choice without `std`.
    Reference(Scalar),
    /// SIMD code at a level that this machine supports.
    #[cfg(feature = "std")]
    Simd(Level),
}

/// What a backend of scalar code is made of, and one if there can be any. In WebAssembly with vectors there is
/// none, so that what a page loads has no code for it.
#[cfg(not(all(feature = "std", target_arch = "wasm32", target_feature = "simd128")))]
mod scalar {
    pub(crate) type Scalar = ();
    pub(super) const SCALAR: Option<Scalar> = Some(());
}
#[cfg(all(feature = "std", target_arch = "wasm32", target_feature = "simd128"))]
mod scalar {
    pub(crate) type Scalar = core::convert::Infallible;
    pub(super) const SCALAR: Option<Scalar> = None;
}

impl Backend {
    /// Scalar code, if there is any.
    pub(crate) fn reference() -> Self {
        SCALAR.map_or_else(Self::fastest, Self::Reference)
    }

    /// SIMD at the highest level that this machine supports, or scalar code without `std`.
    pub(crate) fn fastest() -> Self {
        #[cfg(feature = "std")]
        return Self::Simd(Level::new());
        #[cfg(not(feature = "std"))]
        return Self::Reference(());
    }

    /// Runs `work`, which is compiled again for each SIMD level, so that its loops are vectorized.
    #[inline]
    pub(crate) fn run<T>(self, work: impl FnOnce() -> T) -> T {
        match self {
            Self::Reference(_) => work(),
            #[cfg(feature = "std")]
            Self::Simd(level) => dispatch!(level, _ => work()),
        }
    }
}
