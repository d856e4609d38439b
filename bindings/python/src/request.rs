//! What to render, in the words of the caller.

use image_gip::{ColorModel, DecodeError, Header, Region, RenderOptions};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::background::{Background, Channels};
use crate::threads;

/// Names of the colour models, as Pillow has them.
const MODES: [(&str, ColorModel); 4] = [
    ("L", ColorModel::Gray),
    ("LA", ColorModel::GrayAlpha),
    ("RGB", ColorModel::Rgb),
    ("RGBA", ColorModel::Rgba),
];

/// The name of a colour model.
pub(crate) fn mode_name(color: ColorModel) -> &'static str {
    MODES.iter().find(|mode| mode.1 == color).map_or("unknown", |mode| mode.0)
}

/// What to render, as the caller asks for it: the keywords that `decode` and `StreamDecoder.image` share.
#[derive(Debug)]
pub(crate) struct Request<'a, 'py> {
    pub(crate) size: Option<(i64, i64)>,
    pub(crate) scale: Option<f64>,
    pub(crate) region: Option<(i64, i64, i64, i64)>,
    pub(crate) mode: Option<&'a str>,
    pub(crate) background: Option<&'a Bound<'py, PyAny>>,
    pub(crate) dtype: Option<&'a Bound<'py, PyAny>>,
    pub(crate) out: Option<&'a Bound<'py, PyAny>>,
    /// Render only the first Gaussians of the file.
    pub(crate) prefix: Option<i64>,
    pub(crate) threads: i64,
}

/// A request that was checked.
#[derive(Debug)]
pub(crate) struct Rendering {
    scale: Option<f64>,
    mode: Option<ColorModel>,
    background: Option<Background>,
    options: RenderOptions,
    pub(crate) threads: usize,
}

impl Request<'_, '_> {
    /// Refuses numbers and names that are out of range.
    pub(crate) fn check(&self) -> PyResult<Rendering> {
        let mut options = RenderOptions::new();
        if let Some((width, height)) = self.size {
            if self.scale.is_some() {
                return Err(PyTypeError::new_err("size and scale exclude each other"));
            }
            options = options.with_size(number("size", width)?, number("size", height)?);
        }
        if let Some(scale) = self.scale
            && !(scale.is_finite() && scale > 0.0)
        {
            return Err(PyValueError::new_err(format!("scale {scale}; it must be over 0")));
        }
        if let Some((x, y, width, height)) = self.region {
            let number = |value| number("region", value);
            let (x, y, width, height) = (number(x)?, number(y)?, number(width)?, number(height)?);
            options = options.with_region(Region { x, y, width, height });
        }
        let mode = self.mode.map(color_model).transpose()?;
        let background = self.background.map(Background::new).transpose()?;
        if let (Some(mode), true) = (mode, background.is_some())
            && mode.has_alpha()
        {
            return Err(PyTypeError::new_err(format!(
                "mode {:?} has alpha, so that there is no background",
                mode_name(mode)
            )));
        }
        if let Some(prefix) = self.prefix {
            options = options.with_prefix(number("prefix", prefix)?);
        }
        let threads = threads::checked(self.threads)?;
        Ok(Rendering { scale: self.scale, mode, background, options, threads })
    }
}

impl Rendering {
    /// The options for a picture. Where alpha is dropped, it is rendered nevertheless.
    pub(crate) fn options(&self, header: &Header) -> RenderOptions {
        let mut options = self.options.clone();
        if let Some(mode) = self.mode {
            options = options.with_color(mode);
        }
        if self.drops_alpha(header) {
            options = options.with_color(header.color);
        }
        let Some(scale) = self.scale else { return options };
        // The cast of a side that is too long saturates, and the decoder refuses it.
        let scaled = |side: u32| (f64::from(side) * scale).round().max(1.0) as u32;
        options.with_size(scaled(header.width), scaled(header.height))
    }

    /// The channels of a picture, as they are rendered and as the caller gets them.
    pub(crate) fn channels(&self, header: &Header) -> Result<Channels<'_>, DecodeError> {
        let rendered = self.options(header).output_color(header)?.channels();
        let drops_alpha = self.drops_alpha(header);
        let returned = match self.mode {
            Some(mode) => mode.channels(),
            None => rendered - usize::from(drops_alpha),
        };
        Ok(Channels { rendered, returned, drops_alpha, background: self.background.as_ref() })
    }

    /// Whether the picture has alpha, and is composed over a background.
    fn drops_alpha(&self, header: &Header) -> bool {
        let drops = match self.mode {
            // Colours are not dropped.
            Some(mode) => !mode.has_alpha() && mode.channels() >= header.color.channels() - 1,
            None => self.background.is_some(),
        };
        header.color.has_alpha() && drops
    }
}

fn color_model(mode: &str) -> PyResult<ColorModel> {
    let known = MODES.iter().find(|known| known.0 == mode).map(|known| known.1);
    known.ok_or_else(|| {
        PyValueError::new_err(format!(
            "mode {mode:?}; it must be \"L\", \"LA\", \"RGB\" or \"RGBA\""
        ))
    })
}

fn number(name: &str, value: i64) -> PyResult<u32> {
    u32::try_from(value).map_err(|_| {
        PyValueError::new_err(format!("{name}: {value}; it must be 0 to {}", u32::MAX))
    })
}
