//! The decoder of the npm package `image-gip`, as WebAssembly.
//!
//! The scripts in `js/` are the package's interface; what is here is for them alone.

#[cfg(all(target_arch = "wasm32", not(target_feature = "simd128")))]
compile_error!("without the flags of .cargo/config.toml, decoding takes many times as long");
#[cfg(target_feature = "relaxed-simd")]
compile_error!("relaxed SIMD may fuse operations, but the format specifies every bit");

mod decoder;
mod errors;
mod js;
mod layer_extents;
mod objects;
mod request;
mod samples;
