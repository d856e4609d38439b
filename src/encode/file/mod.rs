//! Writing files: codes to layers, layers to chunks (spec, sections 4 to 7).

mod layers;
mod layout;

pub(crate) use layout::{CodedLayers, FileLayout};
