//! TIFF as other programs write it: palettes, floats, other colour models, alpha that was multiplied.

use std::io::Cursor;

use image::{DynamicImage, GenericImageView, ImageReader, Rgba};
use tiff::encoder::{Rational, TiffEncoder, colortype};
use tiff::tags::Tag;

use super::room::{Room, text};

/// The tags that say how many bits a sample has, what samples mean, and how many a pixel has.
const BITS: u16 = 258;
const PHOTOMETRIC: u16 = 262;
const FILL_ORDER: u16 = 266;
const SAMPLES: u16 = 277;
const COLOR_MAP: u16 = 320;
const EXTRA_SAMPLES: u16 = 338;
const FORMAT: u16 = 339;
const SUBSAMPLING: u16 = 530;

/// A file with these tags in ascending order and with these samples, which come last.
fn file((width, height): (u32, u32), tags: &[(u16, &[u32])], samples: &[u8]) -> Vec<u8> {
    let (width, height) = ([width], [height]);
    let mut tags = tags.to_vec();
    tags.extend([(256, &width[..]), (257, &height), (273, &[0]), (278, &height), (279, &[0])]);
    tags.sort_by_key(|(tag, _)| *tag);
    // All numbers are SHORT. Those that do not fit in an entry come after the directory.
    let bytes =
        |list: &[u32]| list.iter().flat_map(|v| (*v as u16).to_le_bytes()).collect::<Vec<_>>();
    let lists = tags.iter().map(|(_, list)| bytes(list)).filter(|list| list.len() > 4);
    let lists: Vec<u8> = lists.flatten().collect();
    let behind = 8 + 2 + 12 * tags.len() + 4;
    let (mut file, mut at) = ([&b"II*\0"[..], &8_u32.to_le_bytes()].concat(), behind);
    file.extend((tags.len() as u16).to_le_bytes());
    for (tag, list) in tags {
        let mut value = match tag {
            273 => bytes(&[(behind + lists.len()) as u32]),
            279 => bytes(&[samples.len() as u32]),
            _ => bytes(list),
        };
        if value.len() > 4 {
            let length = value.len();
            value = (at as u32).to_le_bytes().to_vec();
            at += length;
        }
        value.resize(4, 0);
        file.extend(tag.to_le_bytes());
        file.extend(3_u16.to_le_bytes());
        file.extend((list.len() as u32).to_le_bytes());
        file.extend(value);
    }
    file.extend([0; 4]);
    [file, lists, samples.to_vec()].concat()
}

/// RGB with 8 bits, with the directory before the samples.
pub(crate) fn rgb(size: (u32, u32), samples: &[u8]) -> Vec<u8> {
    file(size, &[(BITS, &[8, 8, 8]), (PHOTOMETRIC, &[2]), (SAMPLES, &[3])], samples)
}

/// The picture that the tool reads: a lossless way out of it is to compare with a PNG.
#[track_caller]
fn assert_read(room: &Room, tiff: &[u8], expected: &DynamicImage, most: u64) {
    room.write("a.tif", tiff);
    room.save_picture("b.png", expected);
    let comparison = room.json(&["compare", "a.tif", "b.png", "--json"]);
    assert!(
        comparison["max_abs_error"].as_u64().is_some_and(|error| error <= most),
        "{comparison}"
    );
}

fn gray(samples: &[u8]) -> DynamicImage {
    let image = image::GrayImage::from_raw(samples.len() as u32, 1, samples.to_vec());
    image.expect("a row").into()
}

fn colors(pixels: &[[u8; 3]]) -> DynamicImage {
    let image = image::RgbImage::from_raw(pixels.len() as u32, 1, pixels.concat());
    image.expect("a row").into()
}

#[test]
fn gray_of_few_bits_or_inverted() {
    let room = Room::new();
    for (bits, photometric, samples, expected) in [
        (1, 1, &[0b0110_0000][..], &[0, 255, 255, 0][..]),
        (1, 0, &[0b0110_0000], &[255, 0, 0, 255]),
        (2, 1, &[0b0001_1011], &[0, 85, 170, 255]),
        (4, 1, &[0x0F, 0x3C], &[0, 255, 51, 204]),
        (8, 0, &[0, 1, 254, 255], &[255, 254, 1, 0]),
    ] {
        let tags: [(u16, &[u32]); 2] = [(BITS, &[bits]), (PHOTOMETRIC, &[photometric])];
        assert_read(&room, &file((4, 1), &tags, samples), &gray(expected), 0);
    }
}

