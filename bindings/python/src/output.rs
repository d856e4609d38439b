//! Output arrays, and rendering into them.

use core::fmt::Display;

use image_gip::{DecodeError, Decoder, Header, Picture, RenderOptions, SampleDepth};
use numpy::{
    BorrowError, Element, PyArrayDescr, PyArrayDescrMethods, PyArrayDyn, PyArrayMethods,
    PyReadwriteArrayDyn, PyUntypedArray, PyUntypedArrayMethods, dtype,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::background::{Channels, Pixels};
use crate::errors::decode_error;
use crate::request::{Rendering, Request};

/// An array that is borrowed for writing.
enum Array<'py> {
    U8(PyReadwriteArrayDyn<'py, u8>),
    U16(PyReadwriteArrayDyn<'py, u16>),
    F32(PyReadwriteArrayDyn<'py, f32>),
}

/// The array for a rendering.
pub(crate) struct Output<'a, 'py> {
    array: Array<'py>,
    channels: Channels<'a>,
}

/// The samples of an output array: height x width x channels.
#[derive(Debug)]
pub(crate) enum Samples<'a> {
    U8(Pixels<'a, u8>),
    U16(Pixels<'a, u16>),
    F32(Pixels<'a, f32>),
}

impl<'a, 'py> Output<'a, 'py> {
    /// A new array for what is rendered of a picture, or `out` if that fits. The size was checked
    /// against the limits before.
    pub(crate) fn new(
        py: Python<'py>,
        header: &Header,
        rendering: &'a Rendering,
        request: &Request<'_, 'py>,
    ) -> PyResult<Self> {
        let (width, height) = rendering.options(header).output_size(header);
        let channels = rendering.channels(header).map_err(|error| decode_error(py, error))?;
        let mut shape = vec![height as usize, width as usize];
        if channels.returned > 1 {
            shape.push(channels.returned);
        }
        let kind = match (request.dtype, request.out) {
            (Some(kind), _) => PyArrayDescr::new(py, kind)?,
            (None, Some(out)) => as_array(out)?.dtype(),
            (None, None) if header.depth == SampleDepth::Sixteen => dtype::<u16>(py),
            (None, None) => dtype::<u8>(py),
        };
        let array = if kind.is_equiv_to(&dtype::<u8>(py)) {
            Array::U8(array(py, shape, request.out)?)
        } else if kind.is_equiv_to(&dtype::<u16>(py)) {
            Array::U16(array(py, shape, request.out)?)
        } else if kind.is_equiv_to(&dtype::<f32>(py)) {
            Array::F32(array(py, shape, request.out)?)
        } else {
            let message = format!("dtype {kind}; it must be uint8, uint16 or float32");
            return Err(PyTypeError::new_err(message));
        };
        Ok(Self { array, channels })
    }

    /// Whether the array shares memory with these bytes.
    pub(crate) fn overlaps(&self, bytes: &[u8]) -> bool {
        let (start, length) = match &self.array {
            Array::U8(array) => (array.data().addr(), array.len()),
            Array::U16(array) => (array.data().addr(), 2 * array.len()),
            Array::F32(array) => (array.data().addr(), 4 * array.len()),
        };
        let first = bytes.as_ptr().addr();
        start < first + bytes.len() && first < start + length
    }

    pub(crate) fn samples(&mut self) -> PyResult<Samples<'_>> {
        let Self { array, channels } = self;
        Ok(match array {
            Array::U8(array) => Samples::U8(channels.pixels(array.as_slice_mut()?)?),
            Array::U16(array) => Samples::U16(channels.pixels(array.as_slice_mut()?)?),
            Array::F32(array) => Samples::F32(channels.pixels(array.as_slice_mut()?)?),
        })
    }

    /// The array, which is no longer borrowed.
    pub(crate) fn into_array(self) -> Bound<'py, PyAny> {
        match self.array {
            Array::U8(array) => array.as_any().clone(),
            Array::U16(array) => array.as_any().clone(),
            Array::F32(array) => array.as_any().clone(),
        }
    }
}
impl Samples<'_> {
    /// Decodes the file of a decoder with the options that it has.
    pub(crate) fn decode(self, decoder: &mut Decoder<&[u8]>) -> Result<(), DecodeError> {
        match self {
            Samples::U8(pixels) => pixels.fill(|out, _| decoder.decode_into(out)),
            Samples::U16(pixels) => pixels.fill(|out, _| decoder.decode_into_u16(out)),
            Samples::F32(pixels) => pixels.fill(|out, channels| {
                interleaved(out, channels, |planes| decoder.decode_into_planes(planes))
            }),
        }
    }

    /// Renders a picture.
    pub(crate) fn render(
        self,
        picture: &Picture<'_>,
        options: &RenderOptions,
    ) -> Result<(), DecodeError> {
        match self {
            Samples::U8(pixels) => pixels.fill(|out, _| picture.render_u8(options, out)),
            Samples::U16(pixels) => pixels.fill(|out, _| picture.render_u16(options, out)),
            Samples::F32(pixels) => pixels.fill(|out, channels| {
                interleaved(out, channels, |planes| picture.render_planes(options, planes))
            }),
        }
    }
}

/// Renders planes, and interleaves them.
fn interleaved(
    out: &mut [f32],
    channels: usize,
    render: impl FnOnce(&mut [f32]) -> Result<(), DecodeError>,
) -> Result<(), DecodeError> {
    if channels == 1 {
        return render(out);
    }
    let mut planes = vec![0.0; out.len()];
    render(&mut planes)?;
    let pixels = out.len() / channels;
    for (channel, plane) in planes.chunks_exact(pixels).enumerate() {
        for (sample, &value) in out.iter_mut().skip(channel).step_by(channels).zip(plane) {
            *sample = value;
        }
    }
    Ok(())
}

fn as_array<'a, 'py>(out: &'a Bound<'py, PyAny>) -> PyResult<&'a Bound<'py, PyUntypedArray>> {
    out.cast().map_err(|_| PyTypeError::new_err("out must be a NumPy array"))
}

/// A new array, or `out` if that has the type and the shape.
fn array<'py, T: Element>(
    py: Python<'py>,
    shape: Vec<usize>,
    out: Option<&Bound<'py, PyAny>>,
) -> PyResult<PyReadwriteArrayDyn<'py, T>> {
    let kind = dtype::<T>(py);
    let Some(out) = out else {
        // NumPy raises MemoryError where there is too little memory.
        let new = py.import("numpy")?.call_method1("empty", (shape, kind))?;
        return new.extract();
    };
    let found = as_array(out)?;
    let refused = |what: &str, found: &dyn Display, wanted: &dyn Display| {
        Err(PyValueError::new_err(format!("out has {what} {found}; it must have {wanted}")))
    };
    let Ok(typed) = out.cast::<PyArrayDyn<T>>() else {
        return refused("dtype", &found.dtype(), &kind);
    };
    if found.shape() != shape {
        return refused("shape", &Shape(found.shape()), &Shape(&shape));
    }
    if !found.is_c_contiguous() {
        return Err(PyValueError::new_err(
            "out must be C-contiguous: rows from the top, without gaps",
        ));
    }
    typed.try_readwrite().map_err(|error| match error {
        BorrowError::NotWriteable => PyValueError::new_err("out is read-only"),
        _ => PyValueError::new_err("out is in use by another call"),
    })
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
