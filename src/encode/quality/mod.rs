//! An estimate of the visual quality of a rendering, on the scale of SSIMULACRA2.
//!
//! SSIMULACRA2 (<https://github.com/cloudinary/ssimulacra2>) adds up 108 norms of differences in three
//! channels on six scales, with weights that were fitted to ratings by people. The estimate has all norms
//! whose weight is not 0, with a window of fixed size in place of a recursive filter. A picture with alpha is
//! judged over black and over white; the metric takes a darker and a lighter gray.
//!
//! Of small pictures the metric says little: what is near a border hardly counts, and with fewer than six
//! scales its channels have weights that were fitted for others. Noise of 8 x 8 pixels may have quality 75
//! with a PSNR of 11 dB. So a small picture must reach the quality that is asked for among its mirror
//! images as well, as a part of a large one. The reported quality is that of the metric down to its least
//! size, 8 x 8, and below that the one among mirror images.

mod blotches;
mod difference;
mod judge;
mod light;
mod norms;
mod pyramid;
mod scales;
mod smooth;

pub(crate) use judge::{Judge, Judgement, MOST_QUALITY, Verdict, count_for, memory};
pub(crate) use smooth::Gradients;
