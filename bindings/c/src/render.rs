//! Rendering into the caller's memory.

use core::ffi::c_void;

use image_gip::{DecodeError, Picture, RenderOptions};

use crate::decoder::{Bytes, Decoder, Input};
use crate::output::{Rows, Shape};
use crate::status::{Failure, Status, guard};
use crate::threads;
use crate::view::{Request, Samples, View};
use crate::{pointers, structures};

/// Renders a view of the picture to `out`: the rows of gip_output_size, each `stride` bytes after the one
/// before; 0 stands for rows without padding. Bytes between rows are left alone.
///
/// `view` may be null for the whole picture as it is stored. `out` has `size` bytes, and is aligned for its
/// samples, as `stride` is. It must not overlap the file. Rows with padding, GIP_SAMPLES_F32 and what is
/// composed take memory for a copy of the output beside, which gip_limits.max_memory does not count.
///
/// Of a file in memory, what the view needs is read and decoded, and a damaged file fails. Of a file that is
/// fed, the Gaussians that have arrived are rendered, after a failure as well; before the header has arrived
/// it fails with GIP_STATUS_NEED_MORE. GIP_STATUS_ARGUMENT and GIP_STATUS_LIMIT are as of gip_output_size;
/// memory and work may exceed a limit as well. What `out` has after a failure is not specified.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gip_render(
    decoder: *mut Decoder,
    view: *const View,
    out: *mut c_void,
    stride: usize,
    size: usize,
) -> Status {
    guard(|| {
        // SAFETY: the caller passes null or a view with its size.
        let view = unsafe { structures::read_or_default(view) }?;
        // SAFETY: the caller passes a decoder.
        let decoder = unsafe { Decoder::of(decoder) }?;
        // How it is aligned depends on the samples.
        pointers::check(out.cast::<u8>(), "the output")?;
        let state = decoder.read()?;
        let picture = state.input.picture()?;
        let request = view.request(picture.header())?;
        let shape = Shape::of(&request, &picture)?;
        drop(state);
        match request.samples {
            Samples::File | Samples::U8 => {
                // SAFETY: the caller passes so many bytes.
                let rows = unsafe { Rows::<u8>::new(out, stride, size, shape) }?;
                render(decoder, &request, shape, rows)
            }
            Samples::U16 => {
                // SAFETY: the caller passes so many bytes.
                let rows = unsafe { Rows::<u16>::new(out, stride, size, shape) }?;
                render(decoder, &request, shape, rows)
            }
            Samples::F32 | Samples::F32Planes => {
                // SAFETY: the caller passes so many bytes.
                let rows = unsafe { Rows::<f32>::new(out, stride, size, shape) }?;
                render(decoder, &request, shape, rows)
            }
        }
    })
}

/// A type of samples.
trait Sample: Copy + Default + Send {
    /// Whether they are rendered as planes.
    const IN_PLANES: bool;
    /// Renders what was decoded.
    fn draw(
        picture: &Picture<'_>,
        options: &RenderOptions,
        out: &mut [Self],
    ) -> Result<(), DecodeError>;
    /// Reads and decodes what a decoder's options need, and renders it.
    fn decode(decoder: &mut image_gip::Decoder<Bytes>, out: &mut [Self])
    -> Result<(), DecodeError>;
    /// The sample that is so much of 65535.
    fn from_full(value: u16) -> Self;
    /// A sample of this opacity over one of the background.
    fn over(self, opacity: Self, background: Self) -> Self;
}

impl Sample for u8 {
    const IN_PLANES: bool = false;

    fn draw(
        picture: &Picture<'_>,
        options: &RenderOptions,
        out: &mut [Self],
    ) -> Result<(), DecodeError> {
        picture.render_u8(options, out)
    }

    fn decode(
        decoder: &mut image_gip::Decoder<Bytes>,
        out: &mut [Self],
    ) -> Result<(), DecodeError> {
        decoder.decode_into(out)
    }

    fn from_full(value: u16) -> Self {
        ((u32::from(value) + 128) / 257) as Self
    }

    fn over(self, opacity: Self, background: Self) -> Self {
        let sum = u32::from(self) * u32::from(opacity)
            + u32::from(background) * u32::from(Self::MAX - opacity);
        ((sum + 127) / 255) as Self
    }
}

impl Sample for u16 {
    const IN_PLANES: bool = false;

    fn draw(
        picture: &Picture<'_>,
        options: &RenderOptions,
        out: &mut [Self],
    ) -> Result<(), DecodeError> {
        picture.render_u16(options, out)
    }

    fn decode(
        decoder: &mut image_gip::Decoder<Bytes>,
        out: &mut [Self],
    ) -> Result<(), DecodeError> {
        decoder.decode_into_u16(out)
    }

    fn from_full(value: u16) -> Self {
        value
    }

    fn over(self, opacity: Self, background: Self) -> Self {
        let sum = u64::from(self) * u64::from(opacity)
            + u64::from(background) * u64::from(Self::MAX - opacity);
        ((sum + 32767) / 65535) as Self
    }
}

