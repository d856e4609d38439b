//! Pixels that are not square: .gip has no other, and the tool says so.

use std::io::Cursor;

use image::codecs::jpeg::{JpegEncoder, PixelDensity, PixelDensityUnit};
use image::{ColorType, ImageFormat};
use png::{PixelDimensions, Unit};
use tiff::encoder::{Rational, TiffEncoder, colortype};
use tiff::tags::Tag;

use super::pictures;
use super::room::{Room, text};

const SIZE: (u32, u32) = (8, 8);

/// Pixels per unit across and down.
type Density = (u32, u32);

fn samples() -> Vec<u8> {
    pictures::picture(SIZE, ColorType::L8).into_bytes()
}

fn written(format: ImageFormat) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let color = if format == ImageFormat::Hdr { ColorType::Rgb32F } else { ColorType::Rgb8 };
    let picture = pictures::picture(SIZE, color);
    let picture = if color == ColorType::Rgb32F { picture.to_rgb32f().into() } else { picture };
    picture.write_to(&mut file, format).expect("in memory");
    file.into_inner()
}

fn png((xppu, yppu): Density) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, SIZE.0, SIZE.1);
    encoder.set_pixel_dims(Some(PixelDimensions { xppu, yppu, unit: Unit::Unspecified }));
    let mut writer = encoder.write_header().expect("in memory");
    writer.write_image_data(&samples()).expect("in memory");
    writer.finish().expect("in memory");
    file
}

fn jpeg((x, y): Density) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = JpegEncoder::new(&mut file);
    let density = (x as u16, y as u16);
    encoder.set_pixel_density(PixelDensity { density, unit: PixelDensityUnit::PixelAspectRatio });
    encoder.encode(&samples(), SIZE.0, SIZE.1, ColorType::L8.into()).expect("in memory");
    file
}

fn tiff((x, y): Density, orientation: u16) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut file).expect("in memory");
    let mut page = encoder.new_image::<colortype::Gray8>(SIZE.0, SIZE.1).expect("in memory");
    page.x_resolution(Rational { n: x, d: 1 });
    page.y_resolution(Rational { n: y, d: 1 });
    page.encoder().write_tag(Tag::Orientation, orientation).expect("in memory");
    page.write_data(&samples()).expect("in memory");
    file.into_inner()
}

fn bmp((x, y): Density) -> Vec<u8> {
    let mut file = written(ImageFormat::Bmp);
    file[38..42].copy_from_slice(&x.to_le_bytes());
    file[42..46].copy_from_slice(&y.to_le_bytes());
    file
}

fn gif(ratio: u8) -> Vec<u8> {
    let mut file = written(ImageFormat::Gif);
    file[12] = ratio;
    file
}

fn hdr(height: &str) -> Vec<u8> {
    let file = written(ImageFormat::Hdr);
    let line = file.iter().position(|&byte| byte == b'\n').expect("a header") + 1;
    [&file[..line], b"PIXASPECT= ", height.as_bytes(), b"\n", &file[line..]].concat()
}

fn exr(pixel_aspect: f32) -> Vec<u8> {
    use ::exr::prelude::*;
    let size = (SIZE.0 as usize, SIZE.1 as usize);
    let pixels = SpecificChannels::rgb(|_: Vec2<usize>| (0.5_f32, 0.5_f32, 0.5_f32));
    let mut picture = Image::from_channels(size, pixels);
    picture.attributes.pixel_aspect = pixel_aspect;
    let mut file = Cursor::new(Vec::new());
    picture.write().to_buffered(&mut file).expect("in memory");
    file.into_inner()
}

#[test]
fn pixels_that_are_not_square_are_told() {
    let room = Room::new();
    let wide = |ratio| Some(format!("{ratio} times as wide as high"));
    let high = |ratio| Some(format!("{ratio} times as high as wide"));
    for (name, file, expected) in [
        ("a.png", png((100, 200)), wide("2")),
        ("b.png", png((1, u32::MAX)), wide("4294967295")),
        ("a.jpg", jpeg((200, 100)), high("2")),
        ("b.jpg", jpeg((10, 11)), wide("1.1")),
        ("a.tif", tiff((204, 98), 1), high("2.082")),
        // The picture is turned, and its pixels are with it.
        ("b.tif", tiff((204, 98), 6), wide("2.082")),
        ("a.bmp", bmp((1000, 3000)), wide("3")),
        ("a.gif", gif(113), wide("2")),
        ("a.hdr", hdr("1.5"), high("1.5")),
        ("a.exr", exr(2.0), wide("2")),
        // Square, or as good as.
        ("c.png", png((2835, 2834)), None),
        ("c.jpg", jpeg((300, 300)), None),
        ("c.tif", tiff((72, 72), 1), None),
        ("c.bmp", bmp((2834, 2835)), None),
        ("c.gif", gif(49), None),
        ("c.hdr", hdr("1"), None),
        ("c.exr", exr(1.0), None),
        // Nothing that is a ratio.
        ("d.png", png((0, 200)), None),
        ("d.jpg", jpeg((0, 0)), None),
        ("d.tif", tiff((1, 0), 1), None),
        ("d.bmp", bmp((u32::MAX, 1)), None),
        ("d.gif", gif(0), None),
    ] {
        room.write(name, file);
        let output = room.run(&["encode", name, "a.gip", "--effort", "1", "--gaussians", "1"]);
        assert!(output.status.success(), "{output:?}");
        let expected = expected.map_or(String::new(), |ratio| {
            format!("warning: {name}: its pixels, which are {ratio}, are taken as square\n")
        });
        assert_eq!(text(&output.stderr), expected);
    }
}
