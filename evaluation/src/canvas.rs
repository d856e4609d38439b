//! Pictures made of pictures and lines of text.

use std::convert::Infallible;
use std::path::Path;

use anyhow::{Context, Result, bail};
use embedded_graphics::mono_font::{MonoTextStyle, ascii};
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::{
    DrawTarget, Drawable, OriginDimensions, Pixel, Point, RgbColor, Size,
};
use embedded_graphics::text::{Baseline, Text};
use image::codecs::jpeg::JpegEncoder;
use image::{Rgb, RgbImage, imageops};

use crate::files;

/// The height of a line of text in pixels.
pub(crate) const LINE: u32 = 12;

/// Of JPEGs, from two bits per pixel to what still shows the differences that the sheets are about.
const QUALITIES: [u8; 7] = [88, 80, 75, 70, 65, 60, 55];

/// A white canvas.
#[derive(Debug)]
pub(crate) struct Canvas(RgbImage);

impl Canvas {
    pub(crate) fn new(width: u32, height: u32) -> Self {
        Self(RgbImage::from_pixel(width, height, Rgb([255; 3])))
    }

    /// Puts a picture at a place; what is beyond the canvas is cut off.
    pub(crate) fn paste(&mut self, picture: &RgbImage, (x, y): (u32, u32)) {
        imageops::replace(&mut self.0, picture, x.into(), y.into());
    }

    /// Writes a line of text, whose upper left corner is at a place.
    pub(crate) fn write(&mut self, text: &str, (x, y): (u32, u32)) {
        let style = MonoTextStyle::new(&ascii::FONT_6X12, Rgb888::BLACK);
        let text = Text::with_baseline(text, Point::new(x as i32, y as i32), style, Baseline::Top);
        match text.draw(self) {
            Ok(_) => {}
            Err(impossible) => match impossible {},
        }
    }

    pub(crate) fn save_png(&self, path: &Path) -> Result<()> {
        self.0.save(path).with_context(|| format!("cannot write {}", path.display()))
    }

    /// Writes a JPEG of at most so many bytes, at the best of some qualities that allows it.
    ///
    /// # Errors
    /// When none of them does.
    pub(crate) fn save_jpeg(&self, path: &Path, most: usize) -> Result<()> {
        for quality in QUALITIES {
            let mut bytes = Vec::new();
            JpegEncoder::new_with_quality(&mut bytes, quality).encode_image(&self.0)?;
            if bytes.len() <= most {
                return files::replace(path, &bytes);
            }
        }
        bail!("{} is too large for {most} bytes", path.display())
    }
}

impl OriginDimensions for Canvas {
    fn size(&self) -> Size {
        Size::new(self.0.width(), self.0.height())
    }
}

impl DrawTarget for Canvas {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb888>>>(
        &mut self,
        pixels: I,
    ) -> Result<(), Infallible> {
        for Pixel(Point { x, y }, color) in pixels {
            // A negative coordinate is beyond the canvas, too.
            if let Some(pixel) = self.0.get_pixel_mut_checked(x as u32, y as u32) {
                *pixel = Rgb([color.r(), color.g(), color.b()]);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn text_and_pictures_are_drawn_and_cut_off_at_the_edges() {
        let mut canvas = Canvas::new(20, 12);
        canvas.paste(&RgbImage::from_pixel(30, 2, Rgb([9; 3])), (15, 11));
        canvas.write("Hello, world", (1, 0));
        let dark = canvas.0.pixels().filter(|pixel| pixel.0 == [0; 3]).count();
        assert!((10..60).contains(&dark), "{dark}");
        assert_eq!(canvas.0.get_pixel(19, 11).0, [9; 3]);
        assert_eq!(canvas.0.get_pixel(14, 11).0, [255; 3]);
    }

    #[test]
    fn a_jpeg_has_at_most_the_bytes_that_it_may_have() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.jpg");
        let mut canvas = Canvas::new(64, 64);
        let mut random = fastrand::Rng::with_seed(0);
        let noise = (0..64 * 64 * 3).map(|_| random.u8(..)).collect();
        canvas.paste(&RgbImage::from_raw(64, 64, noise).expect("as many samples"), (0, 0));
        let save = |most| {
            canvas.save_jpeg(&path, most).map(|()| fs::metadata(&path).expect("it is there").len())
        };
        let best = save(1 << 20).expect("it is enough");
        let less = save(best as usize - 1).expect("a lower quality has less");
        assert!(less < best && less > best / 2, "{less} of {best}");
        fs::remove_file(&path).expect("it is there");
        assert!(save(100).is_err() && !path.exists());
    }
}
