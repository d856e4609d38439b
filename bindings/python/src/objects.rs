//! What the module takes from Python and gives to it besides samples: limits, `Info`, Gaussians.

use image_gip::{
    Coding, Gaussian, Kernel, Limits as DecoderLimits, Metadata, Parameterization, StreamDecoder,
};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList, PyTuple};

use crate::request;

/// `image_gip.Limits`.
#[derive(Debug, FromPyObject)]
pub(crate) struct Limits {
    max_width: u32,
    max_height: u32,
    max_pixels: u64,
    max_gaussians: u32,
    max_memory: u64,
    max_work: u64,
}

impl Limits {
    /// The limits of a decoder.
    pub(crate) fn of(limits: Option<Self>) -> DecoderLimits {
        let mut of_decoder = DecoderLimits::default();
        if let Some(limits) = limits {
            of_decoder.max_width = limits.max_width;
            of_decoder.max_height = limits.max_height;
            of_decoder.max_pixels = limits.max_pixels;
            of_decoder.max_gaussians = limits.max_gaussians;
            of_decoder.max_memory = limits.max_memory;
            of_decoder.max_work = limits.max_work;
        }
        of_decoder
    }
}

/// `image_gip.Info` of what has arrived, with this metadata of it; `None` without a header.
pub(crate) fn info<'py>(
    py: Python<'py>,
    stream: &StreamDecoder,
    metadata: &Metadata,
) -> PyResult<Option<Bound<'py, PyAny>>> {
    let Some(header) = stream.header() else { return Ok(None) };
    let types = py.import("image_gip._types")?;
    let chunk = types.getattr("Chunk")?;
    let chunks = stream.chunks().iter();
    let chunks = chunks.map(|c| chunk.call1((c.kind.to_string(), c.count, c.bytes)));
    let blob = |blob: &Option<Vec<u8>>| blob.as_ref().map(|bytes| PyBytes::new(py, bytes));
    let texts = metadata.texts.iter().map(|text| (&text.keyword, &text.text));
    let channels = header.color.channels();

    let fields = PyDict::new(py);
    fields.set_item("width", header.width)?;
    fields.set_item("height", header.height)?;
    fields.set_item("mode", request::mode_name(header.color))?;
    fields.set_item("depth", header.depth.bits())?;
    fields.set_item("orientation", stream.metadata().orientation().to_exif())?;
    fields.set_item("gaussians", header.gaussians)?;
    fields.set_item("layers", PyTuple::new(py, stream.layers())?)?;
    fields.set_item("version", header.version)?;
    fields.set_item("coding", coding(header.coding))?;
    fields.set_item("kernel", kernel(header.kernel))?;
    fields.set_item("cutoff", header.kernel.cutoff())?;
    fields.set_item("parameterization", parameterization(header.parameterization))?;
    fields.set_item("base_color", PyTuple::new(py, &header.base_color[..channels])?)?;
    fields.set_item("chunks", PyTuple::new(py, chunks.collect::<PyResult<Vec<_>>>()?)?)?;
    fields.set_item("icc", blob(&metadata.icc_profile))?;
    fields.set_item("exif", blob(&metadata.exif))?;
    fields.set_item("xmp", blob(&metadata.xmp))?;
    fields.set_item("texts", PyTuple::new(py, texts.collect::<Vec<_>>())?)?;
    types.getattr("Info")?.call((), Some(&fields)).map(Some)
}

fn coding(coding: Coding) -> &'static str {
    match coding {
        Coding::Packed => "packed",
        Coding::Entropy => "entropy",
        _ => "unknown",
    }
}

fn kernel(kernel: Kernel) -> &'static str {
    match kernel {
        Kernel::Exponential { .. } => "exponential",
        Kernel::Quartic => "quartic",
        _ => "unknown",
    }
}

fn parameterization(parameterization: Parameterization) -> &'static str {
    match parameterization {
        Parameterization::Covariance => "covariance",
        Parameterization::Cholesky => "cholesky",
        Parameterization::RotationScale => "rotation-scale",
        _ => "unknown",
    }
}

/// A structured array of Gaussians, with so many channels of colour.
pub(crate) fn gaussians<'py>(
    py: Python<'py>,
    gaussians: &[Gaussian],
    channels: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let fields =
        (("center", "f4", (2,)), ("covariance", "f4", (2, 2)), ("color", "f4", (channels,)));
    let fields =
        vec![fields.0.into_pyobject(py)?, fields.1.into_pyobject(py)?, fields.2.into_pyobject(py)?];
    let mut values = Vec::with_capacity(gaussians.len() * (6 + channels));
    for gaussian in gaussians {
        let [xx, xy, yy] = gaussian.covariance();
        values.extend(gaussian.center);
        values.extend([xx, xy, xy, yy]);
        values.extend(&gaussian.color[..channels]);
    }
    PyArray1::from_vec(py, values).call_method1("view", (PyList::new(py, fields)?,))
}
