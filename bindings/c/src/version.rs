//! Which library this is, and whether bytes are for it.

use core::ffi::{c_char, c_int, c_void};
use std::panic;

use image_gip::{DecodeError, StreamDecoder};

use crate::abi::GIP_ABI_VERSION;
use crate::pointers;

/// The version of the library that this header belongs to: the first of its three numbers.
pub const GIP_VERSION_MAJOR: u32 = 0;
/// The second number.
pub const GIP_VERSION_MINOR: u32 = 9;
/// The third number.
pub const GIP_VERSION_PATCH: u32 = 0;

/// The number in a text.
const fn number(digits: &str) -> u32 {
    match u32::from_str_radix(digits, 10) {
        Ok(number) => number,
        Err(_) => panic!("a version is three numbers"),
    }
}

const _: () = assert!(GIP_VERSION_MAJOR == number(env!("CARGO_PKG_VERSION_MAJOR")));
const _: () = assert!(GIP_VERSION_MINOR == number(env!("CARGO_PKG_VERSION_MINOR")));
const _: () = assert!(GIP_VERSION_PATCH == number(env!("CARGO_PKG_VERSION_PATCH")));

/// Bytes that tell whether a file is one of this format.
const SIGNATURE: usize = 8;

/// Returns the version of the binary interface of the library that runs, which is GIP_ABI_VERSION of its
/// header. A program that loads the library by itself compares the two.
#[unsafe(no_mangle)]
pub extern "C" fn gip_abi_version() -> u32 {
    GIP_ABI_VERSION
}

/// Returns the version of the library that runs, such as "1.2.3". The text is never freed.
#[unsafe(no_mangle)]
pub extern "C" fn gip_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

/// Returns 1 if a file that begins with these bytes is a .gip file, of any version, and 0 if it is none or
/// if there are fewer than 8 bytes, or `data` is null. More than 8 are not looked at.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gip_is_gip(data: *const c_void, size: usize) -> c_int {
    let begins = || {
        // SAFETY: the caller passes so many bytes.
        let bytes = unsafe { pointers::bytes(data, size, "data") }.unwrap_or_default();
        let signature = bytes.get(..SIGNATURE)?;
        let fed = StreamDecoder::new().feed(signature);
        Some(!matches!(fed, Err(DecodeError::Signature)))
    };
    c_int::from(panic::catch_unwind(begins).ok().flatten().unwrap_or_default())
}
