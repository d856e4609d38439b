//! Damaged sources: what truncation and damage in the middle give, for each format, and what
//! `--allow-partial` makes of them.

use std::io::Cursor;

use ::tiff::encoder::{Compression, DeflateLevel, TiffEncoder, colortype};
use image::codecs::jpeg::JpegEncoder;
use image::{ColorType, DynamicImage, ImageEncoder, ImageFormat, RgbImage};
use serde_json::Value;

use super::common::layered;
use super::room::{Room, by_input, text};
use super::tiff;

const SIZE: (u32, u32) = (40, 32);
const QUICK: [&str; 4] = ["--effort", "1", "--gaussians", "1"];

/// Noise, so that files have something everywhere.
fn noise() -> RgbImage {
    let mut state = 7_u32;
    RgbImage::from_fn(SIZE.0, SIZE.1, |_, _| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let [_, r, g, b] = state.to_be_bytes();
        image::Rgb([r, g | 1, b])
    })
}

fn written(format: ImageFormat) -> Vec<u8> {
    let noise = DynamicImage::from(noise());
    let picture = match format {
        ImageFormat::Farbfeld => noise.to_rgba16().into(),
        ImageFormat::Gif | ImageFormat::Ico => noise.to_rgba8().into(),
        ImageFormat::OpenExr | ImageFormat::Hdr => noise.to_rgb32f().into(),
        _ => noise,
    };
    let mut file = Cursor::new(Vec::new());
    picture.write_to(&mut file, format).expect("the format takes it");
    file.into_inner()
}

/// DXT1: 8 bytes for 4 x 4 pixels.
fn dds() -> Vec<u8> {
    let mut header = vec![0_u32; 32];
    header[0] = u32::from_le_bytes(*b"DDS ");
    header[1..5].copy_from_slice(&[124, 0x1007, SIZE.1, SIZE.0]);
    header[19..22].copy_from_slice(&[32, 4, u32::from_le_bytes(*b"DXT1")]);
    header[27] = 0x1000;
    let blocks = noise().into_raw().into_iter().take((SIZE.0 * SIZE.1 / 2) as usize);
    header.into_iter().flat_map(u32::to_le_bytes).chain(blocks).collect()
}

fn jpeg(quality: u8) -> Vec<u8> {
    let mut file = Vec::new();
    JpegEncoder::new_with_quality(&mut file, quality).encode_image(&noise()).expect("in memory");
    file
}

fn cut(file: &[u8]) -> Vec<u8> {
    file[..file.len() * 6 / 10].to_vec()
}

fn overwritten(file: &[u8]) -> Vec<u8> {
    let mut file = file.to_vec();
    let middle = file.len() / 2;
    for (byte, at) in file[middle..middle + 24].iter_mut().zip(11_u8..) {
        *byte = at.wrapping_mul(37) % 251;
    }
    file
}

/// What is made of a damaged file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    /// It is refused, and so is it with `--allow-partial`.
    Nothing,
    /// It is refused, and taken with a warning with `--allow-partial`.
    Partial,
    /// It is taken: the format has nothing that tells.
    Unnoticed,
}

/// Whether a message is in words for people, not those of a library's code.
fn assert_plain(message: &str) {
    let words = [
        "{",
        "}",
        "(\"",
        "::",
        "`",
        "_",
        "ChunkType",
        "whole buffer",
        "Unexpected",
        "Error",
        "Some(",
        "rror error",
        "Invalid",
        "Format",
        "limits exceeded",
        "checksum",
    ];
    assert!(!words.iter().any(|word| message.contains(word)), "{message}");
}

fn outcome(room: &Room, name: &str, file: &[u8]) -> Outcome {
    use Outcome::{Nothing, Partial, Unnoticed};
    room.write(name, file);
    let args = [&["encode", name, "a.gip"], &QUICK[..]].concat();
    let strict = room.run(&args);
    let partial = room.run(&[&args[..], &["--allow-partial"]].concat());
    // Floats of any bits are valid, and those that have no place are another matter.
    let told = |printed: &[u8]| -> String {
        let is_damage =
            |line: &&str| !line.contains("clipped to 0 to 1") && !line.contains("(NaN)");
        text(printed).split_inclusive('\n').filter(is_damage).collect()
    };
    let (error, warning) = (told(&strict.stderr), told(&partial.stderr));
    assert_plain(&error);
    assert_plain(&warning);
    assert_eq!(error.lines().count().max(warning.lines().count()).max(1), 1, "{error}{warning}");
    match (strict.status.success(), partial.status.success()) {
        (true, true) => {
            assert_eq!((&*error, &*warning), ("", ""), "{name}");
            Unnoticed
        }
        (false, true) => {
            assert!(error.starts_with(&format!("error: {name}: ")), "{error}");
            assert!(warning.starts_with(&format!("warning: {name}: ")), "{warning}");
            Partial
        }
        (false, false) => {
            assert!(error.starts_with(&format!("error: {name}: ")), "{error}");
            let nothing = warning.strip_suffix("; nothing of it can be read\n");
            assert!(nothing.is_some() || name.ends_with(".gip"), "{warning}");
            Nothing
        }
        (true, false) => panic!("{name}: {warning}"),
    }
}

