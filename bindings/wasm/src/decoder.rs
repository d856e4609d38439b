//! The push decoder and its renderings.

use image_gip::{DecodeError, Limits, Orientation, RenderOptions, StreamDecoder};
use wasm_bindgen::prelude::*;

use crate::errors::{exception, too_many_pixels};
use crate::layer_extents::{CRC, LayerExtents};
use crate::objects;
use crate::request::Request;
use crate::samples::{self, Sample};

/// Numbers per Gaussian in [`Decoder::gaussians`].
const GAUSSIAN_NUMBERS: usize = 9;

/// Decodes bytes as they arrive, and renders what has arrived.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Decoder {
    stream: StreamDecoder,
    limits: Limits,
    /// Most pixels of one rendering.
    max_output: u64,
    layer_extents: LayerExtents,
}

#[wasm_bindgen]
impl Decoder {
    /// A decoder with the limits of `js/limits.js`, in the order that they have there.
    #[wasm_bindgen(constructor)]
    #[expect(clippy::too_many_arguments, reason = "an array would take more code")]
    pub fn new(
        statistics: bool,
        width: f64,
        height: f64,
        pixels: f64,
        max_output: f64,
        gaussians: f64,
        memory: f64,
        work: f64,
    ) -> Self {
        let mut limits = Limits::default();
        // These casts clamp.
        limits.max_width = width as u32;
        limits.max_height = height as u32;
        limits.max_pixels = pixels as u64;
        limits.max_gaussians = gaussians as u32;
        limits.max_memory = memory as u64;
        limits.max_work = work as u64;
        let stream = StreamDecoder::new().with_limits(limits.clone());
        let stream = if statistics { stream.with_statistics() } else { stream };
        let max_output = max_output as u64;
        Self { stream, limits, max_output, layer_extents: LayerExtents::default() }
    }

    /// Takes the next bytes of the file.
    pub fn feed(&mut self, bytes: &[u8]) -> Result<(), JsValue> {
        let accepted = self.stream.feed(bytes).map_err(|error| exception(&error))?;
        self.layer_extents.feed(&bytes[..accepted]);
        Ok(())
    }

    /// Fails if the file is not complete.
    pub fn finish(&self) -> Result<(), JsValue> {
        self.stream.finish().map_err(|error| exception(&error))
    }

    /// Whether the whole file has arrived.
    pub fn complete(&self) -> bool {
        self.stream.is_complete()
    }

    /// The number of Gaussians that have arrived.
    pub fn arrived(&self) -> usize {
        self.stream.gaussians().len()
    }

    /// The header; `undefined` until it has arrived.
    pub fn header(&self) -> JsValue {
        self.stream.header().map_or(JsValue::UNDEFINED, objects::header)
    }

    /// How the picture is to be turned, as the value that Exif has; `undefined` until it is known.
    pub fn orientation(&self) -> Option<u8> {
        self.stream.orientation().map(Orientation::to_exif)
    }

    /// Whether a colour space has arrived: codes or an ICC profile.
    #[wasm_bindgen(js_name = hasColorSpace)]
    pub fn has_color_space(&self) -> bool {
        let metadata = self.stream.metadata();
        metadata.cicp.is_some() || metadata.icc_profile.is_some()
    }

    /// Whether the texture has arrived.
    #[wasm_bindgen(js_name = hasTexture)]
    pub fn has_texture(&self) -> bool {
        self.stream.picture().is_some_and(|picture| picture.texture_map().is_some())
    }

    /// The metadata that has arrived.
    pub fn metadata(&self) -> JsValue {
        objects::metadata(self.stream.metadata())
    }

    /// Chunks, layers, bits and steps of what has arrived.
    pub fn statistics(&self) -> JsValue {
        objects::statistics(&self.stream, self.layer_extents.extents())
    }

