//! `gip transform`.

use image::{DynamicImage, ImageReader, Rgb, RgbImage, imageops};
use image_gip::{Metadata, Orientation, StreamDecoder};

use super::room::{Room, text};

const WIDTH: u32 = 96;
const HEIGHT: u32 = 64;

/// A room with the Gaussians of a picture, spots.jsonl, and two files of them: coded.gip and floats.gip.
fn room() -> Room {
    let room = Room::new();
    let mut spots = format!(
        "{{\"format\":\"gip-gaussians\",\"version\":1,\"width\":{WIDTH},\"height\":{HEIGHT},\
         \"base_color\":[32896,32896,32896]}}\n"
    );
    let mut rng = fastrand::Rng::with_seed(7);
    for _ in 0..80 {
        let center = [WIDTH as f32 * rng.f32(), HEIGHT as f32 * rng.f32()];
        let size = (0.5 + 2.5 * rng.f32()).exp2();
        let cholesky = [size * (0.5 + rng.f32()), size * (rng.f32() - 0.5), size];
        let color = [(); 3].map(|()| rng.f32() - 0.5);
        spots.push_str(&format!(
            "{{\"center\":{center:?},\"cholesky\":{cholesky:?},\"color\":{color:?}}}\n"
        ));
    }
    room.write("spots.jsonl", spots);
    room.ok(&["import", "spots.jsonl", "coded.gip", "--precision", "entropy"]);
    room.ok(&["import", "spots.jsonl", "floats.gip"]);
    room
}

/// The picture of a file, upright.
fn picture(room: &Room, file: &str) -> DynamicImage {
    room.ok(&["decode", file, "decoded.png"]);
    let reader = ImageReader::open(room.path("decoded.png")).expect("it was written");
    reader.decode().expect("a PNG")
}

/// The largest difference of two samples.
fn difference(a: &DynamicImage, b: &DynamicImage) -> u8 {
    assert_eq!((a.width(), a.height()), (b.width(), b.height()));
    let pairs = a.as_bytes().iter().zip(b.as_bytes());
    pairs.map(|(a, b)| a.abs_diff(*b)).max().expect("it has samples")
}

/// The lines of the Gaussians of a file, in any order.
fn gaussians(room: &Room, file: &str) -> Vec<String> {
    let mut lines: Vec<_> = room.ok(&["export", file, "-"]).lines().map(str::to_owned).collect();
    lines.sort();
    lines
}

/// Runs the command without a warning, and returns what it says after the number of bytes.
fn transform(room: &Room, args: &[&str]) -> String {
    let output = room.run(&[&["transform"], args].concat());
    assert!(output.status.success() && output.stderr.is_empty(), "{}", text(&output.stderr));
    let printed = text(&output.stdout);
    printed.split_once(" bytes, ").expect("it says how many").1.trim_end().to_owned()
}

#[test]
fn what_stays_on_the_grid_is_exact() {
    let room = room();
    let before = picture(&room, "coded.gip").to_rgb8();
    for (options, expected) in [
        (["--flip", "horizontal"], imageops::flip_horizontal(&before)),
        (["--flip", "vertical"], imageops::flip_vertical(&before)),
        (["--rotate", "180"], imageops::rotate180(&before)),
    ] {
        let said = transform(&room, &[&["coded.gip", "turned.gip"][..], &options].concat());
        assert_eq!(said, "all of 80 Gaussians exact", "{options:?}");
        assert!(difference(&picture(&room, "turned.gip"), &expected.into()) <= 1, "{options:?}");
        let sizes = ["coded.gip", "turned.gip"].map(|file| room.read(file).len());
        assert!(sizes[1] < sizes[0] + sizes[0] / 20, "{sizes:?}");
        transform(&room, &[&["turned.gip", "back.gip"][..], &options].concat());
        assert_eq!(gaussians(&room, "back.gip"), gaussians(&room, "coded.gip"), "{options:?}");
    }
}

/// The encoder's large Gaussians lie in cells that are smaller than their position intervals.
#[test]
fn an_encoded_file_stays_as_it_is() {
    let room = room();
    let picture = RgbImage::from_fn(160, 128, |x, y| {
        let (x, y) = (x as f32, y as f32);
        let waves = [x / 9.0 + y / 31.0, x * y / 600.0, (x - 70.0).hypot(y - 50.0) / 5.0];
        Rgb(waves.map(|wave| (127.5 + 120.0 * wave.sin()) as u8))
    });
    room.save_picture("in.png", &picture.into());
    room.ok(&["encode", "in.png", "coded.gip", "--gaussians", "300", "--effort", "1"]);
    for options in [&[][..], &["--flip", "horizontal"], &["--rotate", "180"]] {
        let said = transform(&room, &[&["coded.gip", "turned.gip"], options].concat());
        assert!(said.starts_with("all of ") && said.ends_with(" Gaussians exact"), "{said}");
        transform(&room, &[&["turned.gip", "back.gip"], options].concat());
        assert_eq!(gaussians(&room, "back.gip"), gaussians(&room, "coded.gip"), "{options:?}");
    }
}

