//! What of a picture's metadata is kept, and what is told when the picture has been changed.

mod edit;
mod exif;
mod icc;
mod policy;
mod xmp;

pub use policy::{MetadataLoss, MetadataPolicy};
