//! `gip batch` that runs to its end: names, order, formats, conflicts, bad pictures, the manifest.

use std::fs;

use image::{ColorType, ImageEncoder, ImageReader};
use image_gip::{Encoder, GipEncoder, Target};
use serde_json::Value;

use super::common::layered;
use super::pictures::{self, EXIF_ROTATE_90};
use super::room::{Room, by_input};

const SIZE: (u32, u32) = (48, 32);
/// Quick options of the encoder.
const QUICK: [&str; 4] = ["--effort", "1", "--gaussians", "20"];

/// A folder `in` with four pictures.
fn room_with_pictures() -> Room {
    let room = Room::new();
    for (name, color) in [
        ("in/a.png", ColorType::Rgb8),
        ("in/b.JPG", ColorType::L8),
        ("in/2024/c.tiff", ColorType::Rgb16),
        ("in/2024/may/d.e.png", ColorType::La8),
    ] {
        room.save_picture(name, &pictures::picture(SIZE, color));
    }
    room
}

#[test]
fn a_folder_keeps_its_structure_and_files_are_those_of_encode() {
    let room = room_with_pictures();
    room.write("in/notes.txt", "no picture");
    room.write("in/.hidden.png", "no picture");
    let args = ["in", "--out", "new/out", "--manifest", "m.jsonl", "--jobs", "2"];
    let (printed, errors) = room.batch(0, &[&args[..], &QUICK].concat());
    assert!(printed.starts_with("4 files: 4 written, 0 skipped, 0 failed, 0 left; "), "{printed}");
    assert_eq!(errors, "note: 1 other file left out (1 .txt)\n", "no bar without a terminal");

    let found = room.files("new/out");
    let names = ["2024/c.gip", "2024/may/d.e.gip", "a.gip", "b.gip"];
    assert!(found.keys().eq(&names), "{:?}", found.keys());
    let manifest = by_input(&room.read("m.jsonl"));
    let sources = ["in/2024/c.tiff", "in/2024/may/d.e.png", "in/a.png", "in/b.JPG"];
    assert!(manifest.keys().eq(&sources), "{manifest:?}");
    for (source, name) in sources.iter().zip(names) {
        let encode = [&["encode", source, "alone.gip", "--json"], &QUICK[..]].concat();
        let report = room.json(&encode);
        assert_eq!(found[name], room.read("alone.gip"), "{name}");
        let line = &manifest[*source];
        for field in ["width", "height", "bytes", "gaussians", "psnr", "quality", "shortfall"] {
            assert_eq!(line[field], report[field], "{source}: {field}");
        }
        assert_eq!(line["output"], format!("new/out/{name}"));
        assert_eq!(line["input_bytes"], room.read(source).len());
        assert_eq!((&line["status"], &line["error"]), (&"written".into(), &Value::Null));
        assert!(line["seconds"].is_number());
    }

    // Neither jobs nor budget change anything: here, every picture is larger than the budget.
    for limits in [["--jobs", "1"], ["--budget", "0.001"]] {
        room.batch(0, &[&["in", "--out", "again"], &limits[..], &QUICK].concat());
        assert_eq!(room.files("again"), found, "{limits:?}");
    }
}

#[test]
fn files_are_named_one_by_one_too() {
    let room = room_with_pictures();
    let args = ["in/2024/c.tiff", "in/2024/may", "in/b.JPG", "in/b.JPG", "--out", "out"];
    room.batch(0, &[&args[..], &QUICK].concat());
    assert!(room.files("out").keys().eq(&["b.gip", "c.gip", "d.e.gip"]));
}

#[test]
fn the_manifest_goes_to_standard_output_on_request() {
    let room = room_with_pictures();
    let args = ["in", "--out", "out", "--manifest", "-"];
    let (manifest, rest) = room.batch(0, &[&args[..], &QUICK].concat());
    assert_eq!(by_input(manifest.as_bytes()).len(), 4);
    assert!(rest.starts_with("4 files: 4 written"), "the rest is on standard error: {rest}");
}

