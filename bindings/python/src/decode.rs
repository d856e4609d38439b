//! `decode`, `gaussians` and `info`.

use image_gip::{Decoder, MetadataLoss, StreamDecoder};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors::{decode_error, warn};
use crate::input::{Bytes, FileObject};
use crate::numbers::{Integer, Real};
use crate::objects::{self, Limits};
use crate::output::Output;
use crate::request::Request;
use crate::{metadata, threads};

/// Decodes a picture to an array.
///
/// The picture is a sum of Gaussians: it is rendered at the size asked for, and no pixels are
/// resampled. The interpreter lock is released.
///
/// Args:
///     src: The file: bytes or any contiguous buffer (which is not copied, and must not change during
///         the call), a path, or a binary file object.
///     size: Width and height in pixels of the whole picture. Default: the stored size.
///     scale: A factor of the stored width and height, in place of `size`.
///     region: (x, y, width, height): render only this part of the output, in pixels of the size asked
///         for. Layers of the file that do not show in it are skipped.
///     mode: "L", "LA", "RGB" or "RGBA". Gray can become RGB, an alpha channel can be added, and a
///         picture with alpha is composed over `background` for a mode without it; colour does not
///         become gray. Default: that of the file.
///     background: What is behind a picture with alpha whose result has none: one number for all
///         colours, or one for each, in the units of `dtype`. The samples composed are those that
///         show, clamped and not linear, as in browsers. With a background, the default mode is that of
///         the file without alpha. Default: white.
///     planar: Whether the result is channels x height x width, as networks take it, also with one channel.
///     dtype: numpy.uint8 (0 to 255), numpy.uint16 (0 to 65535) or numpy.float32 (1.0 is a full sample;
///         neither clamped nor rounded, unless composed). Default: that of `out`, else uint8 or uint16, whichever the
///         encoded picture had.
///     out: The array to decode into: C-contiguous, aligned, writeable, not masked, of the shape of the
///         result.
///     texture: Whether the texture of the picture is rendered: the noise in place of sand, water or
///         leaves. Without it the picture is smoother, and nearer to the source sample by sample.
///     threads: The number of threads, 1 to 1024. With 1, the work is done on the caller's thread. The
///         samples are the same.
///     limits: What the file may cost at most. Default: Limits().
///
/// Returns:
///     height x width (mode "L") or height x width x channels samples, rows from the top; with `planar`,
///     channels x height x width: a new array, or `out`. Colours are sRGB unless the file has an ICC profile; alpha is straight. The picture is
///     as it is stored, and so are size and region: `Info.orientation` tells how to turn it for display.
///
/// Raises:
///     GipError: The file was refused; its subclasses say why.
///     ValueError: An argument is out of range, or `out` does not fit.
///     TypeError: An argument has the wrong type.
///     MemoryError: There is no memory for the result, or for as much again, which is needed to compose,
///         and for several channels that are planar in uint8 or uint16, or not planar in float32.
///     OSError: The file cannot be read.
#[pyfunction]
#[pyo3(signature = (src, *, size=None, scale=None, region=None, mode=None, background=None, planar=false, dtype=None, out=None, texture=true, threads=1, limits=None))]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub(crate) fn decode<'py>(
    py: Python<'py>,
    src: &Bound<'py, PyAny>,
    size: Option<(Integer<'py>, Integer<'py>)>,
    scale: Option<Real>,
    region: Option<(Integer<'py>, Integer<'py>, Integer<'py>, Integer<'py>)>,
    mode: Option<&str>,
    background: Option<&Bound<'py, PyAny>>,
    planar: bool,
    dtype: Option<&Bound<'py, PyAny>>,
    out: Option<&Bound<'py, PyAny>>,
    texture: bool,
    #[pyo3(from_py_with = threads::checked)] threads: usize,
    limits: Option<Limits>,
) -> PyResult<Bound<'py, PyAny>> {
    let prefix = None;
    let request = Request {
        size,
        scale,
        region,
        mode,
        background,
        planar,
        dtype,
        out,
        prefix,
        texture,
        threads,
    };
    let rendering = request.check()?;
    let file = Bytes::of_file(src)?;
    let bytes = file.as_slice()?;
    let limits = Limits::of(limits);
    let failed = |error| decode_error(py, error);

    let mut decoder = py.detach(|| Decoder::new_with_limits(bytes, limits)).map_err(failed)?;
    let options = rendering.options(decoder.header());
    decoder.set_options(options.clone());
    decoder.output_len().map_err(failed)?;
    let mut output = Output::new(py, decoder.header(), &rendering, &request)?;
    if output.overlaps(bytes) {
        return Err(PyValueError::new_err("out overlaps src"));
    }
    let samples = output.samples()?;
    py.detach(|| {
        threads::decoding(rendering.threads, |threads| {
            decoder.set_options(options.with_threads(threads));
            samples.decode(&mut decoder)
        })
    })?
    .map_err(failed)?;
    Ok(output.into_array())
}