#[test]
fn the_first_pixel_may_be_in_the_lowest_bits() {
    let room = Room::new();
    let tags: [(u16, &[u32]); 3] = [(BITS, &[1]), (PHOTOMETRIC, &[1]), (FILL_ORDER, &[2])];
    let file = file((10, 1), &tags, &[0b0000_0110, 0b10]);
    assert_read(&room, &file, &gray(&[0, 255, 255, 0, 0, 0, 0, 0, 0, 255]), 0);
}

#[test]
fn palettes() {
    let room = Room::new();
    let [red, half, dark] = [[255, 0, 0], [128, 128, 128], [1, 2, 3]];
    let pixels = colors(&[dark, red, half, red]);
    for (bits, samples) in [(2, &[0b10_00_01_00][..]), (4, &[0x20, 0x10]), (8, &[2, 0, 1, 0])] {
        // All red values come first. Some programs repeat the 8 bits, and some do not shift them.
        for factor in [257, 1] {
            let mut map = vec![0_u32; 3 << bits];
            for (index, color) in [red, half, dark].into_iter().enumerate() {
                for (channel, value) in color.into_iter().enumerate() {
                    map[(channel << bits) + index] = u32::from(value) * factor;
                }
            }
            let tags: [(u16, &[u32]); 3] =
                [(BITS, &[bits]), (PHOTOMETRIC, &[3]), (COLOR_MAP, &map)];
            assert_read(&room, &file((4, 1), &tags, samples), &pixels, 0);
        }
    }
}

#[test]
fn floats_from_0_to_1_are_samples_like_integers() {
    let room = Room::new();
    let samples = [0.0_f32, 0.2, 1.0, 1.5].map(f32::to_le_bytes).concat();
    let tags: [(u16, &[u32]); 3] = [(BITS, &[32]), (PHOTOMETRIC, &[1]), (FORMAT, &[3])];
    assert_read(&room, &file((4, 1), &tags, &samples), &gray(&[0, 51, 255, 255]), 0);
}

#[test]
fn floats_that_are_clipped_or_no_numbers_are_told() {
    let room = Room::new();
    let tags: [(u16, &[u32]); 3] = [(BITS, &[32]), (PHOTOMETRIC, &[1]), (FORMAT, &[3])];
    for (samples, expected) in [
        ([0.0, 0.5, 1.001, 1.0], ""),
        (
            [0.0, 51.0, -2.0, 255.0],
            "75.00 % of its samples, which are from -2 to 255, are clipped to 0 to 1\n",
        ),
        ([0.0, f32::NAN, 1.0, 1.0], "25.00 % of its samples are not a number (NaN)"),
    ] {
        room.write("a.tif", file((4, 1), &tags, &samples.map(f32::to_le_bytes).concat()));
        let output = room.run(&["encode", "a.tif", "a.gip", "--effort", "1"]);
        let printed = text(&output.stderr);
        assert!(output.status.success(), "{printed}");
        assert!(
            printed.contains(expected) && printed.is_empty() == expected.is_empty(),
            "{printed}"
        );
    }
}

#[test]
fn other_colour_models() {
    let room = Room::new();
    // White, black, a gray, and a red: by the formulas of CIE 1976 and ITU-R BT.601.
    let pixels = colors(&[[255, 255, 255], [0, 0, 0], [119, 119, 119], [255, 0, 0]]);
    let lab = [[255, 0, 0], [0, 0, 0], [127, 0, 0], [138, 81, 70]].concat();
    let icc_lab = [[255, 128, 128], [0, 128, 128], [127, 128, 128], [138, 209, 198]].concat();
    let ycbcr = [[255, 128, 128], [0, 128, 128], [119, 128, 128], [76, 85, 255]].concat();
    let cmyk = [[0, 0, 0, 0], [0, 0, 0, 255], [0, 0, 0, 136], [0, 255, 255, 0]].concat();
    for (photometric, count, samples, most) in
        [(8, 3, lab, 5), (9, 3, icc_lab, 5), (6, 3, ycbcr, 2), (5, 4, cmyk, 0)]
    {
        let bits = vec![8; count as usize];
        let tags: [(u16, &[u32]); 4] = [
            (BITS, &bits),
            (PHOTOMETRIC, &[photometric]),
            (SAMPLES, &[count]),
            (SUBSAMPLING, &[1, 1]),
        ];
        assert_read(&room, &file((4, 1), &tags, &samples), &pixels, most);
    }
    // What is not read is told.
    let tags: [(u16, &[u32]); 3] = [(BITS, &[8, 8, 8]), (PHOTOMETRIC, &[6]), (SAMPLES, &[3])];
    room.write("a.tif", file((4, 2), &tags, &[0; 12]));
    let error = room.fails(&["encode", "a.tif", "a.gip"]);
    assert!(error.contains("chroma"), "{error}");
}

