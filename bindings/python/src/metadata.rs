//! Metadata to store with a picture, and what of it is kept.

use image_gip::{Cicp, Metadata, MetadataLoss, MetadataPolicy, Text};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyMapping, PyString};

use crate::input;
use crate::light::{self, DisplayFields, LightFields};
use crate::numbers::{Integer, Real};

/// Keeps what the policy of this name says. Returns what was dropped that may be missed.
pub(crate) fn retain(metadata: &mut Metadata, policy: &str) -> PyResult<Vec<MetadataLoss>> {
    let policy = match policy {
        "all" => MetadataPolicy::All,
        "safe" => MetadataPolicy::Safe,
        "none" => MetadataPolicy::None,
        _ => {
            return Err(PyValueError::new_err(format!(
                "metadata {policy:?}; it must be \"all\", \"safe\" or \"none\""
            )));
        }
    };
    Ok(metadata.retain(policy))
}

/// The metadata that the caller gives. The encoder checks what can be stored.
pub(crate) fn of(
    cicp: Option<(Integer<'_>, Integer<'_>)>,
    mastering_display: Option<DisplayFields<Real>>,
    content_light: Option<LightFields<Real>>,
    icc: Option<&Bound<'_, PyAny>>,
    exif: Option<&Bound<'_, PyAny>>,
    xmp: Option<&Bound<'_, PyAny>>,
    texts: Option<&Bound<'_, PyAny>>,
) -> PyResult<Metadata> {
    let blob = |name: &str, data: Option<&Bound<'_, PyAny>>| {
        let bytes =
            data.map(|data| Ok::<_, PyErr>(input::buffer(name, data)?.as_slice()?.to_vec()));
        bytes.transpose()
    };
    let mut metadata = Metadata::default();
    if let Some((primaries, transfer)) = cicp {
        let code = |code: Integer<'_>| code.within("a code of cicp", 0..=u8::MAX);
        metadata.cicp = Some(Cicp::new(code(primaries)?, code(transfer)?));
    }
    metadata.mastering_display = mastering_display.map(light::display).transpose()?;
    metadata.content_light = content_light.map(light::light).transpose()?;
    metadata.icc_profile = blob("icc", icc)?;
    metadata.exif = blob("exif", exif)?.map(tiff_stream).transpose()?;
    metadata.xmp = blob("xmp", xmp)?;
    metadata.texts = texts.map(self::texts).transpose()?.unwrap_or_default();
    Ok(metadata)
}

/// The TIFF stream of Exif data, without the prefix that it has in JPEG.
fn tiff_stream(mut exif: Vec<u8>) -> PyResult<Vec<u8>> {
    if exif.starts_with(b"Exif\0\0") {
        exif.drain(..6);
    }
    if exif.starts_with(b"II") || exif.starts_with(b"MM") {
        return Ok(exif);
    }
    Err(PyValueError::new_err("exif must be a TIFF stream, which begins with II or MM"))
}

/// Keywords and texts, of a mapping or of pairs.
fn texts(object: &Bound<'_, PyAny>) -> PyResult<Vec<Text>> {
    let wrong = || PyTypeError::new_err("texts must be a mapping of str to str, or pairs of str");
    let pairs = match object.cast::<PyMapping>() {
        Ok(mapping) => mapping.items()?.into_any(),
        Err(_) => object.clone(),
    };
    let texts = pairs.try_iter().map_err(|_| wrong())?.map(|pair| {
        let pair: (Bound<'_, PyString>, Bound<'_, PyString>) =
            pair?.extract().map_err(|_| wrong())?;
        Ok(Text::new(pair.0.to_cow()?, pair.1.to_cow()?))
    });
    texts.collect()
}
