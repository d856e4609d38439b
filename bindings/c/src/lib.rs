//! The C library of the image format `.gip`. What is public here is what `include/gip.h` declares, in the
//! same words: cbindgen makes the header of these files, and `make header` writes it.
//!
//! All unsafe code of the project is here. It relies on what the header asks of callers: a pointer that is
//! not null points to what the header says, for as long as it says. What can be checked, is: null pointers,
//! alignment, sizes, numbers and flags.

// The header has things in the order of these modules.
mod abi;
mod status;
mod version;

mod buffer;
mod limits;

mod decoder;
mod gaussians;
mod info;
mod metadata;

mod output;
mod render;
mod view;

mod encode;
mod prefix;
mod progress;
mod source;

mod pointers;
mod strings;
mod structures;
mod threads;

#[cfg(test)]
mod tests;
