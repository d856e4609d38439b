//! `encode`.

use core::fmt::Display;
use core::ops::ControlFlow;
use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use image_gip::{
    EncodeError, Encoded, Encoder, Header, Importance, Limits as ImageLimits, Picture as Gaussians,
    Precision, Progress, Shortfall, Source, Target, Tune,
};
use numpy::{PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::array::{Picture, refuse_masked};
use crate::errors::{encode_error, picture_error, vec_for, warn};
use crate::given::{self, Given};
use crate::light::{DisplayFields, LightFields};
use crate::numbers::{Integer, Real};
use crate::objects::Limits;
use crate::{metadata, threads};

/// How long the calling thread waits before it looks for signals, such as that of Ctrl-C.
const INTERVAL: Duration = Duration::from_millis(10);
/// The fraction of the work after which there is something to report, if no iteration has ended.
const NEWS: f64 = 0.002;

/// Encodes a picture.
///
/// The file depends on the array and the options alone, not on the number of threads; it is the one
/// that the tool `gip encode` writes. Encoding is an optimization, and takes seconds. The interpreter
/// lock is released meanwhile, and Ctrl-C ends it.
///
/// At most one target may be given; without any of them it is quality=75. A file that cannot meet its
/// target comes as close as it can; where that means less PSNR or quality than that, or a larger file,
/// there is a ShortfallWarning.
///
/// Args:
///     array: height x width or height x width x channels samples, C-contiguous and aligned: uint8, uint16, or
///         float32 from 0.0 to 1.0, which is stored with 16 bits; not masked. The channels are gray; gray, alpha; red,
///         green, blue; or red, green, blue, alpha. Colours are sRGB unless `cicp` or `icc`
///         says otherwise; alpha is straight. The array is not copied, but for float32, and must not change during the call.
///     bpp: A file of at most so many bits per pixel, 1e-6 to 1e6.
///     bytes: A file of at most so many bytes, 1 to 2**30. That only the metadata keep it out of reach is
///         an error.
///     quality: A visual quality from 0 to 100, on the scale of the metric SSIMULACRA2: about 50 is
///         medium, 70 high, and from 90 on people see no difference. No more than 97 is aimed at. It is that of
///         the picture without its texture, which the metric takes for an error.
///     psnr: A PSNR of the decoded file without its texture in dB, 1 to 120.
///     gaussians: At most so many Gaussians, 1 to 2**22.
///     effort: How much time to spend, 1 (least) to 7 (most).
///     tune: What to minimize for the size of the file: "visual", the error that a person sees, or
///         "psnr", the squared error.
///     texture: The strength of the texture, 0 (none) to 100. It takes the place of fine irregular detail that
///         the file has no bits for, such as sand, water and leaves. Files with tune="psnr", and those with
///         another precision than "entropy", have none.
///     first_layer: Most bytes, 80 to 65536, of the file that the first layer makes: a placeholder, which `prefix`
///         cuts off, and with which the whole file begins. What says how the picture is shown is in it; other
///         metadata then stand after it. Default: the first layer has about a tenth of the file. A precision other
///         than "entropy" has layers of the usual size.
///     precision: How the Gaussians are stored: "entropy", for the smallest files; "packed", with codes
///         of fixed bit depths; or "f32", the fitted values themselves, in files several times as large.
///     threads: The number of threads that work, 1 to 1024. The calling thread only waits for them.
///     seed: The seed of all random numbers.
///     keep_invisible: Keep colours where alpha is 0. By default what does not show takes the colours
///         around it: the file is smaller, and scaled pictures have no fringes.
///     cicp: The colour space of the picture: the codes of its colour primaries and of its transfer characteristics,
///         0 to 255, as Rec. ITU-T H.273 has them. (12, 13) is Display P3, (9, 16) is BT.2100 with PQ, (9, 18) with
///         HLG. It counts before `icc`. Pictures of PQ are judged as a display of standard range shows them.
///     mastering_display: The display on which the picture was made: a `MasteringDisplay`, or a tuple of its fields.
///         Chromaticities are rounded to 0.00002, and luminance to 0.0001 cd/m².
///     content_light: How bright the picture is: a `ContentLight`, or a tuple of its fields. Both are rounded to
///         0.0001 cd/m².
///     icc: An ICC profile to store with the picture.
///     exif: Exif data: a TIFF stream, with or without the prefix that it has in JPEG.
///     xmp: An XMP packet: XML in UTF-8.
///     texts: Texts by their keywords, such as "Title", "Author" or "Copyright": a mapping, or pairs,
///         in the order in which they are stored. A keyword is 1 to 79 bytes of UTF-8; neither has a
///         NUL.
///     metadata: What of `icc`, `exif`, `xmp` and `texts` is stored: "all"; "safe", which keeps the profile, orientation,
///         copyright, artist, description and dates, and drops position, maker notes, thumbnails,
///         serial numbers, names of owners, comments and all else; or "none". There is a
///         MetadataWarning for a profile other than that of sRGB, without `cicp`, and for an orientation other than
///         upright that are dropped, and for damaged data. The samples are stored as they are: turn
///         them before, if nothing shall tell how they are turned.
///     limits: Those of the decoder that is to read the file: what it would refuse is not encoded.
///         Default: Limits(), with which `decode` reads every file that is encoded.
///     importance: height x width of float32: how much an error counts at each pixel, for pictures of which some part
///         matters more, with tune="visual". Only ratios to the mean count, up to 16 either way, in blocks of 4 x 4 pixels.
///         The target is still that of the whole picture.
///     fitted: Gaussians that were fitted to the picture by other means, as for `render`, with the quartic kernel.
///         Nothing is fitted: their codes are chosen for the target, by coordinate descent over rate and distortion.
///         With precision="entropy" only. What a mapping has of a header, as for `render`, must be that of the picture.
///     base_color: What `fitted` is added to, as for `render`; by default that of the mapping, or 0.
///     progress: Called with a `Progress` again and again, on the calling thread. If it returns False,
///         or raises an exception, the encoding is cancelled. None goes on.
///
/// Returns:
///     The file.
///
/// Raises:
///     TypeError: The array is no array of a type above, or more than one target is given.
///     ValueError: The array has another shape, strides or alignment, or floats that are out of range or NaN; an
///         option is out of range; no first layer is as small as `first_layer`, and the message says which is.
///     LimitError: A decoder with these limits would refuse the file: for the size of the picture, its
///         metadata or `gaussians`, before any work is done; for the work of decoding, at the end.
///     CancelledError: `progress` returned False.
///     MemoryError: There is no memory to convert float32.
#[pyfunction]
#[pyo3(signature = (array, *, bpp=None, bytes=None, quality=None, psnr=None, gaussians=None, effort=4, tune="visual", texture=50, first_layer=None, precision="entropy", threads=1, seed=0, keep_invisible=false, cicp=None, mastering_display=None, content_light=None, icc=None, exif=None, xmp=None, texts=None, metadata="all", limits=None, importance=None, fitted=None, base_color=None, progress=None))]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub(crate) fn encode<'py>(
    py: Python<'py>,
    array: &Bound<'py, PyAny>,
    bpp: Option<Real>,
    bytes: Option<Integer<'py>>,
    quality: Option<Real>,
    psnr: Option<Real>,
    gaussians: Option<Integer<'py>>,
    #[pyo3(from_py_with = checked_effort)] effort: u8,
    tune: &str,
    #[pyo3(from_py_with = checked_texture)] texture: u8,
    first_layer: Option<Integer<'py>>,
    precision: &str,
    #[pyo3(from_py_with = threads::checked)] threads: usize,
    #[pyo3(from_py_with = checked_seed)] seed: u64,
    keep_invisible: bool,
    cicp: Option<(Integer<'py>, Integer<'py>)>,
    mastering_display: Option<DisplayFields<Real>>,
    content_light: Option<LightFields<Real>>,
    icc: Option<&Bound<'py, PyAny>>,
    exif: Option<&Bound<'py, PyAny>>,
    xmp: Option<&Bound<'py, PyAny>>,
    texts: Option<&Bound<'py, PyAny>>,
    metadata: &str,
    limits: Option<Limits>,
    importance: Option<&Bound<'py, PyAny>>,
    fitted: Option<&Bound<'py, PyAny>>,
    base_color: Option<&Bound<'py, PyAny>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyBytes>> {
    let target = target(bpp, bytes, quality, psnr, gaussians)?;
    let first_layer =
        first_layer.map(|bytes| bytes.within("first_layer", 80..=65_536)).transpose()?;
    let mut stored = metadata::of(cicp, mastering_display, content_light, icc, exif, xmp, texts)?;
    for loss in metadata::retain(&mut stored, metadata)? {
        warn(py, "MetadataWarning", &loss.to_string())?;
    }
    let encoder = Encoder::new()
        .with_target(target)
        .with_tune(tuning(tune)?)
        .with_effort(effort)
        .with_texture(texture)
        .with_first_layer(first_layer)
        .with_precision(self::precision(precision)?)
        .with_seed(seed)
        .with_keep_invisible(keep_invisible)
        .with_limits(Limits::of(limits))
        .with_metadata(stored);
    let picture = Picture::new(array)?;
    let source = picture.source()?;
    let encoder = match importance {
        Some(weights) => encoder.with_importance(Some(importance_of(weights, &source)?)),
        None => encoder,
    };
    let given = fitted.map(Given::new).transpose()?;
    let mut header = Header::new(source.width(), source.height(), source.color());
    header.depth = source.depth();
    if let (Some(fitted), Some(given)) = (fitted, &given) {
        header.color = given.color;
        check_header_of(fitted, &header)?;
        let base = match base_color {
            Some(base) => Some(base.clone()),
            None => given::header_field(fitted, "base_color")?,
        };
        if let Some(base) = base {
            let channels = given.color.channels();
            header.base_color[..channels].copy_from_slice(&given::base_color(&base, channels)?);
        }
    } else if base_color.is_some() {
        return Err(PyTypeError::new_err("base_color is that of fitted Gaussians"));
    }
    let drawn = ImageLimits::none();
    let fitted = given
        .as_ref()
        .map(|given| Gaussians::from_gaussians(&header, &given.gaussians, &drawn))
        .transpose()
        .map_err(|error| picture_error(py, &error))?;
    let encoded = py
        .detach(|| run(&encoder, &source, fitted.as_ref(), threads, progress.as_ref()))?
        .map_err(|error| encode_error(py, &error))?;
    if let Some(
        shortfall @ (Shortfall::PsnrBelow { .. }
        | Shortfall::QualityBelow { .. }
        | Shortfall::QualityCapped { .. }
        | Shortfall::SizeAbove { .. }),
    ) = encoded.report.shortfall
    {
        warn(py, "ShortfallWarning", &shortfall.to_string())?;
    }
    Ok(PyBytes::new(py, &encoded.bytes))
}

