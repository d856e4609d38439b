//! `pack`.

use image_gip::{Precision, Quantizer, UniformQuantizer, Writer};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::encode::precision as precision_of;
use crate::errors::{warn, write_error};
use crate::given::{Given, HeaderFields, parameterization as parameterization_of};
use crate::light::{DisplayFields, LightFields};
use crate::numbers::{Integer, Real};
use crate::objects::Limits;
use crate::{metadata, threads};

/// Makes a file of Gaussians that come from elsewhere, such as another method or another file. Nothing is fitted.
///
/// The file has them in another order: the strongest come first, so that its beginning is a picture. It depends on
/// the arguments alone, not on the number of threads.
///
/// Args:
///     gaussians, like, width, height, depth, kernel, cutoff, base_color: As for `render`. What a file has beside
///         Gaussians and header, such as texture, is not taken from `like`.
///     precision: How the Gaussians are stored: "f32", floats, which are not rounded; "packed", codes of fixed bit
///         depths; or "entropy", rounded to a grid, for the smallest files, with the quartic kernel only.
///     parameterization: What is stored of a shape with "f32" and "packed": "cholesky" (l11, l21, l22 in pixels),
///         "covariance" (xx, xy, yy in square pixels), or "rotation-scale" (two standard deviations in pixels,
///         and the angle in radians from x to the first axis, towards y). Default: "cholesky".
///     bits: Bit depths of position, shape and colour with "packed", each 1 to 16. Scales and offsets follow from the
///         values as those with which LSQ+ begins, which may clip the strongest colours. Default: (12, 10, 6).
///     quantizers: In place of `bits`, a `Quantizer` for each component, or None for a float: x, y, three of shape, and
///         the channels of color. A value beyond the codes becomes that of the nearest one.
///     color_step: The step of colour with "entropy", 1e-6 to 1000: the difference of the amplitudes of neighbouring
///         codes, times sqrt(l11 l22) in pixels. Stronger Gaussians are also finer in position and shape. Default: 0.02.
///     first_layer: Most bytes, 80 to 65536, of the file that the first layer makes, with "entropy": as for `encode`.
///     threads: The number of threads, 1 to 1024, that work with "entropy".
///     cicp, mastering_display, content_light, icc, exif, xmp, texts, metadata: What to store with the picture, as for
///         `encode`.
///     limits: Those of the decoder that is to read the file: what it would refuse is not written. Default: Limits(),
///         with which `decode` reads every file.
///
/// Returns:
///     The file. With "entropy" it lacks the Gaussians that do not show inside the picture.
///
/// Raises:
///     ValueError: As for `render`; or a Gaussian is not positive definite once it is rounded, or has no code in the
///         entropy coding, and the message has the index of the first one; no first layer is as small as `first_layer`.
///     TypeError: An argument has the wrong type, is missing, or is one of another precision.
///     LimitError: A decoder with these limits would refuse the file.
#[pyfunction]
#[pyo3(signature = (gaussians, *, like=None, width=None, height=None, depth=None, kernel=None, cutoff=None, base_color=None, precision="f32", parameterization=None, bits=None, quantizers=None, color_step=None, first_layer=None, threads=1, cicp=None, mastering_display=None, content_light=None, icc=None, exif=None, xmp=None, texts=None, metadata="all", limits=None))]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub(crate) fn pack<'py>(
    py: Python<'py>,
    gaussians: &Bound<'py, PyAny>,
    like: Option<&Bound<'py, PyAny>>,
    width: Option<Integer<'py>>,
    height: Option<Integer<'py>>,
    depth: Option<Integer<'py>>,
    kernel: Option<String>,
    cutoff: Option<Real>,
    base_color: Option<&Bound<'py, PyAny>>,
    precision: &str,
    parameterization: Option<&str>,
    bits: Option<[Integer<'py>; 3]>,
    quantizers: Option<&Bound<'py, PyAny>>,
    color_step: Option<Real>,
    first_layer: Option<Integer<'py>>,
    #[pyo3(from_py_with = threads::checked)] threads: usize,
    cicp: Option<(Integer<'py>, Integer<'py>)>,
    mastering_display: Option<DisplayFields<Real>>,
    content_light: Option<LightFields<Real>>,
    icc: Option<&Bound<'py, PyAny>>,
    exif: Option<&Bound<'py, PyAny>>,
    xmp: Option<&Bound<'py, PyAny>>,
    texts: Option<&Bound<'py, PyAny>>,
    metadata: &str,
    limits: Option<Limits>,
) -> PyResult<Bound<'py, PyBytes>> {
    let kind = precision_of(precision)?;
    let packed = [Precision::Packed];
    for (name, is_given, precisions) in [
        ("bits", bits.is_some(), &packed[..]),
        ("quantizers", quantizers.is_some(), &packed),
        ("color_step", color_step.is_some(), &[Precision::Entropy]),
        ("first_layer", first_layer.is_some(), &[Precision::Entropy]),
        ("parameterization", parameterization.is_some(), &[Precision::Float, Precision::Packed]),
    ] {
        if is_given && !precisions.contains(&kind) {
            let message = format!("precision {precision:?} has no {name}");
            return Err(PyTypeError::new_err(message));
        }
    }
    if bits.is_some() && quantizers.is_some() {
        return Err(PyTypeError::new_err("bits and quantizers exclude each other"));
    }
    let mut stored = metadata::of(cicp, mastering_display, content_light, icc, exif, xmp, texts)?;
    for loss in metadata::retain(&mut stored, metadata)? {
        warn(py, "MetadataWarning", &loss.to_string())?;
    }
    let given = Given::new(gaussians)?;
    let fields = HeaderFields { gaussians, like, width, height, depth, kernel, cutoff, base_color };
    let mut header = fields.header(given.color)?;
    if let Some(name) = parameterization {
        header.parameterization = parameterization_of(name)?;
    }
    let mut writer = Writer::new(header)
        .with_precision(kind)
        .with_metadata(stored)
        .with_limits(Limits::of(limits));
    if let Some([position, shape, color]) = bits {
        let depth = |bits: Integer<'_>| bits.within("a number of bits", 1..=16_u8);
        writer = writer.with_bit_depths(depth(position)?, depth(shape)?, depth(color)?);
    }
    if let Some(quantizers) = quantizers {
        writer = writer.with_quantizers(quantizers_of(quantizers)?);
    }
    if let Some(Real(step)) = color_step {
        writer = writer.with_color_step(step as f32);
    }
    if let Some(bytes) = first_layer {
        writer = writer.with_first_layer(Some(bytes.within("first_layer", 80..=65_536)?));
    }
    let written = py.detach(|| {
        threads::decoding(threads, |threads| writer.with_threads(threads).write(&given.gaussians))
    })?;
    written.map(|file| PyBytes::new(py, &file)).map_err(|error| write_error(py, &error))
}

/// The quantizers of the caller. The writer checks their number and their ranges.
fn quantizers_of(object: &Bound<'_, PyAny>) -> PyResult<Vec<Quantizer>> {
    let wrong = || {
        PyTypeError::new_err(
            "quantizers must be Nones, or Quantizers: tuples of kind, bits, scale and offset",
        )
    };
    let quantizers = object.try_iter().map_err(|_| wrong())?.map(|item| {
        let item = item?;
        if item.is_none() {
            return Ok(Quantizer::Float);
        }
        let (kind, bits, scale, offset): (String, Integer<'_>, Real, Real) =
            item.extract().map_err(|_| wrong())?;
        let bits = bits.within("a number of bits", 1..=16)?;
        let steps = UniformQuantizer::new(bits, scale.0 as f32, offset.0 as f32);
        match &*kind {
            "linear" => Ok(Quantizer::Linear(steps)),
            "log" => Ok(Quantizer::Log(steps)),
            _ => Err(PyValueError::new_err(format!(
                "the kind of a quantizer is {kind:?}; it must be \"linear\" or \"log\""
            ))),
        }
    });
    quantizers.collect()
}
