//! Files of several pictures: the first is taken, and the tool says so.

use std::io::Cursor;

use image::codecs::gif::GifEncoder;
use image::codecs::ico::{IcoEncoder, IcoFrame};
use image::codecs::jpeg::JpegEncoder;
use image::{ColorType, Frame, ImageEncoder, ImageFormat};
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

/// JPEGs after each other, with an index of these kinds of pictures in the first (CIPA DC-007).
fn mpo(kinds: &[u32]) -> Vec<u8> {
    let mut picture = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut picture, 90);
    encoder.write_image(&[99; 24 * 16], SIZE.0, SIZE.1, ColorType::L8.into()).expect("in memory");
    // Offsets are from the index on.
    let (prefix, index) = (b"\xFF\xD8\xFF\xE2", b"MM\0*\0\0\0\x08\0\x01\xB0\x02\0\x07");
    let entries = 16 * kinds.len();
    let segment = 2 + 4 + index.len() + 12 + entries;
    let (before, first) = (2 + 2 + 2 + 4, picture.len() + 2 + segment);
    let mut file = [&prefix[..], &(segment as u16).to_be_bytes(), b"MPF\0", index].concat();
    for number in [entries, index.len() + 12, 0] {
        file.extend((number as u32).to_be_bytes());
    }
    for (number, kind) in kinds.iter().enumerate() {
        let offset = if number == 0 { 0 } else { first + (number - 1) * picture.len() - before };
        for value in [*kind, picture.len() as u32, offset as u32, 0] {
            file.extend(value.to_be_bytes());
        }
    }
    file.extend(&picture[2..]);
    file.extend(vec![picture; kinds.len() - 1].concat());
    file
}

/// An icon of squares with these sides.
fn ico(sides: &[u32]) -> Vec<u8> {
    let pictures: Vec<_> =
        sides.iter().map(|&side| pictures::picture((side, side), ColorType::Rgba8)).collect();
    let frames = pictures.iter().map(|picture| {
        IcoFrame::as_png(
            picture.as_bytes(),
            picture.width(),
            picture.height(),
            ColorType::Rgba8.into(),
        )
    });
    let frames: Vec<_> = frames.collect::<Result<_, _>>().expect("in memory");
    let mut file = Vec::new();
    IcoEncoder::new(&mut file).encode_images(&frames).expect("in memory");
    file
}

fn netpbm() -> Vec<u8> {
    let size = format!("{} {}", SIZE.0, SIZE.1);
    let samples = |bytes: u32| vec![7; (SIZE.0 * SIZE.1 * bytes) as usize];
    let pam = format!(
        "P7\nWIDTH {}\nHEIGHT {}\nDEPTH 4\nMAXVAL 255\nTUPLTYPE RGB_ALPHA\nENDHDR\n",
        SIZE.0, SIZE.1
    );
    [
        format!("P6 {size} 255\n").as_bytes(),
        &samples(3),
        format!("P5 {size} 65535\n").as_bytes(),
        &samples(2),
        format!("P4 {size}\n").as_bytes(),
        &[7; 3 * 16],
        pam.as_bytes(),
        &samples(4),
        format!("P5 {size} 255\n").as_bytes(),
        &samples(1),
    ]
    .concat()
}

/// OpenEXR with layers of these channels, a letter each.
fn exr(layers: &[&str]) -> Vec<u8> {
    use ::exr::prelude::*;
    let size = (SIZE.0 as usize, SIZE.1 as usize);
    let layers = layers.iter().enumerate().map(|(number, names)| {
        let channel = |name: char| {
            let samples = FlatSamples::F32(vec![0.5; size.0 * size.1]);
            AnyChannel::new(&*name.to_string(), samples)
        };
        let attributes = LayerAttributes::named(&*number.to_string());
        let channels = AnyChannels::sort(names.chars().map(channel).collect());
        Layer::new(size, attributes, Encoding::UNCOMPRESSED, channels)
    });
    let attributes = ImageAttributes::new(IntegerBounds::from_dimensions(size));
    let picture = Image::from_layers(attributes, layers.collect::<Layers<_>>());
    let mut file = Cursor::new(Vec::new());
    picture.write().to_buffered(&mut file).expect("in memory");
    file.into_inner()
}

#[test]
fn an_icon_is_its_largest_picture() {
    let room = Room::new();
    room.write("a.ico", ico(&[16, 48, 32]));
    room.save_picture("a.png", &pictures::picture((48, 48), ColorType::Rgba8));
    let output = room.run(&["compare", "a.ico", "a.png"]);
    assert_eq!(text(&output.stdout), "identical\n");
}

#[test]
fn what_is_cut_behind_the_picture_that_is_taken_is_told() {
    let room = Room::new();
    let cut = "the file is damaged: the data end too early";
    for (name, file, bytes) in [
        ("a.gif", gif(3), 1),
        ("b.gif", gif(3), 200),
        ("c.tif", tiff(&[0, 2]), 100),
        ("d.ico", ico(&[48, 32]), 1),
        ("e.pnm", netpbm(), 1),
        ("f.png", apng(2, false), 20),
    ] {
        room.write(name, &file[..file.len() - bytes]);
        let args = [&["encode", name, "a.gip"], &QUICK[..]].concat();
        assert_eq!(room.fails(&args), format!("error: {name}: {cut}\n"));
        room.ok(&[&args[..], &["--allow-partial"]].concat());
    }
    // An index is often kept where the other pictures are not.
    let file = mpo(&[0x03_0000, 0]);
    let second = file.windows(2).rposition(|pair| pair == b"\xFF\xD8").expect("there are two");
    room.write("g.jpg", &file[..second]);
    let output = room.run(&[&["encode", "g.jpg", "a.gip"], &QUICK[..]].concat());
    assert!(output.status.success() && output.stderr.is_empty(), "{output:?}");
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
        ("h.jpg", mpo(&[0x03_0000, 0, 0x02_0002]), Some("only the first of 3 pictures is taken")),
        ("i.jpg", mpo(&[0x03_0000, 0x01_0001]), None),
        (
            "j.ico",
            ico(&[16, 48, 32]),
            Some("of its 3 pictures, only the one of most bits and pixels is taken"),
        ),
        ("k.ico", ico(&[16]), None),
        ("l.pnm", netpbm(), Some("only the first of 5 pictures is taken")),
        (
            "m.exr",
            exr(&["Z", "ABGR", "RGB"]),
            Some("only the first of its 3 layers that is RGB is taken"),
        ),
        (
            "n.exr",
            exr(&["BGRXYZ"]),
            Some("what it has beside colours and alpha (3 of its 6 channels) is left out"),
        ),
        ("o.exr", exr(&["ABGR"]), None),
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
