//! Shows a `.gip` picture in a program with iced, upright, as large as there is room, and rendered for just
//! these pixels.
//!
//! ```no_run
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let picture = image_gip_iced::GipPicture::new(&std::fs::read("photo.gip")?)?;
//! // In `view` of the program, with the scale factor of its window:
//! let scale_factor = 1.0;
//! let element: iced_core::Element<'_, (), iced_core::Theme, iced_widget::Renderer> =
//!     picture.view(scale_factor);
//! # Ok(())
//! # }
//! ```

use std::cell::RefCell;

use iced_core::image::{self, Handle};
use iced_core::{Element, Length, Size, text, widget};
use iced_widget::{Image, Responsive, Text};
use image_gip::{ColorModel, DecodeError, RenderOptions, StreamDecoder};

/// A picture as Gaussians, and as pixels of the size at which it was last shown.
pub struct GipPicture {
    decoder: StreamDecoder,
    shown: RefCell<Option<((u32, u32), Handle)>>,
}

impl GipPicture {
    /// Decodes a file to Gaussians.
    pub fn new(file: &[u8]) -> Result<Self, DecodeError> {
        let mut decoder = StreamDecoder::new();
        decoder.feed(file)?;
        decoder.finish()?;
        Ok(Self { decoder, shown: RefCell::default() })
    }

    /// Fills the room that there is, of which the picture takes the centre. `scale_factor` is that of the
    /// window: pixels of the screen for one of iced.
    pub fn view<'a, Message, Theme, Renderer>(
        &'a self,
        scale_factor: f32,
    ) -> Element<'a, Message, Theme, Renderer>
    where
        Message: 'a,
        Theme: widget::text::Catalog + 'a,
        Renderer: text::Renderer + image::Renderer<Handle = Handle> + 'a,
    {
        let view = move |room: Size| match self.handle(room * scale_factor) {
            Ok(handle) => Image::new(handle).width(Length::Fill).height(Length::Fill).into(),
            Err(error) => Text::new(error.to_string()).into(),
        };
        Responsive::new(view).into()
    }

    /// The picture at the largest size within some pixels. It is rendered when that changes.
    fn handle(&self, room: Size) -> Result<Handle, DecodeError> {
        let picture = self.decoder.picture().expect("the file is complete");
        let orientation = self.decoder.metadata().orientation();
        let header = picture.header();
        let (width, height) = orientation.turned_size(header.width, header.height);
        let scale = (room.width / width as f32).min(room.height / height as f32);
        let side = |side: u32| (side as f32 * scale).round().max(1.0) as u32;
        let size = (side(width), side(height));
        let mut shown = self.shown.borrow_mut();
        if let Some((_, handle)) = shown.as_ref().filter(|(shown, _)| *shown == size) {
            return Ok(handle.clone());
        }
        let (width, height) = orientation.turned_size(size.0, size.1);
        let options = RenderOptions::new().with_size(width, height).with_color(ColorModel::Rgba);
        let mut samples = vec![0; picture.output_len(&options)?];
        picture.render_u8(&options, &mut samples)?;
        let samples = orientation.apply(&samples, width as usize, 4);
        let handle = Handle::from_rgba(size.0, size.1, samples);
        *shown = Some((size, handle.clone()));
        Ok(handle)
    }
}
