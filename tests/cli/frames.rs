//! Files of several pictures: the first is taken, and the tool says so.

use std::io::Cursor;

use image::codecs::gif::GifEncoder;
use image::{ColorType, Frame, ImageFormat};
use serde_json::{Value, json};
use tiff::encoder::{TiffEncoder, colortype};
use tiff::tags::Tag;

use super::pictures;
use super::room::{Room, by_input, text};

const SIZE: (u32, u32) = (24, 16);
const QUICK: [&str; 4] = ["--effort", "1", "--gaussians", "5"];

fn gif(frames: usize) -> Vec<u8> {
    let mut file = Vec::new();
    let frame = Frame::new(pictures::picture(SIZE, ColorType::Rgba8).to_rgba8());
    let mut encoder = GifEncoder::new(&mut file);
    encoder.encode_frames(vec![frame; frames]).expect("in memory");
    drop(encoder);
    file
}

#[test]
fn a_logical_screen_without_pixels_is_that_of_the_frame() {
    let room = Room::new();
    let file = gif(1);
    room.write("a.gif", &file);
    let mut zero = file;
    zero[6..10].fill(0);
    room.write("zero.gif", zero);
    assert_eq!(room.ok(&["compare", "a.gif", "zero.gif"]), "identical\n");
}

#[test]
fn icons_are_pngs_of_any_colours() {
    let room = Room::new();
    for color in [ColorType::Rgb8, ColorType::L8, ColorType::Rgba8] {
        room.save_picture("a.png", &pictures::picture(SIZE, color));
        let png = room.read("a.png");
        let mut icon = b"\0\0\x01\0\x01\0\x18\x10\0\0\0\0\x20\0".to_vec();
        icon.extend((png.len() as u32).to_le_bytes());
        icon.extend(22_u32.to_le_bytes());
        room.write("a.ico", [icon, png].concat());
        assert_eq!(room.ok(&["compare", "a.ico", "a.png"]), "identical\n", "{color:?}");
    }
}

/// `apart`: the picture of readers that know no animation is not one of its frames.
fn apng(frames: u32, apart: bool) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, SIZE.0, SIZE.1);
    encoder.set_animated(frames, 0).expect("not written yet");
    encoder.set_sep_def_img(apart).expect("animated");
    let mut writer = encoder.write_header().expect("in memory");
    let samples = pictures::picture(SIZE, ColorType::L8).into_bytes();
    for _ in 0..frames + u32::from(apart) {
        writer.write_image_data(&samples).expect("in memory");
    }
    writer.finish().expect("in memory");
    file
}

fn webp(frames: usize) -> Vec<u8> {
    let mut still = Cursor::new(Vec::new());
    let picture = pictures::picture(SIZE, ColorType::Rgb8);
    picture.write_to(&mut still, ImageFormat::WebP).expect("in memory");
    let chunk = |name: &[u8], contents: &[u8]| {
        let length = (contents.len() as u32).to_le_bytes();
        [name, &length, contents, &[0][..contents.len() % 2]].concat()
    };
    let sides = [SIZE.0 as u8 - 1, 0, 0, SIZE.1 as u8 - 1, 0, 0];
    // Position, size, duration and flags; then what is in the still picture.
    let frame = [&[0; 6], &sides[..], &[100, 0, 0, 0], &still.into_inner()[12..]].concat();
    let mut contents = b"WEBP".to_vec();
    contents.extend(chunk(b"VP8X", &[&[2, 0, 0, 0], &sides[..]].concat()));
    contents.extend(chunk(b"ANIM", &[0; 6]));
    contents.extend(vec![chunk(b"ANMF", &frame); frames].concat());
    chunk(b"RIFF", &contents)
}

/// Pages of these kinds, as `NewSubfileType` names them.
fn tiff(kinds: &[u32]) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut file).expect("in memory");
    let samples = pictures::picture(SIZE, ColorType::L8).into_bytes();
    for kind in kinds {
        let mut page = encoder.new_image::<colortype::Gray8>(SIZE.0, SIZE.1).expect("in memory");
        page.encoder().write_tag(Tag::NewSubfileType, *kind).expect("in memory");
        page.write_data(&samples).expect("in memory");
    }
    file.into_inner()
}

#[test]
fn the_first_of_several_pictures_is_taken_with_a_warning() {
    let files = [
        ("a.gif", gif(3), Some("only the first of 3 frames is taken")),
        ("b.gif", gif(1), None),
        ("c.png", apng(4, false), Some("only the first of 4 frames is taken")),
        (
            "d.png",
            apng(2, true),
            Some("the still picture is taken, and its animation of 2 frames is not"),
        ),
        ("e.webp", webp(2), Some("only the first of 2 frames is taken")),
        ("f.tif", tiff(&[0, 2, 2]), Some("only the first of 3 pages is taken")),
        // Smaller versions and masks are no other pictures.
        ("g.tif", tiff(&[0, 1, 4]), None),
    ];
    let room = Room::new();
    for (name, file, _) in &files {
        room.write(&format!("in/{name}"), file);
    }
    let expected = |warning: Option<&str>| json!(warning.into_iter().collect::<Vec<_>>());
    let printed = |name: &str, warning: Option<&str>| {
        warning.map_or(String::new(), |warning| format!("warning: in/{name}: {warning}\n"))
    };

    for (name, _, warning) in &files {
        let args = ["encode", &format!("in/{name}"), "a.gip", "--json"];
        let output = room.run(&[&args[..], &QUICK].concat());
        assert!(output.status.success(), "{name}: {}", text(&output.stderr));
        let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!(report["warnings"], expected(*warning), "{name}");
        assert_eq!(text(&output.stderr), printed(name, *warning));
    }

    let args = ["in", "--out", "out", "--manifest", "m.jsonl", "--jobs", "1"];
    let (_, errors) = room.batch(0, &[&args[..], &QUICK].concat());
    let all: String = files.iter().map(|(name, _, warning)| printed(name, *warning)).collect();
    assert_eq!(errors, all);
    let manifest = by_input(&room.read("m.jsonl"));
    for (name, _, warning) in &files {
        assert_eq!(manifest[&format!("in/{name}")]["warnings"], expected(*warning), "{name}");
    }

    let output = room.run(&["compare", "in/a.gif", "in/b.gif"]);
    assert_eq!(text(&output.stderr), printed("a.gif", files[0].2));
}