    /// How many Gaussians the first `bytes` of the file have, as far as its layers have arrived.
    #[wasm_bindgen(js_name = gaussiansIn)]
    pub fn gaussians_in(&self, bytes: f64) -> u32 {
        let mut bits = 0;
        for quantizer in self.stream.quantizers() {
            bits += u32::from(quantizer.bits());
        }
        let bits = f64::from(bits);
        let mut count = 0;
        for (&gaussians, &(_, end)) in self.stream.layers().iter().zip(self.layer_extents.extents())
        {
            if bytes >= end {
                count += gaussians;
            } else if bits > 0.0 {
                let codes = (f64::from(gaussians) * bits / 8.0).ceil();
                // The CRC comes after them.
                let missing = end - CRC as f64 - bytes;
                // The cast clamps.
                count += (((codes - missing) * 8.0 / bits) as u32).min(gaussians);
            }
        }
        count
    }

    /// How many Gaussians are enough for an output of this size; 0 until the header has arrived.
    #[wasm_bindgen(js_name = gaussiansFor)]
    pub fn gaussians_for(&self, width: u32, height: u32) -> u32 {
        self.stream.header().map_or(0, |header| header.gaussians_for(width, height))
    }

    /// The Gaussians from `start` to before `end` that have arrived: for each of them x and y of
    /// the centre, l11, l21 and l22 of the Cholesky factor, and four amplitudes.
    pub fn gaussians(&self, start: usize, end: usize) -> Vec<f32> {
        let all = self.stream.gaussians();
        let end = end.min(all.len());
        let chosen = &all[start.min(end)..end];
        let mut numbers = Vec::with_capacity(chosen.len() * GAUSSIAN_NUMBERS);
        for gaussian in chosen {
            numbers.extend_from_slice(&gaussian.center);
            numbers.extend_from_slice(&gaussian.cholesky);
            numbers.extend_from_slice(&gaussian.color);
        }
        numbers
    }

    /// The planes of the texture's map, as stored; `undefined` without texture.
    #[wasm_bindgen(js_name = textureMap)]
    pub fn texture_map(&self) -> Result<Option<Vec<f32>>, JsValue> {
        let Some(map) = self.stream.picture().and_then(|picture| picture.texture_map()) else {
            return Ok(None);
        };
        let options = RenderOptions::new();
        let sums = map.output_len(&options).and_then(|length| {
            let mut sums = vec![0.0; length];
            map.render_planes(&options, &mut sums).map(|()| sums)
        });
        sums.map(Some).map_err(|error| exception(&error))
    }

    /// Renders interleaved 8-bit samples, a `Uint8ClampedArray`. See [`Request::new`] for the numbers.
    pub fn render8(&mut self, request: &[u32]) -> Result<JsValue, JsValue> {
        self.render::<u8>(request)
    }

    /// Renders interleaved 16-bit samples, a `Uint16Array`. See [`Request::new`] for the numbers.
    pub fn render16(&mut self, request: &[u32]) -> Result<JsValue, JsValue> {
        self.render::<u16>(request)
    }
}

impl Decoder {
    fn render<T: Sample>(&mut self, request: &[u32]) -> Result<JsValue, JsValue> {
        let Some(header) = self.stream.header() else { return Err(no_header()) };
        let numbers = request.try_into().map_err(|_| JsValue::from("ten numbers"))?;
        let orientation = self.stream.orientation().unwrap_or_default();
        let request = Request::new(numbers, header, orientation);
        // All strips together may take the work that is allowed.
        let mut limits = self.limits.clone();
        limits.max_work /= u64::from(samples::strips(&request).1.max(1));
        self.stream.set_limits(limits).map_err(|error| exception(&error))?;
        let Some(picture) = self.stream.picture() else { return Err(no_header()) };
        // This checks that the region is inside the output.
        let options = request.options().map_err(|error| exception(&error))?;
        picture.output_len(&options).map_err(|error| exception(&error))?;
        if request.pixels() > self.max_output {
            return Err(too_many_pixels(request.pixels(), self.max_output));
        }
        let samples =
            samples::render::<T>(&picture, &request).map_err(|error| exception(&error))?;
        Ok(samples.into())
    }
}

/// The exception for a rendering before the header has arrived.
fn no_header() -> JsValue {
    exception(&DecodeError::UnexpectedEnd { chunk: None })
}
