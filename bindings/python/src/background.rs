//! Pictures with alpha, over a background.

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::numbers::{Real, shown};

/// The colour behind a picture, as the caller gives it: one sample, or one per channel.
#[derive(Debug)]
pub(crate) struct Background(Vec<f64>);

impl Background {
    /// Checks that an object is a number or several.
    pub(crate) fn new(object: &Bound<'_, PyAny>) -> PyResult<Self> {
        let numbers = match object.extract() {
            Ok(Real(number)) => Some(vec![number]),
            Err(_) => object
                .try_iter()
                .and_then(|items| {
                    items.map(|item| item?.extract().map(|Real(number)| number)).collect()
                })
                .ok(),
        };
        numbers.map(Self).ok_or_else(|| {
            PyTypeError::new_err("background must be a number, or one for each colour channel")
        })
    }

    /// The samples for so many channels of colour.
    pub(crate) fn samples<T: Sample>(&self, channels: usize) -> PyResult<Vec<T>> {
        let samples = self.0.iter().map(|&number| {
            T::from_number(number).ok_or_else(|| {
                let (number, full) = (shown(number), T::FULL);
                PyValueError::new_err(format!("background {number}; it must be 0 to {full}"))
            })
        });
        let samples: Vec<T> = samples.collect::<PyResult<_>>()?;
        match *samples {
            [gray] => Ok(vec![gray; channels]),
            _ if samples.len() == channels => Ok(samples),
            _ => Err(PyValueError::new_err(format!(
                "background has {} numbers; it must be one, or one for each colour channel: \
                 {channels}",
                samples.len()
            ))),
        }
    }
}

/// A type of samples.
pub(crate) trait Sample: Copy + Default + core::fmt::Display {
    /// White, or opaque.
    const FULL: Self;
    /// The sample that is this number; `None` if it is out of range.
    fn from_number(number: f64) -> Option<Self>;
    /// A sample of this opacity over one of the background.
    fn over(self, opacity: Self, background: Self) -> Self;
}

impl Sample for u8 {
    const FULL: Self = Self::MAX;

    fn from_number(number: f64) -> Option<Self> {
        (0.0..=255.0).contains(&number).then_some((number + 0.5) as Self)
    }

    fn over(self, opacity: Self, background: Self) -> Self {
        let sum = u32::from(self) * u32::from(opacity)
            + u32::from(background) * u32::from(Self::MAX - opacity);
        ((sum + 127) / 255) as Self
    }
}

impl Sample for u16 {
    const FULL: Self = Self::MAX;

    fn from_number(number: f64) -> Option<Self> {
        (0.0..=65535.0).contains(&number).then_some((number + 0.5) as Self)
    }

    fn over(self, opacity: Self, background: Self) -> Self {
        let sum = u32::from(self) * u32::from(opacity)
            + u32::from(background) * u32::from(Self::MAX - opacity);
        ((sum + 32767) / 65535) as Self
    }
}

impl Sample for f32 {
    const FULL: Self = 1.0;

    fn from_number(number: f64) -> Option<Self> {
        (0.0..=1.0).contains(&number).then_some(number as Self)
    }

    /// Of what shows: samples may be far outside of 0 to 1, where a decoder clamps them.
    fn over(self, opacity: Self, background: Self) -> Self {
        let opacity = opacity.clamp(0.0, 1.0);
        self.clamp(0.0, 1.0) * opacity + background * (1.0 - opacity)
    }
}

/// The channels of a picture on their way to the caller.
#[derive(Debug)]
pub(crate) struct Channels<'a> {
    /// How many are rendered.
    pub(crate) rendered: usize,
    /// How many the caller gets.
    pub(crate) returned: usize,
    /// Whether the last one that is rendered is alpha, which the caller does not get.
    pub(crate) drops_alpha: bool,
    /// What the caller gives as the background; else it is white.
    pub(crate) background: Option<&'a Background>,
    /// Whether the caller gets one plane per channel.
    pub(crate) planar: bool,
}

/// The caller's samples, of one type.
#[derive(Debug)]
pub(crate) struct Pixels<'a, T> {
    out: &'a mut [T],
    /// Where the picture is rendered first, if what is rendered is not what the caller gets.
    scratch: Option<&'a mut [T]>,
    rendered: usize,
    /// What pixels with alpha are composed over.
    background: Option<Vec<T>>,
    /// Whether `out` is one plane per channel.
    planar: bool,
}

impl Channels<'_> {
    /// The samples `out`. A background that is wrong is refused, whether it shows or not.
    pub(crate) fn pixels<'a, T: Sample>(
        &self,
        out: &'a mut [T],
        scratch: Option<&'a mut [T]>,
    ) -> PyResult<Pixels<'a, T>> {
        let given = self.background.map(|given| given.samples(self.returned)).transpose()?;
        let background = || given.unwrap_or_else(|| vec![T::FULL; self.returned]);
        let background = self.drops_alpha.then(background);
        Ok(Pixels { out, scratch, rendered: self.rendered, background, planar: self.planar })
    }
}

impl<T: Sample> Pixels<'_, T> {
    /// Has the samples rendered interleaved.
    pub(crate) fn fill<E>(self, render: impl FnOnce(&mut [T]) -> Result<(), E>) -> Result<(), E> {
        let Self { out, scratch, rendered, background, planar } = self;
        let Some(pixels) = scratch else { return render(out) };
        render(pixels)?;
        let channel = |channel| pixels.chunks_exact(rendered).map(move |pixel| pixel[channel]);
        fill_channels(out, rendered, background, planar, channel);
        Ok(())
    }

    /// Has the samples rendered as planes.
    pub(crate) fn fill_from_planes<E>(
        self,
        render: impl FnOnce(&mut [T]) -> Result<(), E>,
    ) -> Result<(), E> {
        let Self { out, scratch, rendered, background, planar } = self;
        let Some(planes) = scratch else { return render(out) };
        render(planes)?;
        let pixels = planes.len() / rendered;
        let channel = |channel| planes[channel * pixels..][..pixels].iter().copied();
        fill_channels(out, rendered, background, planar, channel);
        Ok(())
    }
}

/// Fills the caller's samples from all of each rendered channel. With a background, which has as many channels as
/// `out`, the last one is alpha, and pixels are composed over it; gray is repeated.
fn fill_channels<T: Sample, I: Iterator<Item = T>>(
    out: &mut [T],
    rendered: usize,
    background: Option<Vec<T>>,
    planar: bool,
    channel: impl Fn(usize) -> I,
) {
    match background {
        None => {
            for at in 0..rendered {
                fill_channel(out, (at, rendered), planar, channel(at));
            }
        }
        Some(background) => {
            let colors = rendered - 1;
            for (at, &behind) in background.iter().enumerate() {
                let pixels = channel(at.min(colors - 1)).zip(channel(colors));
                let composed = pixels.map(|(color, opacity)| color.over(opacity, behind));
                fill_channel(out, (at, background.len()), planar, composed);
            }
        }
    }
}

/// Fills one channel of so many in samples that are interleaved or planes.
fn fill_channel<T>(
    out: &mut [T],
    (channel, channels): (usize, usize),
    planar: bool,
    samples: impl Iterator<Item = T>,
) {
    if planar {
        let pixels = out.len() / channels;
        for (out, sample) in out[channel * pixels..][..pixels].iter_mut().zip(samples) {
            *out = sample;
        }
    } else {
        for (out, sample) in out.chunks_exact_mut(channels).zip(samples) {
            out[channel] = sample;
        }
    }
}
