//! One module per section of the report, and modules that sections share. `measure` of a section
//! measures what the stores lack and returns the section's text.
//!
//! There are only declarations here, so that no module has to import its parent.

pub(crate) mod ablation;
pub(crate) mod content;
pub(crate) mod decode;
mod f64_renderer;
mod float_file;
mod growth;
mod methods;
mod printed;
mod product_tests;
mod published_codecs;
mod quantizers;
pub(crate) mod rate;
pub(crate) mod representation;
mod residual_vq;
pub(crate) mod speed;
pub(crate) mod stability;
mod two_level;
