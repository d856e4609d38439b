//! What unit tests of the encoder encode.

use super::options::Tune;
use super::progress::unobserved;
use super::source::Source;
use super::tiled_source::TiledSource;
use crate::color::ColorModel;
use crate::gaussian::Parameterization;

pub(crate) const MODELS: [ColorModel; 4] =
    [ColorModel::Gray, ColorModel::GrayAlpha, ColorModel::Rgb, ColorModel::Rgba];
pub(crate) const PARAMETERIZATIONS: [Parameterization; 3] =
    [Parameterization::Covariance, Parameterization::Cholesky, Parameterization::RotationScale];

/// A source of a width and height.
pub(crate) fn source(size: [usize; 2], model: ColorModel, samples: &[u8]) -> Source<'_> {
    let [width, height] = size.map(|side| side as u32);
    Source::new_u8(width, height, model, samples).expect("the sizes agree")
}

/// A source by tiles, all colours of which count.
pub(crate) fn tiled(source: Source<'_>, tune: Tune) -> TiledSource {
    let source = source.keeping_invisible(true);
    unobserved(|observer| TiledSource::new(&source, tune, observer))
}
