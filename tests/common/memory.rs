//! What a program that counts its memory holds at a time.

use std::alloc::System;

use cap::Cap;

/// Bytes that are allocated while `work` runs, beyond those before, at their highest.
pub(crate) fn peak<T>(memory: &Cap<System>, work: impl FnOnce() -> T) -> (T, u64) {
    // The peak cannot be set back; a block as large as the peak makes room above it.
    let before = memory.allocated();
    let filler = vec![0_u8; memory.max_allocated().saturating_sub(before) + 1];
    let before = memory.max_allocated();
    let result = work();
    let peak = memory.max_allocated() - before;
    drop(filler);
    (result, peak as u64)
}
