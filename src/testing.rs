//! What several unit tests share.

use proptest::test_runner::{Config, RngSeed};

/// Property tests that try the same cases every time.
pub(crate) fn config(cases: u32) -> Config {
    Config { cases, rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Config::default() }
}
