//! The encoder of the npm package `image-gip` with threads, as WebAssembly: workers of JavaScript, each with an instance
//! of this module on the same memory.
//!
//! `js/encoder-threads.js` starts the workers, and `js/encoder-threads-worker.js` is what they run.

#[cfg(all(target_arch = "wasm32", not(target_feature = "atomics")))]
compile_error!("memory is shared with the flags of build.mjs only");
#[cfg(all(target_arch = "wasm32", not(target_feature = "simd128")))]
compile_error!("without the flags of .cargo/config.toml, encoding takes many times as long");
#[cfg(target_feature = "relaxed-simd")]
compile_error!("relaxed SIMD may fuse operations, and the files would depend on the browser");

#[path = "../../src/encoder.rs"]
mod encoder;
#[path = "../../src/js.rs"]
mod js;
pub mod pool;
