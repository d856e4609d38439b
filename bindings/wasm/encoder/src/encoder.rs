//! An encoder whose options are set one after the other.

use core::ops::ControlFlow;

use image_gip::{Cicp, ColorModel, Encoded, Metadata, Source, SourceError, Target, Text, Tune};
use wasm_bindgen::prelude::*;

use crate::js::{exception, new_encoded, progressed};

/// Encodes one picture.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Encoder {
    options: image_gip::Encoder,
    metadata: Metadata,
}

#[wasm_bindgen]
impl Encoder {
    /// With these options. `target` is the name of one of the targets of `js/encoder-core.js`, `tune` is whether to
    /// tune for what a person sees, `first_layer` may be 0 for one of the usual size.
    #[wasm_bindgen(constructor)]
    #[expect(clippy::too_many_arguments, reason = "an object would take more code")]
    pub fn new(
        target: &str,
        value: f64,
        visual: bool,
        effort: u8,
        texture: u8,
        first_layer: u32,
        seed: u32,
        keep_invisible: bool,
    ) -> Self {
        // These casts clamp.
        let target = match target {
            "gaussians" => Target::Gaussians(value as u32),
            "bytes" => Target::Bytes(value as u64),
            "bpp" => Target::BitsPerPixel(value),
            "psnr" => Target::Psnr(value),
            _ => Target::Quality(value),
        };
        let options = image_gip::Encoder::new()
            .with_target(target)
            .with_tune(if visual { Tune::Visual } else { Tune::Psnr })
            .with_effort(effort)
            .with_texture(texture)
            .with_first_layer((first_layer > 0).then_some(first_layer))
            .with_seed(seed.into())
            .with_keep_invisible(keep_invisible);
        Self { options, metadata: Metadata::default() }
    }

    /// The colour space in codes.
    #[wasm_bindgen(js_name = setCicp)]
    pub fn set_cicp(&mut self, primaries: u8, transfer: u8) {
        self.metadata.cicp = Some(Cicp::new(primaries, transfer));
    }

    /// The ICC profile.
    #[wasm_bindgen(js_name = setIccProfile)]
    pub fn set_icc_profile(&mut self, bytes: Vec<u8>) {
        self.metadata.icc_profile = Some(bytes);
    }

    /// Exif data.
    #[wasm_bindgen(js_name = setExif)]
    pub fn set_exif(&mut self, bytes: Vec<u8>) {
        self.metadata.exif = Some(bytes);
    }

    /// An XMP packet.
    #[wasm_bindgen(js_name = setXmp)]
    pub fn set_xmp(&mut self, text: String) {
        self.metadata.xmp = Some(text.into_bytes());
    }

    /// One more text.
    #[wasm_bindgen(js_name = addText)]
    pub fn add_text(&mut self, keyword: String, text: String) {
        self.metadata.texts.push(Text::new(keyword, text));
    }

    /// Encodes interleaved 8-bit samples, and frees the encoder.
    pub fn encode8(
        self,
        width: u32,
        height: u32,
        channels: u8,
        samples: &[u8],
    ) -> Result<JsValue, JsValue> {
        self.encode(Source::new_u8(width, height, model(channels), samples))
    }

    /// Encodes interleaved 16-bit samples, and frees the encoder.
    pub fn encode16(
        self,
        width: u32,
        height: u32,
        channels: u8,
        samples: &[u16],
    ) -> Result<JsValue, JsValue> {
        self.encode(Source::new_u16(width, height, model(channels), samples))
    }
}

impl Encoder {
    fn encode(self, source: Result<Source<'_>, SourceError>) -> Result<JsValue, JsValue> {
        let source = source.map_err(|error| exception(&error.into()))?;
        let encoder = self.options.with_metadata(self.metadata);
        let mut progress = |progress: &_| {
            if progressed(progress) { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        };
        let encoded = encoder.encode_with(&source, &mut progress);
        let Encoded { bytes, report, .. } = encoded.map_err(|error| exception(&error))?;
        Ok(new_encoded(
            &bytes,
            report.gaussians,
            report.psnr,
            report.quality,
            report.texture_bytes as f64,
            report.iterations,
            report.shortfall.map(|shortfall| shortfall.to_string()),
        ))
    }
}

/// The colour model of so many channels.
fn model(channels: u8) -> ColorModel {
    match channels {
        1 => ColorModel::Gray,
        2 => ColorModel::GrayAlpha,
        3 => ColorModel::Rgb,
        _ => ColorModel::Rgba,
    }
}
