//! Files of Gaussians that come from elsewhere.

use core::ops::ControlFlow;

use super::encoder::on_threads;
use super::error::{OptionError, Result, WriteError};
use super::file::FileLayout;
use super::fit::quantizers_for;
use super::loss::ColorCurvature;
use super::options::Precision;
use super::progress::Observer;
use super::rate_model;
use super::rdo;
use super::texture;
use super::verify;
use crate::coding::entropy::{
    CenterGrid, Code, MOST_CODE, Quantization, QuantizationSteps, QuantizedCodes,
};
use crate::coding::packed::{PackedCodes, Quantizer};
use crate::container::{Header, Metadata};
use crate::error::PictureError;
use crate::gaussian::{CENTER, Gaussian, MAX_COMPONENTS, MAX_GAUSSIANS, SHAPE};
use crate::kernel::Kernel;
use crate::limits::Limits;
use crate::render;
use crate::texture::Texture;
use crate::threads::Threads;

/// The least and the largest step of colour.
const COLOR_STEPS: (f32, f32) = (1e-6, 1000.0);

/// Writes Gaussians that come from elsewhere to a file: those of another method, or of another file. Nothing is
/// fitted. By default it stores floats, which lose nothing.
///
/// ```
/// use image_gip::{ColorModel, Gaussian, Header, Limits, Picture, RenderOptions, Writer};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let header = Header::new(64, 48, ColorModel::Gray);
/// let spot = Gaussian { center: [20.0, 30.0], cholesky: [6.0, 2.0, 3.0], color: [0.8, 0.0, 0.0, 0.0] };
/// let gaussians = [spot];
///
/// let limits = Limits::default();
/// let picture = Picture::from_gaussians(&header, &gaussians, &limits)?;
/// let mut samples = vec![0; 64 * 48];
/// picture.render_u8(&RenderOptions::new(), &mut samples)?;
///
/// let file = Writer::new(header).write(&gaussians)?;
/// assert_eq!(image_gip::decode(&file)?.header.gaussians, 1);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Writer {
    header: Header,
    precision: Precision,
    quantizers: Option<Vec<Quantizer>>,
    bit_depths: [u8; 3],
    color_step: f32,
    steps: Option<QuantizationSteps>,
    texture: Vec<Gaussian>,
    metadata: Metadata,
    first_layer: Option<u32>,
    limits: Limits,
    threads: Threads,
}

impl Writer {
    /// A writer for pictures with this header, of which size, colour model, depth, kernel, base colour and,
    /// unless the precision is [`Precision::Entropy`], the parameterization are stored: see [`Header::new`].
    #[must_use]
    pub fn new(header: Header) -> Self {
        Self {
            header,
            precision: Precision::Float,
            quantizers: None,
            bit_depths: [12, 10, 6],
            color_step: 0.02,
            steps: None,
            texture: Vec::new(),
            metadata: Metadata::default(),
            first_layer: None,
            limits: Limits::default(),
            threads: Threads::default(),
        }
    }

    /// Sets how Gaussians are stored. Default: [`Precision::Float`].
    #[must_use]
    pub fn with_precision(self, precision: Precision) -> Self {
        Self { precision, ..self }
    }

    /// Sets the quantizers of [`Precision::Packed`]: one for each component of the header's parameterization, in
    /// the order x, y, three of shape, channels ([`Header::components`]). By default their scales and offsets
    /// cover the values of all Gaussians, as those with which LSQ+ begins (paper, section "Compression
    /// Framework"), and may clip the strongest colours.
    #[must_use]
    pub fn with_quantizers(self, quantizers: Vec<Quantizer>) -> Self {
        Self { quantizers: Some(quantizers), ..self }
    }

    /// Sets the bit depths of the default quantizers for position, shape and colour, each 1 to 16. Default: 12, 10
    /// and 6, those of the paper.
    #[must_use]
    pub fn with_bit_depths(self, position: u8, shape: u8, color: u8) -> Self {
        Self { bit_depths: [position, shape, color], ..self }
    }

    /// Sets the step of colour of [`Precision::Entropy`], 10^-6 to 1000, which is rounded to one that a file can have:
    /// the difference of amplitudes of neighbouring codes (1.0 is a full sample), times the geometric mean of the
    /// Gaussian's l11 and l22 in pixels. Those of strong Gaussians are finer in position and shape. Default: 0.02.
    #[must_use]
    pub fn with_color_step(self, step: f32) -> Self {
        Self { color_step: step, ..self }
    }

    /// Sets all steps of [`Precision::Entropy`], in place of a step of colour: those of a file
    /// ([`StreamDecoder::quantization_steps`](crate::StreamDecoder::quantization_steps)), so that its Gaussians, and
    /// others that are on its grid, are stored as they are.
    #[must_use]
    pub fn with_steps(self, steps: QuantizationSteps) -> Self {
        Self { steps: Some(steps), ..self }
    }

