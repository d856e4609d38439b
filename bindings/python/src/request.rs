//! What to render, in the words of the caller.

use image_gip::{ColorModel, DecodeError, Header, Region, RenderOptions};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::background::{Background, Channels};
use crate::numbers::{Integer, Real, shown};

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
    pub(crate) size: Option<(Integer<'py>, Integer<'py>)>,
    pub(crate) scale: Option<Real>,
    pub(crate) region: Option<(Integer<'py>, Integer<'py>, Integer<'py>, Integer<'py>)>,
    pub(crate) mode: Option<&'a str>,
    pub(crate) background: Option<&'a Bound<'py, PyAny>>,
    /// Whether the result is one plane per channel.
    pub(crate) planar: bool,
    pub(crate) dtype: Option<&'a Bound<'py, PyAny>>,
    pub(crate) out: Option<&'a Bound<'py, PyAny>>,
    /// Render only the first Gaussians of the file.
    pub(crate) prefix: Option<Integer<'py>>,
    pub(crate) texture: bool,
    pub(crate) threads: usize,
}

/// A request that was checked.
#[derive(Debug)]
pub(crate) struct Rendering {
    scale: Option<f64>,
    mode: Option<ColorModel>,
    background: Option<Background>,
    planar: bool,
    options: RenderOptions,
    pub(crate) threads: usize,
}

impl Request<'_, '_> {
    /// Refuses numbers and names that are out of range.
    pub(crate) fn check(&self) -> PyResult<Rendering> {
        let mut options = RenderOptions::new().with_texture(self.texture);
        let most = RenderOptions::MAX_OUTPUT_SIDE;
        let side = |name: &str, side: &Integer<'_>| side.within(name, 1..=most);
        if let Some((width, height)) = &self.size {
            if self.scale.is_some() {
                return Err(PyTypeError::new_err("size and scale exclude each other"));
            }
            options = options.with_size(side("size", width)?, side("size", height)?);
        }
        let scale = self.scale.map(|Real(scale)| scale);
        if let Some(scale) = scale
            && !(scale.is_finite() && scale > 0.0)
        {
            let scale = shown(scale);
            return Err(PyValueError::new_err(format!("scale {scale}; it must be over 0")));
        }
        if let Some((x, y, width, height)) = &self.region {
            let place = |place: &Integer<'_>| place.within("region", 0..=most - 1);
            let (x, y) = (place(x)?, place(y)?);
            let (width, height) = (side("region", width)?, side("region", height)?);
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
        if let Some(prefix) = &self.prefix {
            options = options.with_prefix(prefix.within("prefix", 0..=u32::MAX)?);
        }
        Ok(Rendering {
            scale,
            mode,
            background,
            planar: self.planar,
            options,
            threads: self.threads,
        })
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
        let (background, planar) = (self.background.as_ref(), self.planar);
        Ok(Channels { rendered, returned, drops_alpha, background, planar })
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
