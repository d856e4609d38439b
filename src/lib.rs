#![cfg_attr(not(feature = "std"), no_std)]
// The decoder works without `std`, so it imports from `core` and `alloc`. The encoder needs `std`.
#![cfg_attr(
    not(feature = "encode"),
    warn(clippy::alloc_instead_of_core, clippy::std_instead_of_alloc, clippy::std_instead_of_core)
)]
// The pages of docs.rs say which feature an item needs, beside the one that all need.
#![cfg_attr(docsrs, feature(doc_cfg), doc(auto_cfg(hide(feature = "decode"))))]
// The code in the README is compiled as well.
#![cfg_attr(all(doctest, feature = "encode"), doc = include_str!("../README.md"))]

//! `.gip`: pictures made of 2D Gaussians.
//!
//! A `.gip` file has some thousands of Gaussians, each with a centre, a covariance and a colour,
//! whose sum is a picture (the representation of GaussianImage++). It can be rendered at any size
//! and in any part, at a cost that follows what is shown. Every prefix of the file that
//! includes the header gives a picture, which every layer improves. The decoder's arithmetic is
//! specified to the last bit, so the samples are the same on all machines. Version 1 of the format is
//! fixed: later versions of this crate read its files, and give the same samples.
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
//! | | input | layers are decoded | layers that do not show in a region |
//! | --- | --- | --- | --- |
//! | [`decode`](decode()) | a whole file in memory | in parallel | - (no regions) |
//! | `Decoder` | any `Read` | in parallel, when an output needs them | are skipped |
//! | [`StreamDecoder`] | bytes as they arrive, in pieces of any size | as they arrive, on the caller's thread | are decoded |
//!
//! `Decoder` needs the feature `std`. [`RenderOptions::with_threads`] sets the [`Threads`] that
//! work is shared among; the result does not depend on them.
//!
//! # Where to find what
//!
//! - **Decoding:** the three above. [`Limits`] bounds the memory and the work that a file may take;
//!   [`DecodeError`] says why a file was not decoded. [`Header`] and [`Metadata`] describe the
//!   picture. Sizes, regions and samples are those of the picture as stored, and [`Orientation`]
//!   turns them.
//! - **Rendering:** [`Picture`] is a header with the Gaussians that have arrived; [`RenderOptions`]
//!   has the output size, the [`Region`] and the [`ColorModel`].
//! - **The model:** [`Gaussian`], its stored shape ([`Parameterization`]), the [`Kernel`], and the
//!   [`Quantizer`]s or [`QuantizationSteps`] that relate codes to values.
//! - **Encoding** (feature `encode`): `encode`, or an `Encoder`, which encodes a
//!   `Source` for a `Target` and returns the file with a `Report`.
//! - **Gaussians from elsewhere:** [`Picture::from_gaussians`] renders them, with a [`Header::new`], and `Writer`
//!   (feature `encode`) makes a file of them.
//! - **The `image` crate** (feature `image`): `register` makes `image::open` read `.gip`.
//!
//! # Stability
//!
//! The modules `training` and `metrics` and [`RenderOptions::with_reference`] are for the study of
//! the method. They may change in any release.
//!
//! # Features
//!
//! | feature | default | what it adds |
//! | --- | --- | --- |
//! | `decode` | yes | the decoder; by itself it is `no_std` with `alloc`, and has three small dependencies |
//! | `std` | yes | `Decoder`, and SIMD at the level that the machine supports |
//! | `rayon` | yes | threads in the decoder; the output is the same bit for bit |
//! | `encode` | yes | the encoder |
//! | `metadata` | no | `MetadataPolicy`: what of a picture's metadata to keep |
//! | `image` | no | hooks and an `ImageDecoder` for the `image` crate; with `encode` also an `ImageEncoder` |
//! | `cli` | no | the command line tool `gip` |

// All else needs the decoder, so without it the crate is empty.
#![cfg(feature = "decode")]

extern crate alloc;

mod chunk;
mod coding;
mod color;
mod container;
mod decode;
#[cfg(feature = "encode")]
mod encode;
mod error;
mod gaussian;
#[cfg(feature = "image")]
mod image;
mod kernel;
mod layers;
mod limits;
mod math;
#[cfg(feature = "metadata")]
mod metadata;
#[cfg(feature = "encode")]
pub mod metrics;
mod orientation;
mod region;
mod render;
mod simd;
#[cfg(test)]
mod testing;
mod texture;
mod threads;

#[cfg(all(feature = "encode", feature = "image"))]
pub use crate::image::GipEncoder;
#[cfg(feature = "image")]
pub use crate::image::{GipDecoder, register};
pub use chunk::ChunkType;
pub use coding::entropy::{AttributeBits, QuantizationSteps};
pub use coding::packed::{Quantizer, UniformQuantizer};
pub use color::{ColorModel, SampleDepth};
pub use container::{Cicp, Coding, ContentLight, Header, MasteringDisplay, Metadata, Text};
#[cfg(feature = "encode")]
pub use container::{MetadataError, Prefix, Prefixes};
#[cfg(feature = "std")]
pub use decode::Decoder;
pub use decode::{ChunkStatistics, Decoded, Samples, StreamDecoder, decode};
#[cfg(feature = "encode")]
pub use encode::{
    EncodeError, Encoded, Encoder, Importance, OptionError, Precision, Progress, Report, Shortfall,
    Source, SourceError, Target, Tune, WriteError, Writer, encode,
};
pub use error::{
    DecodeError, LimitKind, PictureError, Reason, RequestError, SkippedChunk, Unsupported,
};
pub use gaussian::{Gaussian, Parameterization};
pub use kernel::Kernel;
pub use limits::Limits;
#[cfg(feature = "metadata")]
pub use metadata::{MetadataLoss, MetadataPolicy};
pub use orientation::Orientation;
pub use region::Region;
pub use render::{Picture, RenderOptions};
pub use threads::Threads;

#[cfg(all(fuzzing, feature = "encode"))]
pub use coding::entropy::fuzzing;

#[cfg(feature = "encode")]
pub mod training {
    //! The constants of training, for the study of the method; see [`Training`].

    pub use crate::encode::training::{
        Adam, Densification, GaussNewton, GaussianFilter, LearningRateSchedule, NewColor, NewShape,
        Optimizer, Placement, Portion, Quantization, Training,
    };
    pub use crate::encode::{CustomPlacement, ErrorMap, ErrorNorm, VectorQuantizer};
}
