//! How much memory work takes: the program's allocator counts.

use std::alloc::System;

use peakmem_alloc::{INSTRUMENTED_SYSTEM, PeakMemAlloc, PeakMemAllocTrait};

#[global_allocator]
static ALLOCATOR: &PeakMemAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Does the work; with its result, the most bytes that were held meanwhile beside what was held
/// before. That counts all threads, so nothing else should run.
pub(crate) fn peak<T>(work: impl FnOnce() -> T) -> (T, f64) {
    ALLOCATOR.reset_peak_memory();
    let result = work();
    (result, ALLOCATOR.get_peak_memory() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_freed_counts_as_well() {
        const LARGE: usize = 1 << 28;
        // Other tests run beside this one, but are small.
        let (length, bytes) = peak(|| vec![0_u8; LARGE].len());
        assert_eq!(length, LARGE);
        assert!((bytes / LARGE as f64 - 1.0).abs() < 0.2, "{bytes}");
        let (_, bytes) = peak(|| ());
        assert!(bytes < 0.2 * LARGE as f64, "{bytes}");
    }
}
