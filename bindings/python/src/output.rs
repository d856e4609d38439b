//! Output arrays, and rendering into them.

use core::fmt::Display;

use image_gip::{DecodeError, Decoder, Header, Picture, RenderOptions, SampleDepth};
use numpy::{
    BorrowError, Element, PyArrayDescr, PyArrayDescrMethods, PyArrayDyn, PyArrayMethods,
    PyReadwriteArrayDyn, PyUntypedArray, PyUntypedArrayMethods, dtype,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::array::{self, Shape};
use crate::background::{Channels, Pixels, Sample};
use crate::errors::decode_error;
use crate::request::{Rendering, Request};

/// Arrays of one type that are borrowed for writing.
struct Arrays<'py, T: Element> {
    /// The result.
    out: PyReadwriteArrayDyn<'py, T>,
    /// Where the picture is rendered first, if what is rendered is not the result.
    scratch: Option<PyReadwriteArrayDyn<'py, T>>,
}

/// The arrays of any of the types.
enum Typed<'py> {
    U8(Arrays<'py, u8>),
    U16(Arrays<'py, u16>),
    F32(Arrays<'py, f32>),
}

/// The array for a rendering.
pub(crate) struct Output<'a, 'py> {
    arrays: Typed<'py>,
    channels: Channels<'a>,
}

/// The samples of an output array: height x width x channels, or planes.
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
        if channels.planar {
            shape.insert(0, channels.returned);
        } else if channels.returned > 1 {
            shape.push(channels.returned);
        }
        let kind = match (request.dtype, request.out) {
            (Some(kind), _) => PyArrayDescr::new(py, kind)?,
            (None, Some(out)) => as_array(out)?.dtype(),
            (None, None) if header.depth == SampleDepth::Sixteen => dtype::<u16>(py),
            (None, None) => dtype::<u8>(py),
        };
        let samples = (height as usize * width as usize).saturating_mul(channels.rendered);
        // 8 and 16 bits are rendered interleaved, and floats as planes.
        let differs = |planar| channels.rendered > 1 && channels.planar != planar;
        let scratch = |planar| (channels.drops_alpha || differs(planar)).then_some(samples);
        let arrays = if kind.is_equiv_to(&dtype::<u8>(py)) {
            Typed::U8(Arrays::new(py, shape, request.out, scratch(false))?)
        } else if kind.is_equiv_to(&dtype::<u16>(py)) {
            Typed::U16(Arrays::new(py, shape, request.out, scratch(false))?)
        } else if kind.is_equiv_to(&dtype::<f32>(py)) {
            Typed::F32(Arrays::new(py, shape, request.out, scratch(true))?)
        } else {
            let message = format!("dtype {kind}; it must be uint8, uint16 or float32");
            return Err(PyTypeError::new_err(message));
        };
        Ok(Self { arrays, channels })
    }

    /// Whether the array shares memory with these bytes.
    pub(crate) fn overlaps(&self, bytes: &[u8]) -> bool {
        let (start, length) = match &self.arrays {
            Typed::U8(Arrays { out, .. }) => (out.data().addr(), out.len()),
            Typed::U16(Arrays { out, .. }) => (out.data().addr(), 2 * out.len()),
            Typed::F32(Arrays { out, .. }) => (out.data().addr(), 4 * out.len()),
        };
        let first = bytes.as_ptr().addr();
        start < first + bytes.len() && first < start + length
    }

    pub(crate) fn samples(&mut self) -> PyResult<Samples<'_>> {
        let Self { arrays, channels } = self;
        Ok(match arrays {
            Typed::U8(arrays) => Samples::U8(arrays.pixels(channels)?),
            Typed::U16(arrays) => Samples::U16(arrays.pixels(channels)?),
            Typed::F32(arrays) => Samples::F32(arrays.pixels(channels)?),
        })
    }

    /// The array, which is no longer borrowed.
    pub(crate) fn into_array(self) -> Bound<'py, PyAny> {
        match self.arrays {
            Typed::U8(Arrays { out, .. }) => out.as_any().clone(),
            Typed::U16(Arrays { out, .. }) => out.as_any().clone(),
            Typed::F32(Arrays { out, .. }) => out.as_any().clone(),
        }
    }
}

impl<'py, T: Element + Sample> Arrays<'py, T> {
    /// `out` if that has the type and the shape, or a new array; and another one if its length is given.
    /// NumPy raises MemoryError where there is too little memory.
    fn new(
        py: Python<'py>,
        shape: Vec<usize>,
        out: Option<&Bound<'py, PyAny>>,
        scratch: Option<usize>,
    ) -> PyResult<Self> {
        let out = out.map_or_else(|| new(py, &shape), |out| borrowed(out, &shape))?;
        let scratch = scratch.map(|length| new(py, &[length])).transpose()?;
        Ok(Self { out, scratch })
    }

    fn pixels(&mut self, channels: &Channels<'_>) -> PyResult<Pixels<'_, T>> {
        let scratch = self.scratch.as_mut().map(|array| array.as_slice_mut()).transpose()?;
        channels.pixels(self.out.as_slice_mut()?, scratch)
    }
}

impl Samples<'_> {
    /// Decodes the file of a decoder with the options that it has.
    pub(crate) fn decode(self, decoder: &mut Decoder<&[u8]>) -> Result<(), DecodeError> {
        match self {
            Samples::U8(pixels) => pixels.fill(|out| decoder.decode_into(out)),
            Samples::U16(pixels) => pixels.fill(|out| decoder.decode_into_u16(out)),
            Samples::F32(pixels) => pixels.fill_from_planes(|out| decoder.decode_into_planes(out)),
        }
    }

    /// Renders a picture.
    pub(crate) fn render(
        self,
        picture: &Picture<'_>,
        options: &RenderOptions,
    ) -> Result<(), DecodeError> {
        match self {
            Samples::U8(pixels) => pixels.fill(|out| picture.render_u8(options, out)),
            Samples::U16(pixels) => pixels.fill(|out| picture.render_u16(options, out)),
            Samples::F32(pixels) => {
                pixels.fill_from_planes(|out| picture.render_planes(options, out))
            }
        }
    }
}

fn as_array<'a, 'py>(out: &'a Bound<'py, PyAny>) -> PyResult<&'a Bound<'py, PyUntypedArray>> {
    out.cast().map_err(|_| PyTypeError::new_err("out must be a NumPy array"))
}

/// A new array.
fn new<'py, T: Element>(py: Python<'py>, shape: &[usize]) -> PyResult<PyReadwriteArrayDyn<'py, T>> {
    py.import("numpy")?.call_method1("empty", (shape, dtype::<T>(py)))?.extract()
}

/// The array of the caller, if that has the type and the shape.
fn borrowed<'py, T: Element>(
    out: &Bound<'py, PyAny>,
    shape: &[usize],
) -> PyResult<PyReadwriteArrayDyn<'py, T>> {
    let found = as_array(out)?;
    let refused = |what: &str, found: &dyn Display, wanted: &dyn Display| {
        Err(PyValueError::new_err(format!("out has {what} {found}; it must have {wanted}")))
    };
    let Ok(typed) = out.cast::<PyArrayDyn<T>>() else {
        return refused("dtype", &found.dtype(), &dtype::<T>(out.py()));
    };
    if found.shape() != shape {
        return refused("shape", &Shape(found.shape()), &Shape(shape));
    }
    array::check_memory("out", found)?;
    typed.try_readwrite().map_err(|error| match error {
        BorrowError::NotWriteable => PyValueError::new_err("out is read-only"),
        _ => PyValueError::new_err("out is in use by another call"),
    })
}
