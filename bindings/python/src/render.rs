//! `render`.

use image_gip::Picture;
use pyo3::prelude::*;

use crate::errors::{decode_error, picture_error};
use crate::given::{Given, HeaderFields};
use crate::numbers::{Integer, Real};
use crate::objects::Limits;
use crate::output::Output;
use crate::request::Request;
use crate::threads;

/// Renders Gaussians to an array, as `decode` renders those of a file.
///
/// A pixel is the base colour and, Gaussian by Gaussian, color * weight(q): q is its squared Mahalanobis distance
/// from the centre, d^T covariance^-1 d, where d = pixel centre - center. The weight is (1 - q / 4)^2 for q < 4
/// (kernel "quartic"), or exp(-q / 2) for q <= cutoff ("exponential"), else 0. The sum is made with float32 in the
/// order of the array, and is that of `decode` bit for bit, if the file has these Gaussians in this order.
///
/// Args:
///     gaussians: The n Gaussians, of any real type, which becomes float32: a structured array as `gaussians`
///         returns it, or a mapping of arrays with the same names, such as a dict or what numpy.load makes of a .npz:
///
///         - center, shape (n, 2): x to the right and y down, in pixels of the stored size; the centre of the first
///           pixel is (0.5, 0.5); within +-2**24;
///         - covariance, shape (n, 2, 2), in square pixels: symmetric and positive definite; or cholesky, shape (n, 3):
///           the entries l11, l21, l22 of the lower triangular L, in pixels, where L L^T is the covariance; l11 and l22
///           are 2**-12 to 2**24. If there are both, they must agree;
///         - color, shape (n, channels) or, for gray, (n,): the amplitude, where 1.0 is a full sample; it may be
///           negative; within +-65536. The channels are gray; gray, alpha; red, green, blue; or red, green, blue,
///           alpha.
///     like: An `Info`, of which what follows is taken where it is not given: width, height, depth, kernel with
///         cutoff, base_color. Without `like`, a mapping may have these, too, as the .npz of `gip export` does.
///     width, height: The stored size, 1 to 2**20: the pixels in which centres and covariances are.
///     depth: Bits per sample, 8 or 16, which sets the default dtype. Default: 8.
///     kernel: "quartic" or "exponential". Default: "quartic".
///     cutoff: The largest q with a weight over 0 of the exponential kernel, over 0 and at most 64. Default:
///         11.082527, where exp(-q / 2) is 1/255.
///     base_color: The colour that the Gaussians are added to, in 1/65535 of a full sample: an integer 0 to 65535,
///         or one for each channel; with depth=8 they must be multiples of 257. Default: 0.
///     size, scale, region, mode, background, planar, dtype, out, threads: As for `decode`, with the picture's own mode by
///         its channels.
///     limits: What the picture may cost at most. Default: Limits().
///
/// Returns:
///     height x width (mode "L") or height x width x channels samples, as `decode` returns them.
///
/// Raises:
///     ValueError: The Gaussians lack a field, or one has the wrong shape; a Gaussian is out of range, not finite or
///         not positive definite, and the message has the index of the first one; or another argument is out of range.
///     TypeError: An argument has the wrong type, or there is no width or height.
///     LimitError: The picture costs more than `limits` allow.
///     MemoryError: As for `decode`.
#[pyfunction]
#[pyo3(signature = (gaussians, *, like=None, width=None, height=None, depth=None, kernel=None, cutoff=None, base_color=None, size=None, scale=None, region=None, mode=None, background=None, planar=false, dtype=None, out=None, threads=1, limits=None))]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub(crate) fn render<'py>(
    py: Python<'py>,
    gaussians: &Bound<'py, PyAny>,
    like: Option<&Bound<'py, PyAny>>,
    width: Option<Integer<'py>>,
    height: Option<Integer<'py>>,
    depth: Option<Integer<'py>>,
    kernel: Option<String>,
    cutoff: Option<Real>,
    base_color: Option<&Bound<'py, PyAny>>,
    size: Option<(Integer<'py>, Integer<'py>)>,
    scale: Option<Real>,
    region: Option<(Integer<'py>, Integer<'py>, Integer<'py>, Integer<'py>)>,
    mode: Option<&str>,
    background: Option<&Bound<'py, PyAny>>,
    planar: bool,
    dtype: Option<&Bound<'py, PyAny>>,
    out: Option<&Bound<'py, PyAny>>,
    #[pyo3(from_py_with = threads::checked)] threads: usize,
    limits: Option<Limits>,
) -> PyResult<Bound<'py, PyAny>> {
    let (prefix, texture) = (None, false);
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
    let given = Given::new(gaussians)?;
    let fields = HeaderFields { gaussians, like, width, height, depth, kernel, cutoff, base_color };
    let header = fields.header(given.color)?;
    let limits = Limits::of(limits);
    let picture = Picture::from_gaussians(&header, &given.gaussians, &limits)
        .map_err(|error| picture_error(py, &error))?;

    let failed = |error| decode_error(py, error);
    let options = rendering.options(&header);
    picture.output_len(&options).map_err(failed)?;
    let mut output = Output::new(py, &header, &rendering, &request)?;
    let samples = output.samples()?;
    py.detach(|| {
        threads::decoding(rendering.threads, |threads| {
            samples.render(&picture, &options.with_threads(threads))
        })
    })?
    .map_err(failed)?;
    Ok(output.into_array())
}