#[test]
fn quarters_of_a_turn() {
    let room = room();
    for (file, exact) in [("floats.gip", true), ("coded.gip", false)] {
        let before = picture(&room, file).to_rgb8();
        for (degrees, expected) in
            [("90", imageops::rotate90(&before)), ("270", imageops::rotate270(&before))]
        {
            let said = transform(&room, &[file, "turned.gip", "--rotate", degrees]);
            let found = picture(&room, "turned.gip");
            assert_eq!((found.width(), found.height()), (HEIGHT, WIDTH));
            let most = difference(&found, &expected.into());
            if exact {
                assert_eq!(said, "all of 80 Gaussians exact");
                assert!(most <= 1, "{most}");
            } else {
                let psnr = said.split_once(" Gaussians rounded: ").expect("some are").1;
                let psnr: f64 = psnr.split(' ').next().expect("a number").parse().expect("one");
                assert!(psnr > 40.0, "{said}");
                assert!((2..40).contains(&most), "{most}");
            }
        }
    }
}

#[test]
fn rotations_and_reflections_follow_each_other() {
    let room = room();
    transform(&room, &["floats.gip", "a.gip", "--rotate", "90", "--flip", "vertical"]);
    transform(&room, &["floats.gip", "b.gip", "--rotate", "90"]);
    transform(&room, &["b.gip", "c.gip", "--flip", "vertical"]);
    assert!(difference(&picture(&room, "a.gip"), &picture(&room, "c.gip")) <= 1);
    transform(&room, &["b.gip", "d.gip", "--rotate", "270"]);
    assert!(difference(&picture(&room, "d.gip"), &picture(&room, "floats.gip")) <= 1);
}

#[test]
fn a_crop_is_that_part() {
    let room = room();
    let expected = picture(&room, "floats.gip").crop_imm(16, 8, 64, 40);
    let said = transform(&room, &["floats.gip", "part.gip", "--crop", "16,8,64,40"]);
    let count = said.strip_prefix("all of ").and_then(|rest| rest.strip_suffix(" Gaussians exact"));
    let count: usize = count.expect("they are exact").parse().expect("a number");
    assert!((20..80).contains(&count), "{said}");
    assert!(difference(&picture(&room, "part.gip"), &expected) <= 1);
    let expected = picture(&room, "coded.gip").crop_imm(16, 8, 64, 40);
    room.ok(&["transform", "coded.gip", "part.gip", "--crop", "16,8,64,40"]);
    assert!(difference(&picture(&room, "part.gip"), &expected) <= 1);
    let error = room.fails(&["transform", "coded.gip", "part.gip", "--crop", "90,0,10,10"]);
    assert!(error.contains("not inside"), "{error}");
}

#[test]
fn what_is_far_outside_of_the_grid_is_brought_in() {
    let room = room();
    room.write(
        "wide.jsonl",
        format!(
            "{{\"format\":\"gip-gaussians\",\"version\":1,\"width\":{WIDTH},\"height\":{HEIGHT},\
             \"base_color\":[0]}}\n\
             {{\"center\":[90,10],\"cholesky\":[60,0,40],\"color\":[0.5]}}\n"
        ),
    );
    room.ok(&["import", "wide.jsonl", "wide.gip", "--precision", "entropy"]);
    let said = transform(&room, &["wide.gip", "part.gip", "--crop", "0,0,16,16"]);
    assert!(said.starts_with("1 of 1 Gaussians rounded: "), "{said}");
    let [before, after] = ["wide.gip", "part.gip"].map(|file| room.read(file).len());
    assert!(after <= before + 8, "{before} and {after} bytes");
    let expected = picture(&room, "wide.gip").crop_imm(0, 0, 16, 16);
    let found = difference(&picture(&room, "part.gip"), &expected);
    assert!(found <= 3, "{found}");
}

