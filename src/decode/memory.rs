//! Vectors that grow as data arrives, and not merely because the file declares a length.

use alloc::vec::Vec;

/// The most memory in bytes of a vector that grows to `length` elements by [`reserve`]: when it is
/// moved for the last time, its old and its new memory exist at the same time.
pub(super) fn peak_memory<T>(length: u32) -> u64 {
    2 * u64::from(length) * size_of::<T>() as u64
}

/// Reserves memory for `additional` elements. The capacity doubles as they arrive, but does not
/// exceed the `declared` length.
pub(super) fn reserve<T>(elements: &mut Vec<T>, additional: usize, declared: usize) {
    let length = elements.len();
    if elements.capacity() - length < additional {
        elements.reserve_exact(additional.max(length.min(declared.saturating_sub(length))));
    }
}
