//! The picture to encode, from an array; and what is asked of any array.

use core::fmt::Display;

use image_gip::{ColorModel, Source, SourceError};
use numpy::{
    PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::errors::vec_for;
use crate::numbers::shown;

/// Floats that are converted from one look for signals to the next.
const PART: usize = 1 << 20;

/// The samples of an array.
pub(crate) enum Pixels<'py> {
    U8(PyReadonlyArrayDyn<'py, u8>),
    U16(PyReadonlyArrayDyn<'py, u16>),
    /// Floats, as 16-bit samples.
    Converted(Vec<u16>),
}

/// A picture whose samples are borrowed from an array.
pub(crate) struct Picture<'py> {
    width: u32,
    height: u32,
    color: ColorModel,
    pixels: Pixels<'py>,
}

impl<'py> Picture<'py> {
    /// Checks an array.
    pub(crate) fn new(array: &Bound<'py, PyAny>) -> PyResult<Self> {
        let Ok(untyped) = array.cast::<PyUntypedArray>() else {
            let kind = array.get_type().name()?;
            return Err(PyTypeError::new_err(format!(
                "the picture must be a NumPy array, not {kind}; use numpy.asarray"
            )));
        };
        let (height, width, color) = match *untyped.shape() {
            [height, width] | [height, width, 1] => (height, width, ColorModel::Gray),
            [height, width, 2] => (height, width, ColorModel::GrayAlpha),
            [height, width, 3] => (height, width, ColorModel::Rgb),
            [height, width, 4] => (height, width, ColorModel::Rgba),
            ref shape => {
                return Err(PyValueError::new_err(format!(
                    "shape {}; it must be height x width, or height x width x 1 to 4 channels",
                    Shape(shape)
                )));
            }
        };
        check_memory("the array", untyped)?;
        let in_use = |_| PyValueError::new_err("the array is being written by another call");
        let pixels = if let Ok(array) = array.cast::<PyArrayDyn<u8>>() {
            Pixels::U8(array.try_readonly().map_err(in_use)?)
        } else if let Ok(array) = array.cast::<PyArrayDyn<u16>>() {
            Pixels::U16(array.try_readonly().map_err(in_use)?)
        } else if let Ok(array) = array.cast::<PyArrayDyn<f32>>() {
            Pixels::Converted(from_floats(
                array.py(),
                array.try_readonly().map_err(in_use)?.as_slice()?,
                untyped.shape(),
            )?)
        } else {
            return Err(PyTypeError::new_err(format!(
                "dtype {}; it must be uint8, uint16 or float32, in the machine's byte order",
                untyped.dtype()
            )));
        };
        let side = |length: usize| u32::try_from(length).unwrap_or(u32::MAX);
        Ok(Self { width: side(width), height: side(height), color, pixels })
    }

    pub(crate) fn source(&self) -> PyResult<Source<'_>> {
        let Self { width, height, color, ref pixels } = *self;
        let source: Result<_, SourceError> = match pixels {
            Pixels::U8(array) => Source::new_u8(width, height, color, array.as_slice()?),
            Pixels::U16(array) => Source::new_u16(width, height, color, array.as_slice()?),
            Pixels::Converted(samples) => Source::new_u16(width, height, color, samples),
        };
        source.map_err(|error| PyValueError::new_err(error.to_string()))
    }
}

/// Refuses an array whose memory is not that of its samples alone, one after the other.
pub(crate) fn check_memory(name: &str, array: &Bound<'_, PyUntypedArray>) -> PyResult<()> {
    refuse_masked(name, array)?;
    let wrong = if !array.is_c_contiguous() {
        "C-contiguous: rows from the top, without gaps (see numpy.ascontiguousarray)"
    } else if !array.is_aligned() {
        "aligned (see numpy.require)"
    } else {
        return Ok(());
    };
    Err(PyValueError::new_err(format!("{name} is not {wrong}")))
}

/// Refuses an array with a mask, which nothing keeps.
pub(crate) fn refuse_masked(name: &str, array: &Bound<'_, PyUntypedArray>) -> PyResult<()> {
    let py = array.py();
    if !array.get_type().is(py.get_type::<PyUntypedArray>())
        && array.is_instance(&py.import("numpy.ma")?.getattr("MaskedArray")?)?
    {
        let message = format!("{name} is masked; use its data, or what its method filled returns");
        return Err(PyTypeError::new_err(message));
    }
    Ok(())
}

/// 16-bit samples from floats, of which 1.0 is a full one. Signals are attended to meanwhile.
fn from_floats(py: Python<'_>, values: &[f32], shape: &[usize]) -> PyResult<Vec<u16>> {
    let mut samples = vec_for(values.len())?;
    for end in (0..values.len()).step_by(PART).map(|start| values.len().min(start + PART)) {
        py.check_signals()?;
        let part = &values[samples.len()..end];
        let valid = part.iter().take_while(|value| (0.0..=1.0).contains(*value));
        py.detach(|| samples.extend(valid.map(|value| (value * 65535.0 + 0.5) as u16)));
        if samples.len() < end {
            return Err(out_of_range(values[samples.len()], samples.len(), shape));
        }
    }
    Ok(samples)
}

/// The error for a float of an array of this shape.
fn out_of_range(value: f32, index: usize, shape: &[usize]) -> PyErr {
    let mut place = vec![0; shape.len()];
    let mut rest = index;
    for (place, length) in place.iter_mut().zip(shape).rev() {
        (*place, rest) = (rest % length, rest / length);
    }
    let (place, value) = (Shape(&place), shown(value));
    PyValueError::new_err(format!(
        "the float at {place} is {value}; floats must be 0.0 to 1.0: use numpy.clip, or uint8 or \
         uint16 for whole numbers"
    ))
}

/// A shape as Python writes it.
pub(crate) struct Shape<'a>(pub(crate) &'a [usize]);

impl Display for Shape<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let sides: Vec<_> = self.0.iter().map(usize::to_string).collect();
        let comma = if sides.len() == 1 { "," } else { "" };
        write!(f, "({}{comma})", sides.join(", "))
    }
}