#[test]
fn metadata_are_turned_along() {
    let room = room();
    let mut spots = StreamDecoder::new();
    spots.feed(&room.read("coded.gip")).expect("it is valid");
    let (header, steps) = (spots.header().expect("one"), spots.quantization_steps());
    let exif = b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0".to_vec();
    let mut metadata = Metadata::default();
    metadata.exif = Some(exif);
    assert_eq!(metadata.orientation(), Orientation::Rotate90);
    let writer = image_gip::Writer::new(header.clone()).with_metadata(metadata);
    let writer = writer.with_precision(image_gip::Precision::Entropy);
    let writer = writer.with_steps(steps.expect("it is entropy coded"));
    room.write("camera.gip", writer.write(spots.gaussians()).expect("they are valid"));
    let upright = picture(&room, "camera.gip");
    assert_eq!((upright.width(), upright.height()), (HEIGHT, WIDTH));

    // Together they do nothing, so that the grid is met.
    let said = transform(&room, &["camera.gip", "turned.gip", "--rotate", "270"]);
    assert_eq!(said, "all of 80 Gaussians exact");
    let info = room.json(&["info", "turned.gip", "--json"]);
    assert_eq!(info["orientation"], 1);
    assert_eq!((&info["width"], &info["height"]), (&WIDTH.into(), &HEIGHT.into()));
    assert_eq!(gaussians(&room, "turned.gip"), gaussians(&room, "coded.gip"));

    // A crop is one of what is shown.
    room.run(&["transform", "camera.gip", "part.gip", "--crop", "8,16,40,64"]);
    let expected = upright.crop_imm(8, 16, 40, 64);
    assert!(difference(&picture(&room, "part.gip"), &expected) < 40);
    let output = room.run(&["transform", "camera.gip", "none.gip", "--metadata", "none"]);
    assert!(output.status.success());
    assert!(room.json(&["info", "none.gip", "--json"])["metadata"]["exif"].is_null());
}

#[test]
fn texture_goes_along() {
    let room = Room::new();
    let mut rng = fastrand::Rng::with_seed(3);
    // In the left half alone.
    let grains = image::GrayImage::from_fn(256, 128, |x, _| {
        image::Luma([if x < 128 { rng.u8(90..160) } else { 125 }])
    });
    room.save_picture("a.png", &DynamicImage::from(grains));
    room.ok(&["encode", "a.png", "a.gip", "--effort", "1", "--gaussians", "20"]);
    // How much neighbours differ in a part of a picture.
    let roughness = |file: &str, left: u32, top: u32| {
        let part = picture(&room, file).crop_imm(left, top, 96, 96).to_luma8();
        let places = (0..95).flat_map(|y| (0..95).map(move |x| (x, y)));
        let at = |x, y| f64::from(part.get_pixel(x, y).0[0]);
        places.map(|(x, y)| (at(x + 1, y) - at(x, y)).abs()).sum::<f64>()
    };
    let before = roughness("a.gip", 8, 16);
    assert!(before > 10_000.0, "{before}");
    room.ok(&["transform", "a.gip", "turned.gip", "--rotate", "90"]);
    // What was on the left is at the top.
    let turned = roughness("turned.gip", 16, 8);
    assert!((turned / before - 1.0).abs() < 0.2, "{turned} {before}");
    let smooth = roughness("turned.gip", 16, 152);
    assert!(smooth < 0.2 * before, "{smooth} {before}");
}

#[test]
fn streaks_turn_with_the_picture() {
    let room = Room::new();
    let mut rng = fastrand::Rng::with_seed(4);
    let mut grains = image::GrayImage::from_fn(256, 192, |_, _| image::Luma([rng.u8(60..190)]));
    for row in grains.chunks_exact_mut(256) {
        // Every sample is the mean of those after it, with twice the contrast.
        let sums = row.windows(10).map(|after| after.iter().map(|&sample| i32::from(sample)).sum());
        let sums: Vec<i32> = sums.collect();
        for (sample, sum) in row.iter_mut().zip(sums) {
            *sample = (125 + 2 * (sum - 1250) / 10).clamp(0, 255) as u8;
        }
    }
    room.save_picture("a.png", &DynamicImage::from(grains));
    room.ok(&["encode", "a.png", "a.gip", "--effort", "1", "--gaussians", "20"]);
    // How much more the neighbours below differ than those to the right.
    let slope = |file: &str| {
        let picture = picture(&room, file).to_luma8();
        let places = (8..180).flat_map(|y| (8..180).map(move |x| (x, y)));
        let at = |x, y| f64::from(picture.get_pixel(x, y).0[0]);
        let both =
            places.map(|(x, y)| [(at(x, y + 1) - at(x, y)).abs(), (at(x + 1, y) - at(x, y)).abs()]);
        let [below, right] = both.fold([0.0, 0.0], |sums, both| [0, 1].map(|i| sums[i] + both[i]));
        f64::ln(below / right)
    };
    let before = slope("a.gip");
    assert!(before > 0.3, "{before}");
    for (option, expected) in [(["--rotate", "90"], -before), (["--flip", "vertical"], before)] {
        room.ok(&[&["transform", "a.gip", "turned.gip"][..], &option].concat());
        let found = slope("turned.gip");
        assert!((found - expected).abs() < 0.3 * before, "{option:?}: {found} {before}");
    }
}
