//! The decoder without `std`, in a crate that brings its own panic handler and allocator.
//!
//! If `std` leaked into `image-gip`, there would be two panic handlers and this would not build.

#![no_std]

extern crate alloc;

use alloc::vec;
use core::alloc::{GlobalAlloc, Layout};

use image_gip::{RenderOptions, StreamDecoder};

/// An allocator that has no memory: the library is linked here, never run.
struct NoMemory;

// SAFETY: a null pointer is how an allocator says that it has no memory.
unsafe impl GlobalAlloc for NoMemory {
    unsafe fn alloc(&self, _: Layout) -> *mut u8 {
        core::ptr::null_mut()
    }

    unsafe fn dealloc(&self, _: *mut u8, _: Layout) {}
}

#[global_allocator]
static ALLOCATOR: NoMemory = NoMemory;

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

/// Decodes a file of `length` bytes at `bytes` and returns its first sample, or -1.
///
/// # Safety
/// `bytes` points to `length` readable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gip_first_sample(bytes: *const u8, length: usize) -> i32 {
    // SAFETY: the caller's promise.
    let bytes = unsafe { core::slice::from_raw_parts(bytes, length) };
    first_sample(bytes).map_or(-1, i32::from)
}

fn first_sample(bytes: &[u8]) -> Option<u8> {
    let mut decoder = StreamDecoder::new();
    decoder.feed(bytes).ok()?;
    let picture = decoder.picture()?;
    let options = RenderOptions::new();
    let mut pixels = vec![0; picture.output_len(&options).ok()?];
    picture.render_u8(&options, &mut pixels).ok()?;
    pixels.first().copied()
}