/// Refuses a mapping of Gaussians that says it is of another size, depth or kernel, as an exported .npz may.
fn check_header_of(fitted: &Bound<'_, PyAny>, header: &Header) -> PyResult<()> {
    let differs = |name: &str, found: &Bound<'_, PyAny>, wanted: &dyn Display| {
        Err(PyValueError::new_err(format!(
            "the Gaussians have the {name} {found}; it must be {wanted}"
        )))
    };
    let depth = header.depth.bits().into();
    for (name, wanted) in [("width", header.width), ("height", header.height), ("depth", depth)] {
        if let Some(found) = given::header_field(fitted, name)?
            && !found.eq(wanted)?
        {
            return differs(name, &found, &wanted);
        }
    }
    match given::header_field(fitted, "kernel")? {
        Some(found) if !found.eq("quartic")? => differs("kernel", &found, &"quartic"),
        _ => Ok(()),
    }
}

/// The importance of pixels.
#[derive(Debug)]
struct ImportanceMap {
    width: usize,
    values: Vec<f32>,
}

impl Importance for ImportanceMap {
    /// The mean of the pixels of a block.
    fn at(&self, [x, y]: [f32; 2]) -> f32 {
        let height = self.values.len() / self.width;
        let around = |middle: f32, length: usize| {
            let first = (middle as usize).saturating_sub(2).min(length - 1);
            first..(first + 4).min(length)
        };
        let (columns, rows) = (around(x, self.width), around(y, height));
        let count = (columns.len() * rows.len()) as f32;
        let row = |y: usize| self.values[y * self.width..][columns.clone()].iter().sum::<f32>();
        rows.map(row).sum::<f32>() / count
    }
}

