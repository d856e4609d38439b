//! What the formats hold: a header, as far as it is known, and Gaussians.

use anyhow::{Result, bail};
use image_gip::{ColorModel, Gaussian, Header, Kernel, SampleDepth};
use serde::{Deserialize, Serialize};

use crate::info::kernel_name;

/// How far apart two descriptions of a covariance may be, in parts of its trace: more than floats are rounded.
const TOLERANCE: f64 = 1e-5;

/// What editors may write before a text in UTF-8.
pub(crate) const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// Gaussians with the header that says how they are shown.
#[derive(Debug)]
pub(crate) struct Spots {
    pub(crate) header: Header,
    pub(crate) gaussians: Vec<Gaussian>,
}

/// What is exported of a picture.
#[derive(Debug)]
pub(crate) struct Model {
    pub(crate) picture: Spots,
    /// The map of the texture.
    pub(crate) texture: Option<Spots>,
}

/// The fields of a header by the names that the formats have for them. What is imported may lack some.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Fields {
    pub(crate) width: Option<u32>,
    pub(crate) height: Option<u32>,
    pub(crate) depth: Option<u8>,
    pub(crate) kernel: Option<String>,
    pub(crate) cutoff: Option<f32>,
    /// In 1/65535 of a full sample, one for each channel.
    pub(crate) base_color: Option<Vec<u16>>,
}

/// What is imported.
#[derive(Debug, Default)]
pub(crate) struct Imported {
    pub(crate) fields: Fields,
    /// Channels of colour; `None` if there are neither Gaussians nor a base colour.
    pub(crate) channels: Option<usize>,
    pub(crate) gaussians: Vec<Gaussian>,
    /// The line of each Gaussian, in formats of lines.
    pub(crate) lines: Vec<usize>,
    /// What is lost.
    pub(crate) warnings: Vec<String>,
}

impl Fields {
    pub(crate) fn of(header: &Header) -> Self {
        Self {
            width: Some(header.width),
            height: Some(header.height),
            depth: Some(header.depth.bits()),
            kernel: Some(kernel_name(header.kernel).to_owned()),
            cutoff: Some(header.kernel.cutoff()),
            base_color: Some(header.base_color[..header.color.channels()].to_vec()),
        }
    }

    /// The header of a picture with so many channels.
    pub(crate) fn header(&self, channels: usize) -> Result<Header> {
        let (Some(width), Some(height)) = (self.width, self.height) else {
            bail!("it does not say the size of the picture: give --size");
        };
        let color = match channels {
            1 => ColorModel::Gray,
            2 => ColorModel::GrayAlpha,
            3 => ColorModel::Rgb,
            4 => ColorModel::Rgba,
            _ => bail!("{channels} channels of colour; there must be 1 to 4"),
        };
        let mut header = Header::new(width, height, color);
        header.depth = match self.depth {
            None | Some(8) => SampleDepth::Eight,
            Some(16) => SampleDepth::Sixteen,
            Some(depth) => bail!("depth {depth}; it must be 8 or 16"),
        };
        header.kernel = kernel(self.kernel.as_deref(), self.cutoff)?;
        if let Some(base) = &self.base_color {
            if base.len() != channels {
                let found = base.len();
                bail!("base_color has {found} numbers, and the Gaussians have {channels} channels");
            }
            header.base_color[..channels].copy_from_slice(base);
        }
        Ok(header)
    }
}

fn kernel(name: Option<&str>, cutoff: Option<f32>) -> Result<Kernel> {
    match (name.unwrap_or("quartic"), cutoff) {
        ("exponential", None) => Ok(Kernel::PAPER),
        ("exponential", Some(cutoff)) => Ok(Kernel::Exponential { cutoff }),
        ("quartic", Some(cutoff)) if cutoff != Kernel::Quartic.cutoff() => {
            bail!("cutoff {cutoff}; that of the quartic kernel is 4")
        }
        ("quartic", _) => Ok(Kernel::Quartic),
        (name, _) => bail!("kernel {name:?}; it must be \"quartic\" or \"exponential\""),
    }
}

/// The Cholesky factor (l11, l21, l22) of a covariance (xx, xy, yy), of itself, or of both if they agree. Whether it
/// is one that the format draws is another question.
pub(crate) fn factor_of(
    covariance: Option<[f64; 3]>,
    factor: Option<[f64; 3]>,
) -> Result<[f32; 3], &'static str> {
    let round = |factor: [f64; 3]| factor.map(|entry| entry as f32);
    match (covariance, factor) {
        (None, None) => Err("there is neither a covariance nor a Cholesky factor"),
        (None, Some(factor)) => Ok(round(factor)),
        (Some([xx, xy, yy]), None) => {
            let l11 = xx.sqrt();
            let l21 = xy / l11;
            let l22 = (yy - l21 * l21).sqrt();
            // The root of a negative number is NaN.
            let is_factor = l11 > 0.0 && l22 > 0.0;
            is_factor
                .then(|| round([l11, l21, l22]))
                .ok_or("the covariance is not positive definite")
        }
        (Some(covariance), Some(factor @ [l11, l21, l22])) => {
            let of_factor = [l11 * l11, l11 * l21, l21 * l21 + l22 * l22];
            let allowed = TOLERANCE * (covariance[0] + covariance[2]);
            let agrees = |(a, b): (f64, f64)| (a - b).abs() <= allowed;
            let agree = of_factor.into_iter().zip(covariance).all(agrees);
            agree
                .then(|| round(factor))
                .ok_or("the covariance and the Cholesky factor do not agree: remove one of them")
        }
    }
}

/// The amplitudes of a Gaussian, from those of its channels.
pub(crate) fn amplitudes(channels: impl IntoIterator<Item = f64>) -> [f32; 4] {
    let mut amplitudes = [0.0; 4];
    for (amplitude, value) in amplitudes.iter_mut().zip(channels) {
        *amplitude = value as f32;
    }
    amplitudes
}
