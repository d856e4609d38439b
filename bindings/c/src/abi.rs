//! The version of the binary interface, which `build.rs` reads as well.

/// The version of the binary interface that this header declares. It grows when a program that was
/// compiled with an older header could not use the library, and is the number in the library's soname.
pub const GIP_ABI_VERSION: u32 = 1;