#[test]
fn bad_pictures_are_reported_and_skipped() {
    let room = room_with_pictures();
    let png = room.read("in/a.png");
    room.write("in/empty.png", "");
    room.write("in/short.png", &png[..png.len() / 2]);
    room.write("in/text.jpg", "not a picture");
    room.write("out/short.gip", "precious");
    let args = ["in", "--out", "out", "--manifest", "m.jsonl"];
    let (printed, errors) = room.batch(3, &[&args[..], &QUICK].concat());
    assert!(printed.starts_with("7 files: 4 written, 0 skipped, 3 failed, 0 left"), "{printed}");
    assert_eq!(errors.lines().count(), 3, "{errors}");
    let manifest = by_input(&room.read("m.jsonl"));
    for name in ["in/empty.png", "in/short.png", "in/text.jpg"] {
        let line = &manifest[name];
        assert_eq!(line["status"], "failed");
        let error = line["error"].as_str().expect("a text");
        assert!(error.starts_with(name), "{error}");
        assert!(errors.contains(&format!("error: {error}\n")), "{errors}");
        for field in ["width", "bytes", "psnr", "seconds"] {
            assert!(line[field].is_null(), "{line}");
        }
    }
    assert_eq!(room.files("out").len(), 4 + 1);
    assert_eq!(room.read("out/short.gip"), b"precious");

    // A target that a picture cannot meet is no failure.
    let args = ["in/a.png", "--out", "out", "--bytes", "20", "--effort", "1", "--manifest", "-"];
    let (line, errors) = room.batch(0, &args);
    let line: Value = serde_json::from_str(line.trim()).expect("JSON");
    let reason = line["shortfall"].as_str().expect("it says why");
    assert!(reason.contains("are the least"), "{reason}");
    assert!(errors.starts_with("1 file: 1 written"), "{errors}");
}

#[test]
fn conflicts_end_the_run_before_it_begins() {
    let room = room_with_pictures();
    room.write("in/a.jpg", "its result has the same name");
    room.write("m.jsonl", "precious");
    let run = ["--out", "out", "--manifest", "m.jsonl"];
    let (_, errors) = room.batch(2, &[&["in"], &run[..]].concat());
    assert_eq!(errors, "error: in/a.jpg and in/a.png both become out/a.gip\n");
    fs::remove_file(room.path("in/a.jpg")).expect("it is there");
    for (args, words) in [
        (
            &["in", "in/2024/c.tiff", "in/2024", "--out", "in/2024", "--manifest", "in/a.png"][..],
            "in/a.png is an input",
        ),
        (&["-", "--out", "out"], "standard input"),
        (&["in"], "--out"),
        (&["in", "--out", "out", "--jobs", "0"], "--jobs"),
        (&["in", "--out", "out", "--thumbnail", "0"], "--thumbnail"),
    ] {
        let (_, errors) = room.batch(2, args);
        assert!(errors.starts_with("error: ") && errors.contains(words), "{errors}");
    }
    let (_, errors) = room.batch(1, &[&["in", "missing"], &run[..]].concat());
    assert!(errors.starts_with("error: missing: "), "{errors}");
    room.write("file", "");
    let (_, errors) = room.batch(1, &["in", "--out", "file"]);
    assert!(errors.starts_with("error: file: "), "{errors}");
    assert_eq!(room.names(), ["file", "in", "m.jsonl"], "nothing was made");
    assert_eq!(room.read("m.jsonl"), b"precious");
}

#[test]
fn a_folder_without_pictures_is_no_error() {
    let room = Room::new();
    room.write("in/notes.txt", "no picture");
    let (printed, _) = room.batch(0, &["in", "--out", "out"]);
    assert!(printed.starts_with("0 files: ") && printed.contains("\nnote: "), "{printed}");
}

