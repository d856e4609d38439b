//! Peak memory, as counted by the program's allocator.

use std::alloc::System;

use peakmem_alloc::{INSTRUMENTED_SYSTEM, PeakMemAlloc, PeakMemAllocTrait};

#[global_allocator]
static ALLOCATOR: &PeakMemAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Does the work and returns its result with the peak memory in bytes, without what was allocated
/// before. All threads count, so nothing else should run meanwhile.
pub(crate) fn peak<T>(work: impl FnOnce() -> T) -> (T, f64) {
    ALLOCATOR.reset_peak_memory();
    let result = work();
    (result, ALLOCATOR.get_peak_memory() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_that_is_freed_again_counts() {
        const LARGE: usize = 1 << 28;
        // Other tests run beside this one, but are small.
        let (length, bytes) = peak(|| vec![0_u8; LARGE].len());
        assert_eq!(length, LARGE);
        assert!((bytes / LARGE as f64 - 1.0).abs() < 0.2, "{bytes}");
        let (_, bytes) = peak(|| ());
        assert!(bytes < 0.2 * LARGE as f64, "{bytes}");
    }
}
