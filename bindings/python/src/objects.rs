//! What the module takes from Python and gives to it besides samples: limits, `Info`, Gaussians.

use image_gip::{
    Coding, Gaussian, Kernel, Limits as DecoderLimits, Metadata, Parameterization, StreamDecoder,
};
use numpy::PyArray1;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList, PyTuple};

use crate::errors::vec_for;
use crate::{light, request};

/// `image_gip.Limits`.
#[derive(Debug)]
pub(crate) struct Limits(DecoderLimits);

impl FromPyObject<'_, '_> for Limits {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, '_, PyAny>) -> PyResult<Self> {
        let class = object.py().import("image_gip._types")?.getattr("Limits")?;
        if !object.is_instance(&class)? {
            let found = object.get_type().name()?;
            let message = format!("limits must be an image_gip.Limits, not {found}");
            return Err(PyTypeError::new_err(message));
        }
        // The class has checked the ranges.
        let mut limits = DecoderLimits::default();
        limits.max_width = object.getattr("max_width")?.extract()?;
        limits.max_height = object.getattr("max_height")?.extract()?;
        limits.max_pixels = object.getattr("max_pixels")?.extract()?;
        limits.max_gaussians = object.getattr("max_gaussians")?.extract()?;
        limits.max_memory = object.getattr("max_memory")?.extract()?;
        limits.max_work = object.getattr("max_work")?.extract()?;
        Ok(Self(limits))
    }
}

impl Limits {
    /// The limits of a decoder.
    pub(crate) fn of(limits: Option<Self>) -> DecoderLimits {
        limits.map(|Self(limits)| limits).unwrap_or_default()
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
    let chunks = chunks.map(|c| chunk.call1((c.kind.letters().to_string(), c.count, c.bytes)));
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
    let skipped = stream.skipped().iter();
    let skipped = skipped.map(|s| (s.chunk.letters().to_string(), s.reason.to_string()));
    fields.set_item("skipped", PyTuple::new(py, skipped.collect::<Vec<_>>())?)?;
    fields.set_item("cicp", metadata.cicp.map(|cicp| (cicp.primaries, cicp.transfer)))?;
    let display = metadata.mastering_display.map(|display| light::display_object(&types, &display));
    fields.set_item("mastering_display", display.transpose()?)?;
    let light = metadata.content_light.map(|light| light::light_object(&types, &light));
    fields.set_item("content_light", light.transpose()?)?;
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

/// A structured array of Gaussians, with so many channels of colour, and Cholesky factors or covariances.
pub(crate) fn gaussians<'py>(
    py: Python<'py>,
    gaussians: &[Gaussian],
    channels: usize,
    cholesky: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let shape = if cholesky {
        ("cholesky", "f4", (3,)).into_pyobject(py)?
    } else {
        ("covariance", "f4", (2, 2)).into_pyobject(py)?
    };
    let center = ("center", "f4", (2,)).into_pyobject(py)?;
    let fields = vec![center, shape, ("color", "f4", (channels,)).into_pyobject(py)?];
    let mut values = vec_for(gaussians.len() * (6 + channels))?;
    for gaussian in gaussians {
        values.extend(gaussian.center);
        if cholesky {
            values.extend(gaussian.cholesky);
        } else {
            let [xx, xy, yy] = gaussian.covariance();
            values.extend([xx, xy, xy, yy]);
        }
        values.extend(&gaussian.color[..channels]);
    }
    PyArray1::from_vec(py, values).call_method1("view", (PyList::new(py, fields)?,))
}
