//! Helpers of unit tests.

#[cfg(feature = "std")]
use fearless_simd::{Level, Simd};
use proptest::test_runner::{Config, RngSeed};

/// The configuration of property tests: the same random cases in every run.
pub(crate) fn config(cases: u32) -> Config {
    Config { cases, rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Config::default() }
}

/// Every SIMD level that this machine supports, with its name.
#[cfg(feature = "std")]
pub(crate) fn simd_levels() -> Vec<(&'static str, Level)> {
    let best = Level::new();
    let mut levels = vec![("best", best), ("baseline", Level::baseline())];
    #[cfg(target_arch = "x86")]
    levels.push(("fallback", Level::fallback()));
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
        let more = [
            ("SSE2", best.as_sse2().map(Simd::level)),
            ("SSE4.2", best.as_sse4_2().map(Simd::level)),
            ("AVX2", best.as_avx2().map(Simd::level)),
            ("AVX-512", best.as_avx512().map(Simd::level)),
        ];
        levels.extend(more.into_iter().filter_map(|(name, level)| Some((name, level?))));
    }
    levels
}
