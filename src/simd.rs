//! Vector code and its plain counterpart: which one runs.

#[cfg(feature = "std")]
use fearless_simd::{Level, dispatch};

/// Gaussians that vector code takes together.
pub(crate) const LANES: usize = 16;

/// Which code does the decoder's arithmetic. All give the same bits.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Backend {
    /// Plain loops: the oracle, and all there is without `std`.
    Reference,
    /// Vector code at one of the levels that this machine has.
    #[cfg(feature = "std")]
    Simd(Level),
}

impl Backend {
    pub(crate) fn reference() -> Self {
        Self::Reference
    }

    /// The best that this machine has.
    pub(crate) fn fastest() -> Self {
        #[cfg(feature = "std")]
        return Self::Simd(Level::new());
        #[cfg(not(feature = "std"))]
        return Self::Reference;
    }

    /// Runs plain loops, compiled for this code's machines.
    #[inline]
    pub(crate) fn run<T>(self, work: impl FnOnce() -> T) -> T {
        match self {
            Self::Reference => work(),
            #[cfg(feature = "std")]
            Self::Simd(level) => dispatch!(level, _ => work()),
        }
    }
}