    /// Sets the Gaussians of a texture's map ([`Picture::texture_map`](crate::Picture::texture_map)), which are rounded
    /// with a quarter of the step of colour. Default: none, for a picture without texture.
    #[must_use]
    pub fn with_texture(self, gaussians: Vec<Gaussian>) -> Self {
        Self { texture: gaussians, ..self }
    }

    /// Sets the metadata to store. Default: none.
    #[must_use]
    pub fn with_metadata(self, metadata: Metadata) -> Self {
        Self { metadata, ..self }
    }

    /// As [`Encoder::with_first_layer`](crate::Encoder::with_first_layer), with [`Precision::Entropy`].
    #[must_use]
    pub fn with_first_layer(self, bytes: Option<u32>) -> Self {
        Self { first_layer: bytes, ..self }
    }

    /// As [`Encoder::with_limits`](crate::Encoder::with_limits): what a decoder with these limits would refuse is not
    /// written. Default: [`Limits::default`].
    #[must_use]
    pub fn with_limits(self, limits: Limits) -> Self {
        Self { limits, ..self }
    }

    /// Sets the threads that work. The file does not depend on them.
    #[must_use]
    pub fn with_threads(self, threads: Threads) -> Self {
        Self { threads, ..self }
    }

    /// A file of these Gaussians, in the order that its coding has: the strongest first, so that every prefix is a
    /// picture. Of those that do not show in the picture, [`Precision::Entropy`] leaves out all, as it has no codes
    /// for some.
    ///
    /// # Errors
    /// When an option is out of range, for the first Gaussian that the format would not draw, before or after
    /// rounding, or that has no code, and when the limits are exceeded.
    pub fn write(&self, gaussians: &[Gaussian]) -> Result<Vec<u8>, WriteError> {
        let file = self.unlimited(gaussians)?;
        verify::check_written(&file, &self.limits)?;
        Ok(file)
    }

    /// A file that a decoder with the limits may refuse.
    fn unlimited(&self, gaussians: &[Gaussian]) -> Result<Vec<u8>, WriteError> {
        self.header.check()?;
        render::check(gaussians, MAX_GAUSSIANS)?;
        self.metadata.check().map_err(OptionError::Metadata)?;
        let quantization = self.quantization()?;
        let texture = self.texture(&quantization)?;
        let layout = FileLayout::of(self.header.clone(), &self.metadata);
        let layout = layout.with_texture(texture.as_deref());
        if self.precision == Precision::Entropy {
            let layout = layout.with_first_layer(self.first_layer);
            layout.check_first_layer()?;
            let write = || self.write_entropy(&layout, quantization, gaussians);
            return on_threads(self.threads, write)?;
        }
        let quantizers = match (self.precision, &self.quantizers) {
            (Precision::Packed, Some(quantizers)) => quantizers.clone(),
            (Precision::Packed, None) => {
                if !self.bit_depths.iter().all(|bits| (1..=16).contains(bits)) {
                    return Err(WriteError::Quantizers("bit depths must be 1 to 16"));
                }
                quantizers_for(&self.components(gaussians), &self.header, self.bit_depths)
            }
            _ => vec![Quantizer::Float; self.header.components()],
        };
        Ok(layout.write_packed(&self.packed(gaussians, quantizers)?))
    }

    /// The quantization grid of the entropy coding.
    fn quantization(&self) -> Result<Quantization, WriteError> {
        let channels = self.header.color.channels();
        if let Some(steps) = &self.steps {
            return Quantization::of_steps(steps, channels).ok_or(WriteError::Steps);
        }
        let step = self.color_step;
        if !(COLOR_STEPS.0..=COLOR_STEPS.1).contains(&step) {
            return Err(WriteError::ColorStep(step));
        }
        Ok(rate_model::quantization(f64::from(step).log2(), &[1.0; 4][..channels]))
    }

    /// The payload of the texture's map; `None` without texture.
    fn texture(&self, quantization: &Quantization) -> Result<Option<Vec<u8>>, WriteError> {
        let map = Texture::map_header(&self.header);
        let step = f64::from(quantization.color[0]) * texture::STEP;
        let quantization = rate_model::quantization(step.log2(), &[1.0; 3]);
        render::check(&self.texture, MAX_GAUSSIANS).map_err(WriteError::Texture)?;
        let mut codes =
            codes_of(&self.texture, &map, &quantization).map_err(WriteError::Texture)?;
        let (found, allowed) = (codes.len(), map.width.saturating_mul(map.height));
        if found > allowed as usize {
            return Err(WriteError::Texture(PictureError::Count { found, allowed }));
        }
        let step = quantization.color[0];
        Ok((!codes.is_empty()).then(|| Texture::to_payload(&mut codes, step, &self.header)))
    }

