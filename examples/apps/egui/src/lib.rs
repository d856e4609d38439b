//! Shows `.gip` pictures in programs with egui, each rendered at the size that it has on the screen.
//!
//! ```
//! let context = egui::Context::default(); // that of the program
//! context.add_image_loader(std::sync::Arc::new(image_gip_egui::GipLoader::default()));
//! // From then on: ui.image("file://photo.gip"), with egui_extras' loader of files.
//! ```

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use egui::load::{BytesPoll, ImageLoadResult, ImageLoader, ImagePoll, LoadError};
use egui::{ColorImage, Context, SizeHint};
use image_gip::{ColorModel, DecodeError, Decoder, Header, RenderOptions};

/// Loads what ends in `.gip`. It keeps a picture for every size that was asked for.
#[derive(Default)]
pub struct GipLoader {
    images: Mutex<HashMap<(String, SizeHint), Arc<ColorImage>>>,
}

impl ImageLoader for GipLoader {
    fn id(&self) -> &str {
        concat!(module_path!(), "::GipLoader")
    }

    fn load(&self, context: &Context, uri: &str, hint: SizeHint) -> ImageLoadResult {
        if !uri.to_ascii_lowercase().ends_with(".gip") {
            return Err(LoadError::NotSupported);
        }
        let mut images = self.images.lock().unwrap_or_else(PoisonError::into_inner);
        let key = (uri.to_owned(), hint);
        if let Some(image) = images.get(&key) {
            return Ok(ImagePoll::Ready { image: Arc::clone(image) });
        }
        match context.try_load_bytes(uri)? {
            BytesPoll::Pending { size } => Ok(ImagePoll::Pending { size }),
            BytesPoll::Ready { bytes, .. } => {
                let image = decode(&bytes, hint).map(Arc::new);
                let image = image.map_err(|error| LoadError::Loading(error.to_string()))?;
                images.insert(key, Arc::clone(&image));
                Ok(ImagePoll::Ready { image })
            }
        }
    }

    fn forget(&self, uri: &str) {
        let mut images = self.images.lock().unwrap_or_else(PoisonError::into_inner);
        images.retain(|(kept, _), _| kept != uri);
    }

    fn forget_all(&self) {
        self.images.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }

    fn byte_size(&self) -> usize {
        let images = self.images.lock().unwrap_or_else(PoisonError::into_inner);
        images.values().map(|image| size_of_val(&image.pixels[..])).sum()
    }
}

/// The picture at the size of a hint, upright.
fn decode(file: &[u8], hint: SizeHint) -> Result<ColorImage, DecodeError> {
    let mut decoder = Decoder::new(file)?;
    let orientation = decoder.metadata().orientation();
    let (width, height) = shown_size(decoder.header(), orientation, hint);
    let (stored_width, stored_height) = orientation.turned_size(width, height);
    let options = RenderOptions::new().with_size(stored_width, stored_height);
    decoder.set_options(options.with_color(ColorModel::Rgba));
    let mut samples = vec![0; decoder.output_len()?];
    decoder.decode_into(&mut samples)?;
    let samples = orientation.apply(&samples, stored_width as usize, 4);
    Ok(ColorImage::from_rgba_unmultiplied([width as usize, height as usize], &samples))
}

/// Width and height of the upright picture on the screen.
fn shown_size(header: &Header, orientation: image_gip::Orientation, hint: SizeHint) -> (u32, u32) {
    let (width, height) = orientation.turned_size(header.width, header.height);
    let scaled = |scale: f64| {
        let side = |side: u32| (f64::from(side) * scale).round().max(1.0) as u32;
        (side(width), side(height))
    };
    let by = |shown: u32, stored: u32| f64::from(shown) / f64::from(stored);
    match hint {
        SizeHint::Scale(scale) => scaled(scale.into_inner().into()),
        SizeHint::Width(shown) => scaled(by(shown, width)),
        SizeHint::Height(shown) => scaled(by(shown, height)),
        SizeHint::Size { width: w, height: h, maintain_aspect_ratio: true } => {
            scaled(by(w, width).min(by(h, height)))
        }
        SizeHint::Size { width, height, .. } => (width.max(1), height.max(1)),
    }
}
