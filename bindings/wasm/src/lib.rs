//! The decoder of the npm package `image-gip`, as WebAssembly.
//!
//! The scripts in `js/` are the package's interface; what is here is for them alone.

mod decoder;
mod errors;
mod layer_extents;
mod objects;
mod request;
mod samples;
