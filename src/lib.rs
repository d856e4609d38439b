#![cfg_attr(not(feature = "std"), no_std)]
// The encoder needs `std` anyway; what works without it says so in its imports.
#![cfg_attr(
    not(feature = "encode"),
    warn(clippy::alloc_instead_of_core, clippy::std_instead_of_alloc, clippy::std_instead_of_core)
)]
// The README's code is compiled with the documentation's.
#![cfg_attr(all(doctest, feature = "encode"), doc = include_str!("../README.md"))]

//! `.gip`: pictures made of 2D Gaussians.
//!
//! A `.gip` file holds a few thousand Gaussians, each with a centre, a covariance and a colour,
//! that add up to a picture (the representation of GaussianImage++). It has no pixels until it is
//! rendered: at any size and in any part, at a cost that follows the output. Any prefix of the
//! file that reaches beyond its header is a picture already. The decoder's arithmetic is specified
//! to the last bit, so all machines show the same samples, and the format (version 1) stays as it
//! is.
//!
//! # Encode and decode
//!
//! ```
//! # #[cfg(not(feature = "encode"))]
//! # fn main() {}
//! # #[cfg(feature = "encode")]
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use image_gip::{ColorModel, Decoder, Encoder, Source, Target};
//!
//! let pixels: Vec<u8> = (0..32 * 24).map(|i| (i / 4) as u8).collect();
//! let source = Source::new_u8(32, 24, ColorModel::Gray, &pixels)?;
//! let encoded = Encoder::new().with_target(Target::Gaussians(20)).encode(&source)?;
//!
//! let mut decoder = Decoder::new(encoded.bytes.as_slice())?;
//! assert_eq!((decoder.header().width, decoder.header().height), (32, 24));
//! let mut decoded = vec![0; decoder.output_len().expect("a small picture")];
//! decoder.decode_into(&mut decoded)?;
//! # Ok(())
//! # }
//! ```
//!
//! # Where to find what
//!
//! - **Decoding:** [`StreamDecoder`] takes bytes as they arrive and does no I/O; `Decoder` wraps
//!   it around any `Read`. [`Limits`] bounds what a file may cost; [`DecodeError`] says what was
//!   wrong. [`Header`] and [`Metadata`] are what the file says of its picture.
//! - **Rendering:** [`Picture`] is a header and the Gaussians so far; [`RenderOptions`] says at
//!   which size, which [`Region`], and in which [`ColorModel`].
//! - **The model:** [`Gaussian`], its stored shape ([`Chart`]), the [`Kernel`], and the
//!   [`Quantizer`]s between codes and values.
//! - **Encoding** (feature `encode`): `Encoder` fits a `Source` to a `Target` and returns the file
//!   with a `Report`; `metrics` compares pictures.
//! - **The `image` crate** (feature `image`): `register` makes `image::open` read `.gip`.
//!
//! # Features
//!
//! | feature | default | what it adds |
//! | --- | --- | --- |
//! | `decode` | yes | the decoder; alone, it is `no_std` + `alloc` with three small dependencies |
//! | `std` | yes | `Decoder`, and SIMD chosen at run time |
//! | `rayon` | yes | threads in the decoder; the output stays the same bit for bit |
//! | `encode` | yes | the encoder |
//! | `image` | no | hooks and `ImageDecoder` for the `image` crate; with `encode` also `ImageEncoder` |
//! | `cli` | no | the command line tool `gip` |

#[cfg(feature = "decode")]
extern crate alloc;

#[cfg(feature = "decode")]
mod bounds;
#[cfg(feature = "decode")]
mod coding;
#[cfg(feature = "decode")]
mod color;
#[cfg(feature = "decode")]
mod container;
#[cfg(feature = "decode")]
mod decoder;
#[cfg(feature = "encode")]
mod encode;
#[cfg(feature = "decode")]
mod error;
#[cfg(feature = "decode")]
mod gaussian;
#[cfg(feature = "image")]
mod image;
#[cfg(feature = "decode")]
mod lattice;
#[cfg(feature = "decode")]
mod limits;
#[cfg(feature = "decode")]
mod math;
#[cfg(feature = "encode")]
pub mod metrics;
#[cfg(feature = "decode")]
mod quantizer;
#[cfg(feature = "decode")]
mod render;
#[cfg(all(test, feature = "decode"))]
mod testing;
#[cfg(feature = "decode")]
mod threads;

#[cfg(all(feature = "encode", feature = "image"))]
pub use crate::image::GipEncoder;
#[cfg(feature = "image")]
pub use crate::image::{GipDecoder, register};
#[cfg(feature = "decode")]
pub use coding::account::AttributeBits;
#[cfg(feature = "decode")]
pub use color::{ColorModel, SampleDepth};
#[cfg(feature = "decode")]
pub use container::{ChunkType, Coding, Header, Metadata, Text};
#[cfg(all(feature = "decode", feature = "std"))]
pub use decoder::Decoder;
#[cfg(feature = "decode")]
pub use decoder::{ChunkStatistics, StreamDecoder};
#[cfg(feature = "encode")]
pub use encode::{EncodeError, Encoded, Encoder, Precision, Progress, Report, Source, Target};
#[cfg(feature = "decode")]
pub use error::{DecodeError, LimitKind, Reason, Unsupported};
#[cfg(feature = "decode")]
pub use gaussian::{Chart, Gaussian};
#[cfg(feature = "decode")]
pub use limits::Limits;
#[cfg(feature = "decode")]
pub use quantizer::{Quantizer, Steps};
#[cfg(feature = "decode")]
pub use render::{Kernel, Picture, Region, RenderOptions};

#[cfg(all(fuzzing, feature = "encode"))]
pub use coding::fuzzing;

#[cfg(feature = "encode")]
pub mod training {
    //! The constants of training, for those who study the method: see [`Training`].

    pub use crate::encode::training::{
        Densification, Distortion, Filter, NewColor, NewShape, Optimizer, Placement, Portion,
        Quantization, Schedule, Training, Units,
    };
}