#[test]
fn decoding_is_that_of_decode() {
    let room = room_with_pictures();
    room.batch(0, &[&["in", "--out", "gips"], &QUICK[..]].concat());
    let run = ["gips", "--decode", "--out"];
    room.batch(0, &[&run[..], &["png", "--manifest", "m.jsonl"]].concat());
    let pngs = room.files("png");
    let names = ["2024/c", "2024/may/d.e", "a", "b"];
    assert!(pngs.keys().eq(&names.map(|name| format!("{name}.png"))), "{:?}", pngs.keys());
    let manifest = by_input(&room.read("m.jsonl"));
    for name in names {
        room.ok(&["decode", &format!("gips/{name}.gip"), "alone.png"]);
        let png = &pngs[&format!("{name}.png")];
        assert_eq!(*png, room.read("alone.png"), "{name}");
        let line = &manifest[&format!("gips/{name}.gip")];
        assert_eq!((&line["width"], &line["height"]), (&48.into(), &32.into()));
        assert_eq!(line["bytes"], png.len());
        assert!(line["gaussians"].is_number() && line["psnr"].is_null(), "{line}");
    }

    // JPEG has no alpha, and d.e.gip has.
    let (_, errors) = room.batch(3, &[&run[..], &["jpg", "--format", "jpg"]].concat());
    assert!(errors.starts_with("error: gips/2024/may/d.e.gip: ") && errors.contains("alpha"));
    assert!(room.files("jpg").keys().eq(&["2024/c.jpg", "a.jpg", "b.jpg"]));
    // Files that are named are tried, whatever their names.
    let (_, errors) = room.batch(3, &["in/a.png", "--decode", "--out", "no"]);
    assert!(errors.starts_with("error: in/a.png: "), "{errors}");
}

#[test]
fn thumbnails_fit_and_show_all_of_the_picture() {
    let room = Room::new();
    // 300 x 200 pixels in 24 layers.
    room.write("gips/whole.gip", layered::damaged(&[]));
    room.write("hurt.gip", layered::damaged(&[20]));
    room.batch(0, &["gips", "--thumbnail", "30", "--out", "thumbs", "--manifest", "m.jsonl"]);
    room.ok(&["decode", "gips/whole.gip", "thumbs/small.png", "--size", "30x20"]);
    let thumbs = room.files("thumbs");
    assert_eq!(thumbs["whole.png"], thumbs["small.png"]);
    let line = &by_input(&room.read("m.jsonl"))["gips/whole.gip"];
    assert_eq!((&line["width"], &line["height"]), (&30.into(), &20.into()));
    assert_eq!(line["gaussians"], 24 * layered::IN_A_LAYER);
    let (_, errors) = room.batch(3, &["hurt.gip", "--thumbnail", "30", "--out", "thumbs"]);
    assert!(errors.starts_with("error: hurt.gip: "), "{errors}");

    let size = |name: &str| -> (u32, u32) {
        let reader = ImageReader::open(room.path(name)).expect("it was written");
        reader.into_dimensions().expect("a picture")
    };
    for (bounds, expected) in [
        ("30", (30, 20)),
        ("60x10", (15, 10)),
        ("1", (1, 1)),
        ("100x7", (11, 7)),
        ("5000", (300, 200)),
    ] {
        room.batch(0, &["gips/whole.gip", "--thumbnail", bounds, "--out", "sized"]);
        assert_eq!(size("sized/whole.png"), expected, "{bounds}");
    }

    // Stored lying, shown upright: 32 x 48.
    let mut turned = Vec::new();
    let encoder = Encoder::new().with_target(Target::Gaussians(20)).with_effort(1);
    let mut encoder = GipEncoder::with_encoder(&mut turned, encoder);
    encoder.set_exif_metadata(EXIF_ROTATE_90.into()).expect(".gip has Exif");
    pictures::picture(SIZE, ColorType::Rgb8).write_with_encoder(encoder).expect("in memory");
    room.write("turned.gip", turned);
    room.batch(0, &["turned.gip", "--thumbnail", "48x12", "--out", "sized"]);
    assert_eq!(size("sized/turned.png"), (8, 12));
}