/// The importance that an array gives to the pixels of a source.
fn importance_of(array: &Bound<'_, PyAny>, source: &Source<'_>) -> PyResult<Arc<dyn Importance>> {
    let [width, height] = [source.width(), source.height()].map(|side| side as usize);
    let wrong = || {
        let message =
            format!("importance must be a NumPy array of float32 and shape ({height}, {width})");
        PyValueError::new_err(message)
    };
    let array = array.cast::<PyArrayDyn<f32>>().map_err(|_| wrong())?;
    refuse_masked("importance", array.as_untyped())?;
    let array = array.try_readonly().map_err(|_| wrong())?;
    if array.shape() != [height, width] {
        return Err(wrong());
    }
    let mut values: Vec<f32> = vec_for(width * height)?;
    values.extend(array.as_array().iter());
    if !values.iter().all(|value| value.is_finite() && *value >= 0.0) {
        return Err(PyValueError::new_err("importance must be finite, and not negative"));
    }
    Ok(Arc::new(ImportanceMap { width, values }))
}

fn checked_effort(effort: &Bound<'_, PyAny>) -> PyResult<u8> {
    effort.extract::<Integer<'_>>()?.within("effort", 1..=7)
}

fn checked_texture(texture: &Bound<'_, PyAny>) -> PyResult<u8> {
    texture.extract::<Integer<'_>>()?.within("texture", 0..=100)
}

