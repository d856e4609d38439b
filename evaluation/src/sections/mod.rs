//! One module per section of the report, and modules that sections share. `measure` of a section
//! measures what the stores lack and returns the section's text.
//!
//! There are only declarations here, so that no module has to import its parent.

pub(crate) mod ablation;
mod codec_curves;
mod comparisons;
pub(crate) mod content;
mod crops;
pub(crate) mod decode;
mod encoding;
mod f64_renderer;
mod float_file;
mod growth;
pub(crate) mod losses;
mod methods;
pub(crate) mod monotony;
pub(crate) mod placeholders;
pub(crate) mod printed;
mod product_tests;
pub(crate) mod quality;
mod quantizers;
mod race;
mod ranges;
pub(crate) mod rate;
mod rate_store;
mod reference;
pub(crate) mod representation;
mod residual_vq;
pub(crate) mod sheet;
pub(crate) mod sizes;
pub(crate) mod speed;
pub(crate) mod stability;
pub(crate) mod summary;
pub(crate) mod texture;
pub(crate) mod training;
mod two_level;