#[test]
fn weights_and_range_of_luma_and_chroma() {
    let room = Room::new();
    // As in ITU-R BT.709.
    let samples = [[235, 128, 128], [16, 128, 128], [118, 128, 128], [63, 102, 240]].concat();
    let pixels = colors(&[[255, 255, 255], [0, 0, 0], [119, 119, 119], [255, 0, 0]]);
    let rationals = |numbers: &[u32], d| numbers.iter().map(|&n| Rational { n, d }).collect();
    let weights: Vec<_> = rationals(&[2126, 7152, 722], 10_000);
    let range: Vec<_> = rationals(&[16, 235, 128, 240, 128, 240], 1);
    let mut file = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut file).expect("in memory");
    let mut page = encoder.new_image::<colortype::YCbCr8>(4, 1).expect("in memory");
    let tags = page.encoder();
    tags.write_tag(Tag::ChromaSubsampling, &[1_u16, 1][..]).expect("in memory");
    tags.write_tag(Tag::Unknown(529), &weights[..]).expect("in memory");
    tags.write_tag(Tag::Unknown(532), &range[..]).expect("in memory");
    page.write_data(&samples).expect("in memory");
    assert_read(&room, &file.into_inner(), &pixels, 2);
}

#[test]
fn primaries_are_told_unless_they_are_those_of_srgb() {
    let room = Room::new();
    let white = &[3127, 3290][..];
    let srgb = &[6400, 3300, 3000, 6000, 1500, 600][..];
    let adobe = &[6400, 3300, 2100, 7100, 1500, 600][..];
    for (white, primaries, has_transfer, is_told) in [
        (white, srgb, false, false),
        (&[3457, 3585], srgb, false, true),
        (white, adobe, false, true),
        (white, &[], false, true),
        (&[], srgb, false, true),
        (white, srgb, true, true),
    ] {
        let mut file = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut file).expect("in memory");
        let mut page = encoder.new_image::<colortype::RGB8>(4, 1).expect("in memory");
        let tags = page.encoder();
        if has_transfer {
            tags.write_tag(Tag::Unknown(301), &[7_u16; 256][..]).expect("in memory");
        }
        for (tag, list) in [(318, white), (319, primaries)] {
            let list: Vec<_> = list.iter().map(|&n| Rational { n, d: 10_000 }).collect();
            if !list.is_empty() {
                tags.write_tag(Tag::Unknown(tag), &list[..]).expect("in memory");
            }
        }
        page.write_data(&[90; 12]).expect("in memory");
        room.write("a.tif", file.into_inner());
        let output = room.run(&["encode", "a.tif", "a.gip", "--effort", "1"]);
        let told = "its white point, primaries or transfer function cannot be kept";
        assert_eq!(text(&output.stderr).contains(told), is_told, "{}", text(&output.stderr));
    }
}

#[test]
fn a_profile_or_xmp_outside_of_the_file_is_told() {
    let room = Room::new();
    let mut profile = [7; 200];
    profile[..4].copy_from_slice(&200_u32.to_be_bytes());
    profile[16..20].copy_from_slice(b"GRAY");
    for (tag, name, expected) in [
        (Tag::IccProfile, "icc_profile", "its ICC profile is damaged and cannot be kept"),
        (Tag::Unknown(700), "xmp", "the XMP is damaged and was dropped"),
    ] {
        let mut file = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut file).expect("in memory");
        let mut page = encoder.new_image::<colortype::Gray8>(4, 1).expect("in memory");
        page.encoder().write_tag(tag, &profile[..]).expect("in memory");
        page.write_data(&[1, 2, 3, 4]).expect("in memory");
        let file = file.into_inner();
        let start = [tag.to_u16().to_le_bytes(), [1, 0], [200, 0], [0, 0]].concat();
        let entry = file.windows(8).position(|bytes| bytes == start).expect("an entry");
        let with = |at: usize, number: u32| {
            let mut file = file.clone();
            file[at..at + 4].copy_from_slice(&number.to_le_bytes());
            file
        };
        let (length, offset) = (entry + 4, entry + 8);
        for (file, is_kept) in [
            (file.clone(), true),
            (with(offset, file.len() as u32), false),
            (with(offset, file.len() as u32 - 199), false),
            (with(offset, u32::MAX), false),
            (with(length, 1 << 20), false),
            (with(length, u32::MAX), false),
        ] {
            room.write("a.tif", file);
            let output = room.run(&["encode", "a.tif", "a.gip", "--effort", "1"]);
            let printed = text(&output.stderr);
            assert!(output.status.success(), "{printed}");
            let warning = format!("warning: a.tif: {expected}\n");
            assert_eq!(printed, if is_kept { "" } else { &warning });
            let kept = room.json(&["info", "a.gip", "--json"])["metadata"][name].as_u64();
            assert_eq!(kept, is_kept.then_some(200));
        }
    }
}

