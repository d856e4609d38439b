//! The time that work takes, where the platform has a clock.

use std::time::Duration;
#[cfg(not(all(target_arch = "wasm32", target_os = "unknown")))]
use std::time::Instant;

/// When some work began. WebAssembly without a system has no clock, and asking for it ends the program: there
/// all work takes no time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stopwatch {
    #[cfg(not(all(target_arch = "wasm32", target_os = "unknown")))]
    start: Instant,
}

impl Stopwatch {
    /// Whether there is a clock.
    pub(crate) const fn runs() -> bool {
        cfg!(not(all(target_arch = "wasm32", target_os = "unknown")))
    }

    pub(crate) fn start() -> Self {
        Self {
            #[cfg(not(all(target_arch = "wasm32", target_os = "unknown")))]
            start: Instant::now(),
        }
    }

    pub(crate) fn elapsed(self) -> Duration {
        #[cfg(not(all(target_arch = "wasm32", target_os = "unknown")))]
        return self.start.elapsed();
        #[cfg(all(target_arch = "wasm32", target_os = "unknown"))]
        Duration::ZERO
    }
}
