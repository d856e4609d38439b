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
//! to the last bit, so all machines show the same samples. Version 1 of the format may still be
//! corrected until its first release; from then on it stays as it is.
//!
//! # Encode and decode
//!
//! ```
//! # #[cfg(not(feature = "encode"))]
//! # fn main() {}
//! # #[cfg(feature = "encode")]
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use image_gip::{ColorModel, Encoder, Samples, Source, Target};
//!
//! let pixels: Vec<u8> = (0..32 * 24).map(|i| (i / 4) as u8).collect();
//! let file = image_gip::encode(32, 24, ColorModel::Gray, &pixels)?;
//!
//! let picture = image_gip::decode(&file)?;
//! assert_eq!((picture.header.width, picture.header.height), (32, 24));
//! assert!(matches!(picture.samples, Samples::Eight(samples) if samples.len() == pixels.len()));
//!
//! // The same with options.
//! let source = Source::new_u8(32, 24, ColorModel::Gray, &pixels)?;
//! let encoded = Encoder::new().with_target(Target::Gaussians(20)).encode(&source)?;
//! assert!(encoded.report.gaussians <= 20);
//! # Ok(())
//! # }
//! ```
//!
//! # Which decoder
//!
//! | | takes | layers are decoded | for a region of a large picture |
//! | --- | --- | --- | --- |
//! | [`decode`](decode()) | a whole file in memory | on many threads | - |
//! | `Decoder` | any `Read` | on many threads, when an output needs them | skips layers that do not show |
//! | [`StreamDecoder`] | bytes as they arrive, in pieces of any size | as they arrive, on the caller's thread | decodes all layers |
//!
//! `Decoder` needs the feature `std`. Work is shared among the [`Threads`] of the options; the result
//! does not depend on them.
//!
//! # Where to find what
//!
//! - **Decoding:** the three above. [`Limits`] bounds what a file may cost; [`DecodeError`] says what
//!   was wrong. [`Header`] and [`Metadata`] are what the file says of its picture.
//! - **Rendering:** [`Picture`] is a header and the Gaussians so far; [`RenderOptions`] says at
//!   which size, which [`Region`], and in which [`ColorModel`].
//! - **The model:** [`Gaussian`], its stored shape ([`Parameterization`]), the [`Kernel`], and the
//!   [`Quantizer`]s or [`LatticeSteps`] between codes and values.
//! - **Encoding** (feature `encode`): [`encode`](encode()), or an `Encoder`, which fits a `Source` to
//!   a `Target` and returns the file with a `Report`.
//! - **The `image` crate** (feature `image`): `register` makes `image::open` read `.gip`.
//!
//! # What may change
//!
//! Three things are for those who study the method, and are outside of what a release promises to
//! keep: the modules `training` and `metrics`, and
//! [`RenderOptions::with_reference`].
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
mod chunk;
#[cfg(feature = "decode")]
mod coding;
#[cfg(feature = "decode")]
mod color;
#[cfg(feature = "decode")]
mod container;
#[cfg(feature = "decode")]
mod decode;
#[cfg(feature = "encode")]
mod encode;
#[cfg(feature = "decode")]
mod error;
#[cfg(feature = "decode")]
mod gaussian;
#[cfg(feature = "image")]
mod image;
#[cfg(feature = "decode")]
mod kernel;
#[cfg(feature = "decode")]
mod layers;
#[cfg(feature = "decode")]
mod limits;
#[cfg(feature = "decode")]
mod math;
#[cfg(feature = "encode")]
pub mod metrics;
#[cfg(feature = "decode")]
mod region;
#[cfg(feature = "decode")]
mod render;
#[cfg(feature = "decode")]
mod simd;
#[cfg(all(test, feature = "decode"))]
mod testing;
#[cfg(feature = "decode")]
mod threads;

#[cfg(all(feature = "encode", feature = "image"))]
pub use crate::image::GipEncoder;
#[cfg(feature = "image")]
pub use crate::image::{GipDecoder, register};
#[cfg(feature = "decode")]
pub use chunk::ChunkType;
#[cfg(feature = "decode")]
pub use coding::entropy::{AttributeBits, LatticeSteps};
#[cfg(feature = "decode")]
pub use coding::packed::{Quantizer, UniformQuantizer};
#[cfg(feature = "decode")]
pub use color::{ColorModel, SampleDepth};
#[cfg(feature = "encode")]
pub use container::MetadataError;
#[cfg(feature = "decode")]
pub use container::{Coding, Header, Metadata, Text};
#[cfg(feature = "std")]
pub use decode::Decoder;
#[cfg(feature = "decode")]
pub use decode::{ChunkStatistics, Decoded, Samples, StreamDecoder, decode};
#[cfg(feature = "encode")]
pub use encode::{
    EncodeError, Encoded, Encoder, OptionError, Precision, Progress, Report, Shortfall, Source,
    SourceError, Target, encode,
};
#[cfg(feature = "decode")]
pub use error::{DecodeError, LimitKind, Reason, RequestError, Unsupported};
#[cfg(feature = "decode")]
pub use gaussian::{Gaussian, Parameterization};
#[cfg(feature = "decode")]
pub use kernel::Kernel;
#[cfg(feature = "decode")]
pub use limits::Limits;
#[cfg(feature = "decode")]
pub use region::Region;
#[cfg(feature = "decode")]
pub use render::{Picture, RenderOptions};
#[cfg(feature = "decode")]
pub use threads::Threads;

#[cfg(all(fuzzing, feature = "encode"))]
pub use coding::entropy::fuzzing;

#[cfg(feature = "encode")]
pub mod training {
    //! The constants of training, for those who study the method: see [`Training`].

    pub use crate::encode::training::{
        Densification, Distortion, GaussianFilter, LearningRateSchedule, NewColor, NewShape,
        Optimizer, Placement, Portion, Quantization, Training, Units,
    };
}
