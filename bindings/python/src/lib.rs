//! The native part of the Python module `image_gip`.
//!
//! Arrays and buffers are borrowed, the interpreter lock is released while the crate works, and
//! nothing is kept between calls: no pool of threads that a `fork` would lose.

mod array;
mod background;
mod decode;
mod encode;
mod errors;
mod given;
mod input;
mod light;
mod metadata;
mod numbers;
mod objects;
mod output;
mod pack;
mod prefix;
mod render;
mod request;
mod stream;
mod threads;

use pyo3::prelude::*;

// No lock of the interpreter guards what is shared: nothing is but `StreamDecoder`, which has a lock of its own.
#[pymodule(gil_used = false)]
mod _native {
    #[pymodule_export]
    use super::decode::{decode, gaussians, info, read_header};
    #[pymodule_export]
    use super::encode::encode;
    #[pymodule_export]
    use super::pack::pack;
    #[pymodule_export]
    use super::prefix::{prefix, prefixes};
    #[pymodule_export]
    use super::render::render;
    #[pymodule_export]
    use super::stream::StreamDecoder;

    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "the name in Python")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
