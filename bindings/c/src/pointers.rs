//! What callers point to.

use core::ffi::c_void;
use core::slice;

use crate::status::Failure;

/// Refuses a pointer that is null or not aligned, with the name that it has in the header.
pub(crate) fn check<T>(pointer: *const T, name: &str) -> Result<(), Failure> {
    if pointer.is_null() {
        return Err(Failure::argument(format!("{name} is null")));
    }
    if !pointer.is_aligned() {
        return Err(Failure::argument(format!("{name} is not aligned")));
    }
    Ok(())
}

/// The object behind a pointer.
///
/// # Safety
/// If it is not null, it points to an object that nobody changes or frees during `'a`.
pub(crate) unsafe fn shared<'a, T>(pointer: *const T, name: &str) -> Result<&'a T, Failure> {
    check(pointer, name)?;
    // SAFETY: neither null nor misaligned; the caller warrants the rest.
    Ok(unsafe { &*pointer })
}

/// Stores a result.
///
/// # Safety
/// If `to` is not null, it points to memory for a `T` that nobody else uses.
pub(crate) unsafe fn store<T>(to: *mut T, value: T, name: &str) -> Result<(), Failure> {
    check(to, name)?;
    // SAFETY: neither null nor misaligned; the caller warrants the rest. What is there is not dropped: it
    // may be anything.
    unsafe { to.write(value) };
    Ok(())
}

/// Bytes of the caller. Their pointer may be null if there are none.
///
/// # Safety
/// If there are any and the pointer is not null, nobody changes or frees them during `'a`.
pub(crate) unsafe fn bytes<'a>(
    data: *const c_void,
    size: usize,
    name: &str,
) -> Result<&'a [u8], Failure> {
    // SAFETY: the same contract.
    unsafe { elements(data.cast::<u8>(), size, name) }
}

/// As [`bytes`], of any type without invalid values.
///
/// # Safety
/// As of [`bytes`].
pub(crate) unsafe fn elements<'a, T>(
    data: *const T,
    count: usize,
    name: &str,
) -> Result<&'a [T], Failure> {
    if count == 0 {
        return Ok(&[]);
    }
    check(data, name)?;
    check_size(count.checked_mul(size_of::<T>()), name)?;
    // SAFETY: neither null nor misaligned nor too long; the caller warrants the rest.
    Ok(unsafe { slice::from_raw_parts(data, count) })
}

/// Refuses a number of bytes that no object has; `None` is one that `usize` cannot hold.
pub(crate) fn check_size(bytes: Option<usize>, name: &str) -> Result<usize, Failure> {
    bytes
        .filter(|&bytes| isize::try_from(bytes).is_ok())
        .ok_or_else(|| Failure::argument(format!("{name} is larger than memory can be")))
}
