//! The arguments of the command line, with their help texts.

mod batch;
mod command;
mod decode;
mod encode;
mod gaussians;
mod inspect;
mod keep;
mod limits;
#[cfg(test)]
mod packaged;
mod prefix;
mod transform;
mod values;

pub(crate) use batch::Batch;
pub(crate) use command::{Args, Command};
pub(crate) use decode::Decode;
pub(crate) use encode::Encode;
pub(crate) use gaussians::{Export, GaussianFormat, HeaderArgs, Import};
pub(crate) use inspect::{Compare, Info};
pub(crate) use prefix::Prefix;
pub(crate) use transform::Transform;
