//! Bytes that the library hands to the caller.

use core::ptr;

use crate::pointers;
use crate::status::{Failure, guard};

/// Bytes that the library has allocated. gip_buffer_free frees them, and nothing else does.
#[repr(C)]
#[derive(Debug)]
pub struct Buffer {
    /// The bytes; null if there are none.
    pub data: *mut u8,
    /// How many they are.
    pub size: usize,
}

/// Frees the bytes of a buffer, and makes it an empty one. Null and an empty buffer are left alone.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gip_buffer_free(buffer: *mut Buffer) {
    guard(|| {
        if buffer.is_null() {
            return Ok(());
        }
        // SAFETY: the caller passes a buffer that is its own.
        let Buffer { data, size } = unsafe { ptr::replace(buffer, Buffer::EMPTY) };
        if !data.is_null() {
            let bytes = ptr::slice_from_raw_parts_mut(data, size);
            // SAFETY: they were a box until `Buffer::fill`, and have not been freed since.
            drop(unsafe { Box::from_raw(bytes) });
        }
        Ok(())
    });
}

impl Buffer {
    const EMPTY: Self = Self { data: ptr::null_mut(), size: 0 };

    /// Makes the caller's buffer an empty one, whatever it was.
    ///
    /// # Safety
    /// `to` is null, or points to a buffer that nobody else uses.
    pub(crate) unsafe fn clear(to: *mut Self) -> Result<(), Failure> {
        // SAFETY: the same contract.
        unsafe { pointers::store(to, Self::EMPTY, "the buffer") }
    }

    /// Hands bytes to the caller.
    ///
    /// # Safety
    /// As of [`Buffer::clear`].
    pub(crate) unsafe fn fill(to: *mut Self, bytes: Vec<u8>) -> Result<(), Failure> {
        let bytes = Box::leak(bytes.into_boxed_slice());
        let buffer = Self { data: bytes.as_mut_ptr(), size: bytes.len() };
        // SAFETY: the same contract.
        unsafe { pointers::store(to, buffer, "the buffer") }
    }
}