fn checked_seed(seed: &Bound<'_, PyAny>) -> PyResult<u64> {
    seed.extract::<Integer<'_>>()?.within("seed", 0..=u64::MAX)
}

/// The one target that is given. The encoder refuses fractions that are out of range.
fn target(
    bpp: Option<Real>,
    bytes: Option<Integer<'_>>,
    quality: Option<Real>,
    psnr: Option<Real>,
    gaussians: Option<Integer<'_>>,
) -> PyResult<Target> {
    let bytes = bytes.map(|bytes| bytes.within("bytes", 1..=1 << 30)).transpose()?;
    let gaussians = gaussians.map(|count| count.within("gaussians", 1..=1 << 22)).transpose()?;
    let targets = [
        bpp.map(|Real(bpp)| Target::BitsPerPixel(bpp)),
        bytes.map(Target::Bytes),
        quality.map(|Real(quality)| Target::Quality(quality)),
        psnr.map(|Real(psnr)| Target::Psnr(psnr)),
        gaussians.map(Target::Gaussians),
    ];
    let mut given = targets.into_iter().flatten();
    let target = given.next().unwrap_or_default();
    if given.next().is_some() {
        return Err(PyTypeError::new_err(
            "at most one of bpp, bytes, quality, psnr and gaussians may be given",
        ));
    }
    Ok(target)
}

/// The precision of this name.
pub(crate) fn precision(name: &str) -> PyResult<Precision> {
    match name {
        "entropy" => Ok(Precision::Entropy),
        "packed" => Ok(Precision::Packed),
        "f32" => Ok(Precision::Float),
        _ => Err(PyValueError::new_err(format!(
            "precision {name:?}; it must be \"entropy\", \"packed\" or \"f32\""
        ))),
    }
}

fn tuning(tune: &str) -> PyResult<Tune> {
    match tune {
        "visual" => Ok(Tune::Visual),
        "psnr" => Ok(Tune::Psnr),
        _ => {
            Err(PyValueError::new_err(format!("tune {tune:?}; it must be \"visual\" or \"psnr\"")))
        }
    }
}

