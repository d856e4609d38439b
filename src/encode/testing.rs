//! What unit tests of the encoder encode.

use super::options::Tune;
use super::progress::unobserved;
use super::source::Source;
use super::tiled_source::TiledSource;
use crate::color::ColorModel;
use crate::gaussian::{Gaussian, Parameterization};

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

/// The quartic kernel of a Gaussian at a point, in f64.
pub(crate) fn weight(gaussian: &Gaussian, [x, y]: [f64; 2]) -> f64 {
    let [l11, l21, l22] = gaussian.cholesky.map(f64::from);
    let u = (x - f64::from(gaussian.center[0])) / l11;
    let v = (y - f64::from(gaussian.center[1]) - l21 * u) / l22;
    (1.0 - (u * u + v * v) / 4.0).max(0.0).powi(2)
}

/// The residual of a sample of 8 bits, clamped as the output is.
pub(crate) fn residual(value: f32, sample: u8) -> f64 {
    let residual = f64::from(value) - f64::from(sample) / 255.0;
    match sample {
        0 => residual.max(0.0),
        255 => residual.min(0.0),
        _ => residual,
    }
}