impl Sample for f32 {
    const IN_PLANES: bool = true;

    fn draw(
        picture: &Picture<'_>,
        options: &RenderOptions,
        out: &mut [Self],
    ) -> Result<(), DecodeError> {
        picture.render_planes(options, out)
    }

    fn decode(
        decoder: &mut image_gip::Decoder<Bytes>,
        out: &mut [Self],
    ) -> Result<(), DecodeError> {
        decoder.decode_into_planes(out)
    }

    fn from_full(value: u16) -> Self {
        Self::from(value) / 65535.0
    }

    /// Of what shows: samples may be far outside of 0 to 1, where a decoder clamps them.
    fn over(self, opacity: Self, background: Self) -> Self {
        let opacity = opacity.clamp(0.0, 1.0);
        self.clamp(0.0, 1.0) * opacity + background * (1.0 - opacity)
    }
}

/// Renders to the caller's rows: directly, or by way of a copy where these are stored otherwise.
fn render<T: Sample>(
    decoder: &Decoder,
    request: &Request,
    shape: Shape,
    mut rows: Rows<T>,
) -> Result<(), Failure> {
    let is_as_rendered =
        !request.composes() && T::IN_PLANES == (request.samples == Samples::F32Planes);
    // A single channel is stored alike in planes and together.
    let is_as_rendered = is_as_rendered || !request.composes() && request.rendered.channels() == 1;
    if is_as_rendered && let Some(out) = rows.whole() {
        return fill(decoder, request, out);
    }
    let pixels = request.size.0 as usize * request.size.1 as usize;
    let mut samples = Vec::new();
    let length = pixels * request.rendered.channels();
    samples.try_reserve_exact(length).map_err(|_| {
        let bytes = length.saturating_mul(size_of::<T>());
        Failure::new(Status::Memory, format!("{bytes} bytes could not be allocated"))
    })?;
    samples.resize(length, T::default());
    fill(decoder, request, &mut samples)?;
    let rendered = Rendered { samples: &samples, pixels, channels: request.rendered.channels() };
    for row in 0..shape.rows {
        if is_as_rendered {
            rows.row(row).copy_from_slice(&samples[row * shape.row..][..shape.row]);
        } else {
            rendered.write_row(request, row, rows.row(row));
        }
    }
    Ok(())
}

/// Renders as the crate does.
fn fill<T: Sample>(decoder: &Decoder, request: &Request, out: &mut [T]) -> Result<(), Failure> {
    let state = decoder.read()?;
    if let Input::Fed(_) = state.input {
        let picture = state.input.picture()?;
        let options = &request.options;
        threads::decoding(request.threads, |threads| {
            T::draw(&picture, &options.clone().with_threads(threads), out)
        })??;
        return Ok(());
    }
    drop(state);
    let mut state = decoder.write()?;
    if request.gaussians.is_none() {
        state.check()?;
    }
    let Input::Memory(file) = &mut state.input else {
        return Err(Failure::new(Status::Internal, "a decoder has become another one"));
    };
    let rendered = threads::decoding(request.threads, |threads| {
        let options = request.options.clone().with_threads(threads);
        file.set_options(options.clone());
        match request.gaussians {
            None => T::decode(file, out),
            Some(count) => {
                file.read_at_least(count)?;
                T::draw(&file.picture()?, &options, out)
            }
        }
    })?;
    state.told(rendered)
}

/// Samples as they were rendered.
struct Rendered<'a, T> {
    samples: &'a [T],
    /// How many pixels there are.
    pixels: usize,
    channels: usize,
}

impl<T: Sample> Rendered<'_, T> {
    /// The sample of a channel of a pixel.
    fn at(&self, pixel: usize, channel: usize) -> T {
        let place = if T::IN_PLANES {
            channel * self.pixels + pixel
        } else {
            pixel * self.channels + channel
        };
        self.samples[place]
    }

    /// Writes a row of the output.
    fn write_row(&self, request: &Request, row: usize, out: &mut [T]) {
        let (width, height) = (request.size.0 as usize, request.size.1 as usize);
        let returned = request.returned.channels();
        if request.samples == Samples::F32Planes {
            let (plane, y) = (row / height, row % height);
            for (x, sample) in out.iter_mut().enumerate() {
                *sample = self.sample(request, y * width + x, plane);
            }
            return;
        }
        for (x, pixel) in out.chunks_exact_mut(returned).enumerate() {
            for (channel, sample) in pixel.iter_mut().enumerate() {
                *sample = self.sample(request, row * width + x, channel);
            }
        }
    }

    /// The sample that the caller gets.
    fn sample(&self, request: &Request, pixel: usize, channel: usize) -> T {
        if !request.composes() {
            return self.at(pixel, channel);
        }
        let colors = self.channels - 1;
        let sample = self.at(pixel, channel.min(colors - 1));
        sample.over(self.at(pixel, colors), T::from_full(request.background[channel]))
    }
}