#[test]
fn alpha_and_other_channels() {
    let room = Room::new();
    let pixels = [[200, 100, 50, 255], [100, 50, 25, 128], [0, 0, 0, 0]];
    let image = |pixels: [[u8; 4]; 3]| -> DynamicImage {
        let image = image::RgbaImage::from_raw(3, 1, pixels.concat());
        image.expect("a row").into()
    };
    let tags = |extra: &'static [u32]| -> [(u16, &[u32]); 4] {
        [(BITS, &[8, 8, 8, 8]), (PHOTOMETRIC, &[2]), (SAMPLES, &[4]), (EXTRA_SAMPLES, extra)]
    };
    let with = |extra| file((3, 1), &tags(extra), &pixels.concat());
    assert_read(&room, &with(&[2]), &image(pixels), 0);
    let divided = [[200, 100, 50, 255], [199, 100, 50, 128], [0, 0, 0, 0]];
    assert_read(&room, &with(&[1]), &image(divided), 0);
    // A channel without a meaning is left out.
    assert_read(&room, &with(&[0]), &image(pixels.map(|[r, g, b, _]| [r, g, b, 255])), 0);
    // Gray with alpha.
    let tags: [(u16, &[u32]); 4] =
        [(BITS, &[8, 8]), (PHOTOMETRIC, &[1]), (SAMPLES, &[2]), (EXTRA_SAMPLES, &[2])];
    let gray_alpha = image::GrayAlphaImage::from_raw(2, 1, vec![9, 255, 200, 7]);
    let gray_alpha = DynamicImage::from(gray_alpha.expect("a row"));
    assert_read(&room, &file((2, 1), &tags, &[9, 255, 200, 7]), &gray_alpha, 0);
}

#[test]
fn channels_that_are_left_out_are_told() {
    let room = Room::new();
    let bits = [8; 6];
    for (photometric, count, extra, left_out) in [
        (2_u32, 4_u32, &[2_u32][..], 0),
        (2, 4, &[0], 1),
        (2, 6, &[1, 0, 0], 2),
        (2, 5, &[0, 2], 2),
        (1, 3, &[2, 0], 1),
        (5, 6, &[0, 0], 2),
    ] {
        let tags: [(u16, &[u32]); 4] = [
            (BITS, &bits[..count as usize]),
            (PHOTOMETRIC, &[photometric]),
            (SAMPLES, &[count]),
            (EXTRA_SAMPLES, extra),
        ];
        room.write("a.tif", file((2, 1), &tags, &[9; 12][..2 * count as usize]));
        let output = room.run(&["encode", "a.tif", "a.gip", "--effort", "1"]);
        assert!(output.status.success(), "{output:?}");
        let expected = match left_out {
            0 => String::new(),
            _ => format!(
                "warning: a.tif: what it has beside colours and alpha ({left_out} of its {count} \
                 channels) is left out\n"
            ),
        };
        assert_eq!(text(&output.stderr), expected);
    }
}

#[test]
fn what_of_its_colours_is_lost_is_told() {
    let room = Room::new();
    let tags: [(u16, &[u32]); 3] = [(BITS, &[8, 8, 8]), (PHOTOMETRIC, &[8]), (SAMPLES, &[3])];
    room.write("a.tif", file((2, 1), &tags, &[255, 0, 0, 9, 0, 0]));
    let output = room.run(&["encode", "a.tif", "a.gip", "--effort", "1"]);
    assert!(text(&output.stderr).starts_with("warning: a.tif: its CIELAB colours"), "{output:?}");
    room.ok(&["decode", "a.gip", "a.png"]);
    let reader = ImageReader::open(room.path("a.png")).expect("it was written");
    let picture = reader.decode().expect("a picture");
    let Rgba([r, g, b, _]) = picture.get_pixel(0, 0);
    assert!([r, g, b].iter().all(|sample| *sample > 240), "white");
}