/// A file of each format, what becomes of it when it is cut at 60 %, and when its middle is overwritten.
fn table() -> [(&'static str, Vec<u8>, Outcome, Outcome); 21] {
    use Outcome::{Nothing, Partial, Unnoticed};
    let gip = {
        let source = image_gip::Source::new_u8(
            SIZE.0,
            SIZE.1,
            image_gip::ColorModel::Rgb,
            &noise().into_raw(),
        )
        .map(|source| {
            let encoder = image_gip::Encoder::new().with_effort(1);
            encoder.with_target(image_gip::Target::Gaussians(200)).encode(&source)
        });
        source.expect("the sizes agree").expect("no target").bytes
    };
    let plain = |magic: &str, samples: Vec<u8>| {
        [format!("{magic}\n{} {}\n255\n", SIZE.0, SIZE.1).into_bytes(), samples].concat()
    };
    let digits: Vec<String> = noise().iter().map(u8::to_string).collect();
    [
        ("a.png", written(ImageFormat::Png), Partial, Partial),
        ("a.jpg", jpeg(90), Partial, Partial),
        ("a.gif", written(ImageFormat::Gif), Partial, Partial),
        ("a.webp", written(ImageFormat::WebP), Partial, Nothing),
        ("a.qoi", written(ImageFormat::Qoi), Partial, Partial),
        ("a.ico", written(ImageFormat::Ico), Partial, Partial),
        ("a.exr", written(ImageFormat::OpenExr), Partial, Unnoticed),
        ("a.gip", gip, Partial, Partial),
        // The directory comes last.
        ("a.tif", written(ImageFormat::Tiff), Nothing, Unnoticed),
        // Without compression, any samples are valid.
        ("b.tif", tiff::rgb(SIZE, &noise().into_raw()), Partial, Unnoticed),
        ("lzw.tif", compressed(Compression::Lzw), Nothing, Partial),
        ("deflate.tif", compressed(Compression::Deflate(DeflateLevel::Fast)), Nothing, Partial),
        ("packbits.tif", compressed(Compression::Packbits), Nothing, Unnoticed),
        ("a.bmp", written(ImageFormat::Bmp), Partial, Unnoticed),
        ("a.tga", written(ImageFormat::Tga), Partial, Unnoticed),
        ("a.pnm", written(ImageFormat::Pnm), Partial, Unnoticed),
        ("a.ppm", plain("P6", noise().into_raw()), Partial, Unnoticed),
        ("text.ppm", plain("P3", digits.join(" ").into_bytes()), Partial, Partial),
        ("a.ff", written(ImageFormat::Farbfeld), Partial, Unnoticed),
        ("a.hdr", written(ImageFormat::Hdr), Partial, Partial),
        ("a.dds", dds(), Partial, Unnoticed),
    ]
}

fn compressed(compression: Compression) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let encoder = TiffEncoder::new(&mut file).expect("in memory");
    let mut encoder = encoder.with_compression(compression);
    let samples = noise().into_raw();
    encoder.write_image::<colortype::RGB8>(SIZE.0, SIZE.1, &samples).expect("in memory");
    file.into_inner()
}

#[test]
fn each_format_tells_damage_as_well_as_it_can() {
    let room = Room::new();
    let mut others = Vec::new();
    for (name, file, when_cut, when_overwritten) in table() {
        assert_eq!(outcome(&room, name, &file), Outcome::Unnoticed, "{name} is whole");
        let found = (outcome(&room, name, &cut(&file)), outcome(&room, name, &overwritten(&file)));
        if found != (when_cut, when_overwritten) {
            others.push((name, found));
        }
    }
    assert!(others.is_empty(), "{others:?}");
}