    /// The values of the components of Gaussians.
    fn components(&self, gaussians: &[Gaussian]) -> Vec<[f32; MAX_COMPONENTS]> {
        let components = |gaussian: &Gaussian| {
            let mut values = [0.0; MAX_COMPONENTS];
            values[CENTER].copy_from_slice(&gaussian.center);
            values[SHAPE]
                .copy_from_slice(&self.header.parameterization.shape_of(gaussian.cholesky));
            values[SHAPE.end..].copy_from_slice(&gaussian.color);
            values
        };
        gaussians.iter().map(components).collect()
    }

    /// The codes of Gaussians with some quantizers.
    fn packed(
        &self,
        gaussians: &[Gaussian],
        quantizers: Vec<Quantizer>,
    ) -> Result<PackedCodes, WriteError> {
        if quantizers.len() != self.header.components() {
            return Err(WriteError::Quantizers("there must be one for each component"));
        }
        if !quantizers.iter().all(Quantizer::is_valid) {
            return Err(WriteError::Quantizers(
                "bit depths must be 1 to 16, scales over 0 and at most 2^32, offsets within +-2^32",
            ));
        }
        let mut codes = Vec::with_capacity(gaussians.len());
        for (index, values) in self.components(gaussians).into_iter().enumerate() {
            let (mut of_gaussian, mut rounded) = ([0; MAX_COMPONENTS], [0.0; MAX_COMPONENTS]);
            for (at, quantizer) in quantizers.iter().enumerate() {
                of_gaussian[at] = quantizer.code(values[at]);
                rounded[at] = quantizer.value(of_gaussian[at]);
            }
            let rounded = &rounded[..quantizers.len()];
            let rounded = Gaussian::from_components(rounded, self.header.parameterization);
            if rounded.flaw().is_some() {
                let rule = "rounded by the quantizers, its covariance is not positive definite";
                return Err(PictureError::Gaussian { index, rule }.into());
            }
            codes.push(of_gaussian);
        }
        Ok(PackedCodes { quantizers, codes })
    }

    /// An entropy-coded file of Gaussians, rounded to the quantization grid.
    fn write_entropy(
        &self,
        layout: &FileLayout<'_>,
        quantization: Quantization,
        gaussians: &[Gaussian],
    ) -> Result<Vec<u8>, WriteError> {
        if self.header.kernel != Kernel::Quartic {
            return Err(PictureError::Header("the entropy coding needs the quartic kernel").into());
        }
        let codes = codes_of(gaussians, &self.header, &quantization)?;
        let mut callback = |_: &_| ControlFlow::Continue(());
        let mut observer = Observer::new(&mut callback, 0);
        let coded = layout.coded(QuantizedCodes { quantization, codes }, &mut observer);
        let file = coded.and_then(|coded| layout.write_entropy(&coded, &mut observer));
        Ok(file.expect("nobody cancels"))
    }
}

/// The codes of those Gaussians that show in a picture, on a quantization grid.
fn codes_of(
    gaussians: &[Gaussian],
    header: &Header,
    quantization: &Quantization,
) -> Result<Vec<Code>, PictureError> {
    let (size, color) = ([header.width, header.height], header.color);
    let grid = CenterGrid::new(size[0], size[1]);
    let curvature = ColorCurvature::of_squared_error(color);
    let rounded = |gaussian: &Gaussian| {
        let exponent = rate_model::step_exponent(gaussian, 1.0, &curvature, quantization, color);
        quantization.code(gaussian, exponent, &grid, color)
    };
    let mut codes = Vec::with_capacity(gaussians.len());
    for (index, gaussian) in gaussians.iter().enumerate() {
        if !rdo::is_seen(gaussian, size) {
            continue;
        }
        let exact = quantization.exact_code(gaussian, &grid, color);
        let code = exact.unwrap_or_else(|| rounded(gaussian));
        if let Some(rule) = without_code(gaussian, &code, &grid) {
            return Err(PictureError::Gaussian { index, rule });
        }
        codes.push(code);
    }
    Ok(codes)
}

/// Why a Gaussian is not the one that a code, the nearest to it, stands for.
fn without_code(gaussian: &Gaussian, code: &Code, grid: &CenterGrid) -> Option<&'static str> {
    let is_inside = |axis: usize| {
        let nearest = grid.center(grid.units(gaussian.center))[axis];
        (nearest - gaussian.center[axis]).abs() <= 1.0
    };
    let is_within = |code: &i32| code.abs() < MOST_CODE as i32;
    let rules = [
        (
            (0..2).all(is_inside),
            "its centre is so far outside of the picture that the entropy coding has no code for it",
        ),
        (
            [code.size, code.ratio, code.slant].iter().all(is_within),
            "its shape is too long for the entropy coding",
        ),
        (code.color.iter().all(is_within), "its colour is too strong for this step"),
    ];
    rules.into_iter().find(|(holds, _)| !holds).map(|(_, rule)| rule)
}