/// What the threads that encode and the thread that waits for them tell each other.
#[derive(Default)]
struct Watch {
    state: Mutex<State>,
    changed: Condvar,
    is_cancelled: AtomicBool,
}

#[derive(Default)]
struct State {
    /// What was reported since the last look.
    news: Option<Progress>,
    is_done: bool,
}

impl Watch {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes a report of the encoder, and tells it whether to go on. `last` is the last one that was
    /// news.
    fn report(&self, progress: &Progress, last: &mut Option<Progress>) -> ControlFlow<()> {
        if self.is_cancelled.load(Ordering::Relaxed) {
            return ControlFlow::Break(());
        }
        // The encoder calls every few milliseconds, so that it can be cancelled.
        let is_news = last.is_none_or(|last| {
            progress.iteration != last.iteration || progress.fraction >= last.fraction + NEWS
        });
        if is_news {
            *last = Some(*progress);
            self.state().news = Some(*progress);
            self.changed.notify_one();
        }
        ControlFlow::Continue(())
    }

    /// Looks for signals and passes on reports until the encoder is done. Cancels it when a signal's
    /// handler or the callback raises an exception, or when the callback returns False. Returns
    /// whether it did not.
    fn attend(&self, callback: Option<&Py<PyAny>>) -> PyResult<bool> {
        loop {
            let state = self.state();
            let waits =
                |state: &mut State| !state.is_done && (callback.is_none() || state.news.is_none());
            let waited = self.changed.wait_timeout_while(state, INTERVAL, waits);
            let (mut state, _) = waited.unwrap_or_else(PoisonError::into_inner);
            let (news, is_done) = (state.news.take(), state.is_done);
            drop(state);
            let goes_on = Python::attach(|py| {
                py.check_signals()?;
                match (news, callback) {
                    (Some(news), Some(callback)) => call(py, callback, &news),
                    _ => Ok(true),
                }
            });
            if !matches!(goes_on, Ok(true)) {
                self.is_cancelled.store(true, Ordering::Relaxed);
                return goes_on;
            }
            if is_done {
                return Ok(true);
            }
        }
    }
}

/// Calls the callback. Returns whether to go on.
fn call(py: Python<'_>, callback: &Py<PyAny>, progress: &Progress) -> PyResult<bool> {
    let class = py.import("image_gip._types")?.getattr("Progress")?;
    let Progress { fraction, iteration, iterations, gaussians, psnr, .. } = *progress;
    let progress = class.call1((fraction, iteration, iterations, gaussians, psnr))?;
    let answer = callback.bind(py).call1((progress,))?;
    Ok(answer.is_none() || answer.is_truthy()?)
}

/// Tells that the encoder is done, even if it panics.
struct Done<'a>(&'a Watch);

impl Drop for Done<'_> {
    fn drop(&mut self) {
        self.0.state().is_done = true;
        self.0.changed.notify_one();
    }
}

/// Encodes on a pool of threads, while this thread attends to signals and to the callback.
fn run(
    encoder: &Encoder,
    source: &Source<'_>,
    fitted: Option<&Gaussians<'_>>,
    threads: usize,
    callback: Option<&Py<PyAny>>,
) -> PyResult<Result<Encoded, EncodeError>> {
    let watch = Watch::default();
    let mut encoded = None;
    let attended = threads::with_pool(threads, |pool| {
        pool.in_place_scope(|scope| {
            scope.spawn(|_| {
                let _done = Done(&watch);
                let mut last = None;
                let report = &mut |progress: &Progress| watch.report(progress, &mut last);
                encoded = Some(match fitted {
                    Some(fitted) => encoder.encode_fitted_with(source, fitted, report),
                    None => encoder.encode_with(source, report),
                });
            });
            watch.attend(callback)
        })
    })?;
    if !attended? {
        return Ok(Err(EncodeError::Cancelled));
    }
    Ok(encoded.expect("the scope waits for the encoder"))
}
