//! The encoder of the npm package `image-gip`, as WebAssembly: a module of its own, which a page loads only when
//! it encodes.
//!
//! `js/encoder-core.js` is its interface; what is here is for that alone.

#[cfg(all(target_arch = "wasm32", not(target_feature = "simd128")))]
compile_error!("without the flags of .cargo/config.toml, encoding takes many times as long");
#[cfg(target_feature = "relaxed-simd")]
compile_error!("relaxed SIMD may fuse operations, and the files would depend on the browser");

mod encoder;
mod js;