/// Reads and checks a whole file, without rendering it.
fn read_whole(
    py: Python<'_>,
    src: &Bound<'_, PyAny>,
    limits: Option<Limits>,
) -> PyResult<StreamDecoder> {
    let file = Bytes::of_file(src)?;
    let bytes = file.as_slice()?;
    let mut stream = StreamDecoder::new().with_limits(Limits::of(limits));
    let read = py.detach(|| stream.feed(bytes).and_then(|_| stream.finish()));
    read.map_err(|error| decode_error(py, error))?;
    Ok(stream)
}

/// The Gaussians of a picture, in the order of the file: the strongest come first, by and large.
///
/// Args:
///     src: The file, as for `decode`.
///     cholesky: Whether the result has Cholesky factors in place of covariances. They are what the decoder computes
///         with, so that `render` gives the same picture bit for bit, and `pack` stores the same numbers; covariances are
///         rounded once more.
///     limits: What the file may cost at most. Default: Limits().
///
/// Returns:
///     A one-dimensional structured array of float32 with the fields
///
///     - center, shape (2,): x to the right and y down, in pixels of the stored size; the centre of the
///       first pixel is (0.5, 0.5);
///     - covariance, shape (2, 2), in square pixels; or cholesky, shape (3,): the entries l11, l21, l22 of the lower
///       triangular L, in pixels, where L L^T is the covariance;
///     - color, shape (channels,): the amplitude, where 1.0 is a full sample; it may be negative.
///
///     A Gaussian whose covariance is not positive definite is not drawn. `Info.kernel` names the
///     weight that a Gaussian has around its centre.
///
/// Raises:
///     GipError: The file was refused.
///     OSError: The file cannot be read.
#[pyfunction]
#[pyo3(signature = (src, *, cholesky=false, limits=None))]
pub(crate) fn gaussians<'py>(
    py: Python<'py>,
    src: &Bound<'py, PyAny>,
    cholesky: bool,
    limits: Option<Limits>,
) -> PyResult<Bound<'py, PyAny>> {
    let stream = read_whole(py, src, limits)?;
    let channels = stream.header().map_or(0, |header| header.color.channels());
    objects::gaussians(py, stream.gaussians(), channels, cholesky)
}

/// What a file says of its picture: header, metadata, chunks, Gaussians per layer.
///
/// The whole file is read and checked, but not rendered.
///
/// Args:
///     src: The file, as for `decode`.
///     metadata: What the result has of the metadata: "all"; "safe", without what tells more than its
///         author may know, as for `encode`; or "none". `Info.orientation` is that of the file in any
///         case, as it says how to show the picture.
///     limits: What the file may cost at most. Default: Limits().
///
/// Returns:
///     An `Info`.
///
/// Raises:
///     GipError: The file was refused.
///     OSError: The file cannot be read.
#[pyfunction]
#[pyo3(signature = (src, *, metadata="all", limits=None))]
pub(crate) fn info<'py>(
    py: Python<'py>,
    src: &Bound<'py, PyAny>,
    metadata: &str,
    limits: Option<Limits>,
) -> PyResult<Option<Bound<'py, PyAny>>> {
    let stream = read_whole(py, src, limits)?;
    let mut kept = stream.metadata().clone();
    for loss in metadata::retain(&mut kept, metadata)? {
        // It is still told.
        if loss != MetadataLoss::Orientation {
            warn(py, "MetadataWarning", &loss.to_string())?;
        }
    }
    objects::info(py, &stream, &kept)
}

/// The `Info` of a file object up to its first layer. No more than that is read.
#[pyfunction]
#[pyo3(signature = (file, *, limits=None))]
pub(crate) fn read_header<'py>(
    py: Python<'py>,
    file: Bound<'py, PyAny>,
    limits: Option<Limits>,
) -> PyResult<Option<Bound<'py, PyAny>>> {
    let decoder = Decoder::new_with_limits(FileObject(file.unbind()), Limits::of(limits));
    let decoder = decoder.map_err(|error| decode_error(py, error))?;
    objects::info(py, decoder.stream(), decoder.metadata())
}
