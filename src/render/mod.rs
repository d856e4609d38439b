//! From Gaussians to samples (spec, section 9).
//!
//! The grid of pixels in which the Gaussians are evaluated is divided into bands of four rows of
//! tiles. [`band`] finds the Gaussians that may show in each band, and prepares its splats;
//! [`tile_lists`] finds those that touch each tile; [`tile`] adds them up; [`area_average`] makes the
//! pixels of a smaller output; [`texture_view`] makes the texture that is added; and [`output`] converts the sums to samples. Threads work on different
//! [`strips`] of the output.

mod area_average;
mod axis;
mod band;
mod footprint;
mod output;
mod picture;
pub(crate) mod range_lists;
#[cfg(feature = "std")]
pub(crate) mod simd_kernel;
pub(crate) mod splat;
mod strips;
mod texture_view;
mod tile;
pub(crate) mod tile_grid;
mod tile_lists;
pub(crate) mod view;

pub use picture::Picture;
#[cfg(feature = "encode")]
pub(crate) use picture::check;
#[cfg(feature = "encode")]
pub(crate) use strips::BAND_HEIGHT;
pub use view::RenderOptions;