#[test]
fn a_file_that_ends_early_is_told_wherever_it_ends() {
    let room = Room::new();
    let table = table();
    for (name, file, ..) in &table {
        for tenths in 0..10 {
            let cut = &file[..file.len() * tenths / 10];
            let found = outcome(&room, name, cut);
            assert_ne!(found, Outcome::Unnoticed, "{tenths} tenths of {name}");
            room.write(&format!("in/{tenths}/{name}/{name}"), cut);
        }
    }
    // The size alone is read in another way.
    let args = ["in", "--out", "out", "--manifest", "m.jsonl"];
    let (_, errors) = room.batch(3, &[&args[..], &QUICK].concat());
    // A folder's .gip files are no sources.
    let failed = errors.lines().filter(|line| line.starts_with("error: in/"));
    assert_eq!(failed.count(), 10 * (table.len() - 1), "{errors}");
    assert_plain(&errors);
}

#[test]
fn jpegs_that_are_only_unusual_are_whole() {
    let room = Room::new();
    let file = jpeg(50);
    let end = file.len() - 2;
    let after_start = |bytes: &[u8]| [&file[..2], bytes, &file[2..]].concat();
    for (name, unusual) in [
        ("without its last marker", file[..end].to_vec()),
        ("bytes after the end", [&file[..], b"anything, \xFF\xD8\xFF\xE0 too"].concat()),
        ("a second picture", [&file[..], &file[..]].concat()),
        ("padding", [&file[..end], &[0xFF, 0, 0xFF, 0], &file[end..]].concat()),
        ("fill bytes before a marker", after_start(&[0xFF, 0xFF, 0xFF])),
        ("a comment", after_start(b"\xFF\xFE\0\x06text")),
    ] {
        assert_eq!(outcome(&room, "a.jpg", &unusual), Outcome::Unnoticed, "{name}");
    }
    // A marker that is put where a file was cut makes it no picture.
    let closed = [&cut(&file)[..], &[0xFF, 0xD9]].concat();
    assert_eq!(outcome(&room, "a.jpg", &closed), Outcome::Partial);
}

#[test]
fn zeros_in_place_of_data_are_damage() {
    let room = Room::new();
    for quality in [50, 90] {
        let file = jpeg(quality);
        let end = file.len() - 2;
        for from in [end / 2, end * 3 / 4, end - 200] {
            // What an interrupted copy leaves: with the last marker, without it, and with more zeros.
            let zeros = vec![0; end - from];
            for rest in [&file[end..], &[], &[0; 3000]] {
                let damaged = [&file[..from], &zeros, rest].concat();
                assert_eq!(outcome(&room, "a.jpg", &damaged), Outcome::Partial, "from {from}");
            }
        }
        // Some zeros are padding.
        let padded = [&file[..end], &[0; 16], &file[end..]].concat();
        assert_eq!(outcome(&room, "a.jpg", &padded), Outcome::Unnoticed);
    }
}

#[test]
fn dds_without_compression_is_refused_in_plain_words() {
    let room = Room::new();
    let mut file = dds();
    // The pixel format: flags of RGB, no code of a compression, 32 bits.
    for (at, number) in [(80, 0x40_u32), (84, 0), (88, 32)] {
        file[at..at + 4].copy_from_slice(&number.to_le_bytes());
    }
    room.write("a.dds", file);
    let error = room.fails(&["encode", "a.dds", "a.gip"]);
    assert_eq!(error, "error: a.dds: DDS is read with the compression DXT1, DXT3 or DXT5 alone\n");
}

#[test]
fn a_file_that_is_something_else_than_its_name_says_is_told() {
    let room = Room::new();
    for (name, format) in [("a.jpg", "JPEG"), ("a.png", "PNG"), ("a.tif", "TIFF")] {
        room.write(name, "<!DOCTYPE html><title>404 Not Found</title>");
        let expected = format!("it does not begin like {format}, in spite of its name");
        assert!(room.fails(&["encode", name, "a.gip"]).contains(&expected));
        assert!(room.batch(3, &[name, "--out", "out"]).1.contains(&expected));
    }
    for (name, expected) in [
        ("a.heic", "a.heic: HEIC is not read"),
        ("a.JXL", "a.JXL: JXL is not read"),
        ("a.avif", "a.avif: AVIF is not read"),
        ("a.txt", "a.txt: the format is none of those that are read"),
    ] {
        room.write(name, "what this begins with is no signature");
        assert!(room.fails(&["encode", name, "a.gip"]).contains(expected), "{name}");
    }
    // A picture of another format is one all the same.
    room.write("b.jpg", written(ImageFormat::Png));
    room.write("b.png", written(ImageFormat::Png));
    assert_eq!(room.ok(&["compare", "b.jpg", "b.png"]), "identical\n");
}

