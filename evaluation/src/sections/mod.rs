//! One module per section of the report, and modules that sections share. `measure` of a section
//! measures what the stores lack and returns the section's text.
//!
//! There are only declarations here, so that no module has to import its parent.

pub(crate) mod ablation;
pub(crate) mod decode;
mod growth;
mod handmade;
mod levels;
mod methods;
mod positions;
mod product_tests;
pub(crate) mod rate;
pub(crate) mod representation;
pub(crate) mod scene;
pub(crate) mod speed;
pub(crate) mod stability;