#[test]
fn a_webp_has_as_many_bytes_as_it_says() {
    let room = Room::new();
    let file = written(ImageFormat::WebP);
    // Too short and too long for its one chunk.
    let length = file.len() as u32 - 8;
    for length in [length - 100, length - 2, length + 2] {
        let file = [&file[..4], &length.to_le_bytes(), &file[8..]].concat();
        assert_eq!(outcome(&room, "a.webp", &file), Outcome::Partial, "{length}");
    }
    for bytes in [1, 2, 100] {
        assert_eq!(outcome(&room, "a.webp", &file[..file.len() - bytes]), Outcome::Partial);
    }
    assert_eq!(outcome(&room, "a.webp", &[&file[..], b"behind"].concat()), Outcome::Unnoticed);
}

#[test]
fn the_end_of_a_file_is_missed() {
    let room = Room::new();
    let (png, gif) = (written(ImageFormat::Png), written(ImageFormat::Gif));
    for (name, file, bytes) in [("a.png", &png, 4), ("a.png", &png, 12), ("a.gif", &gif, 1)] {
        let file = &file[..file.len() - bytes];
        assert_eq!(outcome(&room, name, file), Outcome::Partial, "{name} without {bytes} bytes");
    }
}

#[test]
fn frames_in_frames_do_not_take_the_stack() {
    let room = Room::new();
    let chunk = |name: &[u8], length: usize| [name, &(length as u32).to_le_bytes()].concat();
    let depth = 100_000;
    let mut file = [chunk(b"RIFF", 4 + 24 * depth), b"WEBP".to_vec()].concat();
    for depth in (0..depth).rev() {
        file.extend([chunk(b"ANMF", 16 + 24 * depth), vec![0; 16]].concat());
    }
    assert_eq!(outcome(&room, "a.webp", &file), Outcome::Nothing);
}

#[test]
fn a_webp_may_lose_its_metadata() {
    let room = Room::new();
    let mut file = Vec::new();
    let mut encoder = image::codecs::webp::WebPEncoder::new_lossless(&mut file);
    encoder.set_exif_metadata(b"II*\0\x08\0\0\0\0\0\0\0\0\0".to_vec()).expect("WebP has it");
    encoder.write_image(&noise(), SIZE.0, SIZE.1, ColorType::Rgb8.into()).expect("in memory");
    assert_eq!(outcome(&room, "a.webp", &file), Outcome::Unnoticed);
    for bytes in [4, 20, 30, 500] {
        let cut = &file[..file.len() - bytes];
        assert_eq!(outcome(&room, "a.webp", cut), Outcome::Partial, "without {bytes} bytes");
    }
    // They are promised and not there, though the lengths agree.
    let mut short = file[..file.len() - 22].to_vec();
    let length = short.len() as u32 - 8;
    short[4..8].copy_from_slice(&length.to_le_bytes());
    assert_eq!(outcome(&room, "a.webp", &short), Outcome::Partial);
}

#[test]
fn a_batch_records_what_was_damaged() {
    let room = Room::new();
    room.write("in/whole.jpg", jpeg(80));
    room.write("in/cut.jpg", cut(&jpeg(80)));
    let args = ["in", "--out", "out", "--manifest", "m.jsonl"];
    let (_, errors) = room.batch(3, &[&args[..], &QUICK].concat());
    assert_eq!(errors, "error: in/cut.jpg: the file is damaged: the data end too early\n");
    assert!(room.files("out").keys().eq(&["whole.gip"]));

    room.batch(0, &[&args[..], &QUICK, &["--allow-partial"]].concat());
    let manifest = by_input(&room.read("m.jsonl"));
    let warnings = |name: &str| manifest[name]["warnings"].as_array().map(Vec::len);
    assert_eq!((warnings("in/whole.jpg"), warnings("in/cut.jpg")), (Some(0), Some(1)));

    // The way back, too.
    room.write("gips/hurt.gip", layered::damaged(&[20]));
    let back = ["gips", "--decode", "--out", "back", "--manifest", "-"];
    room.batch(3, &back);
    let (line, _) = room.batch(0, &[&back[..], &["--allow-partial"]].concat());
    let line: Value = serde_json::from_str(line.trim()).expect("JSON");
    assert_eq!(line["warnings"].as_array().map(Vec::len), Some(1), "{line}");
}
