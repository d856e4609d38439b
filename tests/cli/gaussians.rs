//! `gip export` and `gip import`.

use std::collections::BTreeMap;

use image::{ColorType, ImageEncoder};
use serde_json::Value;

use super::pictures;
use super::room::{Room, text};

const WIDTH: u32 = 96;
const HEIGHT: u32 = 64;
const COLORS: [ColorType; 5] =
    [ColorType::L8, ColorType::La8, ColorType::Rgb8, ColorType::Rgba8, ColorType::Rgb16];
/// What `gip import` reads.
const FORMATS: [&str; 4] = ["npz", "json", "jsonl", "ply"];

/// A room with the file a.gip, of 90 Gaussians that are entropy coded.
fn room(color: ColorType) -> Room {
    let room = Room::new();
    let channels = usize::from(color.channel_count());
    let depth = 8 * color.bytes_per_pixel() / color.channel_count();
    let base = vec![32_896; channels];
    let mut text = format!(
        "{{\"format\":\"gip-gaussians\",\"version\":1,\"width\":{WIDTH},\"height\":{HEIGHT},\
         \"depth\":{depth},\"base_color\":{base:?}}}\n"
    );
    let mut rng = fastrand::Rng::with_seed(5);
    for _ in 0..90 {
        let center = [WIDTH as f32 * rng.f32(), HEIGHT as f32 * rng.f32()];
        let size = (0.5 + 2.5 * rng.f32()).exp2();
        let cholesky = [size * (0.5 + rng.f32()), size * (rng.f32() - 0.5), size];
        let color: Vec<f32> = (0..channels).map(|_| rng.f32() - 0.5).collect();
        let line =
            format!("{{\"center\":{center:?},\"cholesky\":{cholesky:?},\"color\":{color:?}}}\n");
        text.push_str(&line);
    }
    room.write("source.jsonl", text);
    room.ok(&["import", "source.jsonl", "a.gip", "--precision", "entropy"]);
    room.write("a.png", "no .gip");
    room
}

/// A room with a file that has texture.
fn textured() -> Room {
    let room = Room::new();
    let mut rng = fastrand::Rng::with_seed(3);
    let grains = image::GrayImage::from_fn(144, 128, |_, _| image::Luma([rng.u8(90..160)]));
    room.save_picture("a.png", &image::DynamicImage::from(grains));
    room.ok(&["encode", "a.png", "a.gip", "--effort", "1", "--gaussians", "20"]);
    room
}

/// The header and the sorted Gaussians of a file.
fn lines(room: &Room, file: &str) -> (String, Vec<String>) {
    let output = room.run(&["export", file, "-"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let all = text(&output.stdout);
    let mut lines = all.lines().map(str::to_owned);
    let head = lines.next().expect("a header");
    let mut gaussians: Vec<_> = lines.collect();
    gaussians.sort();
    (head, gaussians)
}

fn numbers(line: &str) -> Vec<f64> {
    let spot: Value = serde_json::from_str(line).expect("JSON");
    let list = |name: &str| spot[name].as_array().expect("an array").clone();
    let all = ["center", "cholesky", "color"].map(list).concat();
    all.iter().map(|number| number.as_f64().expect("a number")).collect()
}

fn psnr(room: &Room, a: &str, b: &str) -> f64 {
    room.json(&["compare", a, b, "--json"])["psnr"].as_f64().expect("a number")
}

#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    let room = Room::new();
    // More than a pipe holds.
    let spot = "{\"center\":[3,4],\"cholesky\":[2,0,1],\"color\":[0.5]}\n".repeat(5000);
    room.write("a.jsonl", spot);
    room.ok(&["import", "a.jsonl", "a.gip", "--size", "96x64"]);
    let mut gip = room.spawn(&["export", "a.gip", "-"]);
    drop(gip.stdout.take());
    let output = gip.wait_with_output().expect("the tool ends");
    let told = text(&output.stderr);
    assert!(output.status.success() && !told.contains("error"), "{told}");
}

#[test]
fn what_is_exported_comes_back() {
    for color in COLORS {
        let room = room(color);
        let (head, gaussians) = lines(&room, "a.gip");
        assert_eq!(gaussians.len(), 90);
        let mut files = BTreeMap::new();
        for format in FORMATS {
            let (exported, imported) = (format!("a.{format}"), format!("{format}.gip"));
            let printed = room.ok(&["export", "a.gip", &exported]);
            let bytes = room.read(&exported).len();
            assert_eq!(printed, format!("{exported}: 90 Gaussians, {bytes} bytes\n"));
            let printed = room.ok(&["import", &exported, &imported]);
            let file = room.read(&imported);
            assert_eq!(printed, format!("{imported}: 90 Gaussians, {} bytes\n", file.len()));
            let (head_again, again) = lines(&room, &imported);
            assert_eq!(head_again, head);
            if format == "ply" {
                // By the logarithms of scales and the angle.
                let read = room.ok(&["export", "npz.gip", "-"]);
                let exact: Vec<_> = read.lines().skip(1).map(numbers).collect();
                let read = room.ok(&["export", "ply.gip", "-"]);
                let near: Vec<_> = read.lines().skip(1).map(numbers).collect();
                let is_near = |a: &Vec<f64>, b: &Vec<f64>| {
                    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-4 * a.abs().max(1.0))
                };
                assert!(exact.iter().all(|a| near.iter().any(|b| is_near(a, b))));
                assert!(psnr(&room, "a.gip", "ply.gip") > 70.0);
            } else {
                assert_eq!(again, gaussians, "{format}");
                files.insert(format, file);
                assert!(psnr(&room, "a.gip", &imported) > 80.0);
            }
        }
        assert!(files.values().all(|file| *file == files["npz"]), "{color:?}");
        // From a pipe to a pipe.
        let output = room.pipe(&["import", "-", "-"], &room.read("a.jsonl"));
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert_eq!(output.stdout, files["npz"]);
        let output = room.pipe(&["import", "-", "-", "--format", "ply"], &room.read("a.ply"));
        assert_eq!(output.stdout, room.read("ply.gip"));
    }
}

#[test]
fn precisions_and_their_options() {
    let room = room(ColorType::Rgb8);
    room.ok(&["export", "a.gip", "a.npz"]);
    let import = |options: &[&str]| {
        room.ok(&[&["import", "a.npz", "b.gip"], options].concat());
        let info = room.json(&["info", "b.gip", "--json"]);
        (room.read("b.gip").len(), psnr(&room, "a.gip", "b.gip"), info)
    };
    let (floats, _, _) = import(&[]);
    let mut last = (floats, f64::INFINITY);
    for bits in ["16,16,14", "12,10,6", "9,7,4"] {
        let (bytes, psnr, info) = import(&["--precision", "packed", "--bits", bits]);
        assert_eq!(info["components"][0]["bits"].to_string(), bits.split(',').next().expect("one"));
        assert!(bytes < last.0 && psnr < last.1, "{bits}: {bytes}, {psnr}");
        last = (bytes, psnr);
    }
    assert_eq!(
        import(&["--precision", "packed"]).0,
        import(&["--precision", "packed", "--bits", "12,10,6"]).0
    );
    last = (floats, f64::INFINITY);
    for step in ["0.003", "0.05", "0.15"] {
        let (bytes, psnr, info) = import(&["--precision", "entropy", "--color-step", step]);
        assert_eq!(info["coding"], "entropy");
        assert!(bytes < last.0 && psnr < last.1, "{step}: {bytes}, {psnr}");
        last = (bytes, psnr);
    }
    for shape in ["cholesky", "covariance", "rotation-scale"] {
        let (_, psnr, info) = import(&["--parameterization", shape]);
        assert_eq!(info["parameterization"], shape);
        assert!(psnr > 70.0);
    }
    for (options, expected) in [
        (&["--bits", "12,10,6"][..], "--bits needs --precision packed"),
        (&["--precision", "packed", "--color-step", "1"], "--color-step needs --precision entropy"),
        (&["--precision", "packed", "--bits", "12,17,6"], "from 1 to 16"),
        (&["--color-step", "0"], "not a number from"),
        (&["--depth", "12"], "neither 8 nor 16"),
        (&["--base-color", "1,300,1"], "300; it must be 0 to 255"),
    ] {
        let output = room.run(&[&["import", "a.npz", "c.gip"], options].concat());
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{error}");
        assert!(error.contains(expected), "{error}");
    }
    let kernel = ["--kernel", "exponential", "--precision", "entropy"];
    let error = room.fails(&[&["import", "a.npz", "c.gip"], &kernel[..]].concat());
    assert!(error.contains("quartic"), "{error}");
    assert!(!room.path("c.gip").exists());
}

#[test]
fn the_header_can_be_given() {
    let room = Room::new();
    let spots = "{\"center\":[10,8.5],\"covariance\":[9,1,4],\"color\":[0.5,0,-0.25]}\n\n\
                 {\"center\":[3,4],\"cholesky\":[2,0,2],\"color\":[0,1e-3,0]}\n";
    room.write("a.jsonl", spots);
    let error = room.fails(&["import", "a.jsonl", "a.gip"]);
    assert!(
        error.contains("a.jsonl: it does not say the size of the picture: give --size"),
        "{error}"
    );
    let import = |options: &[&str]| {
        room.ok(&[&["import", "a.jsonl", "a.gip", "--size", "32x20"], options].concat());
        room.json(&["info", "a.gip", "--json"])
    };
    let info = import(&[]);
    assert_eq!((&info["width"], &info["height"]), (&32.into(), &20.into()));
    assert_eq!((&info["kernel"], &info["depth"]), (&"quartic".into(), &8.into()));
    assert_eq!(info["base_color"], serde_json::json!([0, 0, 0]));
    let info = import(&["--base-color", "255", "--kernel", "exponential"]);
    assert_eq!(info["base_color"], serde_json::json!([65535, 65535, 65535]));
    assert!((info["cutoff"].as_f64().expect("a number") - 11.0825).abs() < 1e-3);
    let more =
        ["--depth", "16", "--base-color", "1,2,3", "--kernel", "exponential", "--cutoff", "9"];
    let info = import(&more);
    assert_eq!((&info["depth"], &info["cutoff"]), (&16.into(), &9.0.into()));
    assert_eq!(info["base_color"], serde_json::json!([1, 2, 3]));
    // In place of what the input says.
    room.ok(&["export", "a.gip", "b.json"]);
    room.ok(&["import", "b.json", "b.gip", "--size", "40x20", "--kernel", "quartic"]);
    let info = room.json(&["info", "b.gip", "--json"]);
    assert_eq!((&info["width"], &info["cutoff"]), (&40.into(), &4.0.into()));
    assert_eq!(info["base_color"], serde_json::json!([1, 2, 3]));
    let error = room.fails(&["import", "b.json", "c.gip", "--limit", "gaussians=1"]);
    assert!(error.contains("--limit gaussians=N"), "{error}");
    let error = room.fails(&["import", "b.json", "c.gip", "--limit", "width=30"]);
    assert!(error.contains("--limit width=N"), "{error}");
}

#[test]
fn texture_is_exported_where_it_can_be_and_what_is_lost_is_told() {
    let room = textured();
    let texture = &room.json(&["info", "a.gip", "--json"])["texture"]["gaussians"];
    let (head, all) = lines(&room, "a.gip");
    let head: Value = serde_json::from_str(&head).expect("JSON");
    assert_eq!(&head["texture"]["gaussians"], texture);
    let of_texture = all.iter().filter(|line| line.starts_with("{\"texture\":")).count();
    assert_eq!(texture, of_texture);
    for format in FORMATS {
        let exported = format!("a.{format}");
        let output = room.run(&["export", "a.gip", &exported]);
        assert!(output.status.success());
        let (printed, told) = (text(&output.stdout), text(&output.stderr));
        let is_dropped = format == "ply";
        assert_eq!(told.contains("a.gip: its texture has no place in Ply"), is_dropped, "{told}");
        assert_eq!(
            printed.contains(&format!("and {texture} of the texture")),
            !is_dropped,
            "{printed}"
        );
        let output = room.run(&["import", &exported, "b.gip"]);
        assert!(output.status.success());
        let told = text(&output.stderr);
        assert_eq!(
            told.contains(&format!("{exported}: its texture is left out")),
            !is_dropped,
            "{told}"
        );
        assert!(room.json(&["info", "b.gip", "--json"])["texture"].is_null());
    }
    let output = room.run(&["export", "a.gip", "a.svg"]);
    assert!(text(&output.stderr).contains("its texture has no place in Svg"));

    room.write("far.jsonl", r#"{"center":[900,900],"cholesky":[1,0,1],"color":[1]}"#);
    let size = ["--size", "9x9", "--precision", "entropy"];
    let output = room.run(&[&["import", "far.jsonl", "b.gip"], &size[..]].concat());
    assert!(text(&output.stderr).contains("far.jsonl: 1 Gaussians that do not show"));
}

#[test]
fn metadata_are_told() {
    let room = Room::new();
    let file = std::fs::File::create(room.path("a.png")).expect("writable");
    let mut encoder = image::codecs::png::PngEncoder::new(file);
    encoder.set_exif_metadata(pictures::EXIF_ROTATE_90.to_vec()).expect("PNG has Exif");
    pictures::picture((WIDTH, HEIGHT), ColorType::L8)
        .write_with_encoder(encoder)
        .expect("writable");
    room.ok(&["encode", "a.png", "a.gip", "--gaussians", "5", "--effort", "1"]);
    let output = room.run(&["export", "a.gip", "a.json"]);
    let told = text(&output.stderr);
    assert!(told.contains("a.gip: not exported: ") && told.contains("Exif"), "{told}");
}

/// What a file of 3D Gaussians has beside what the tool writes.
const SPLATS: &str = "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 2\nproperty float x\n\
    property double y\nproperty float z\nproperty float f_dc_0\nproperty float f_dc_1\nproperty float f_dc_2\n\
    property float f_rest_0\nproperty float opacity\nproperty float scale_0\nproperty float scale_1\n\
    property float scale_2\nproperty float rot_0\nproperty float rot_1\nproperty float rot_2\nproperty float rot_3\n\
    element face 0\nproperty list uchar int vertex_indices\nend_header\n\
    4 5 -7 1.7724538 0 -1.7724538 9 0 0.69314718 1.0986123 5 2 0 0 0\n\
    9 9 1 0 0 0 9 0 0.69314718 1.0986123 1.0986123 0.70710678 0 0.70710678 0\n";

#[test]
fn splats_are_looked_at_along_z() {
    let room = Room::new();
    room.write("a.ply", SPLATS);
    let output = room.run(&["import", "a.ply", "a.gip", "--size", "20x20"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("(f_rest) are left out"));
    let info = room.json(&["info", "a.gip", "--json"]);
    assert_eq!((&info["kernel"], &info["color"]), (&"exponential".into(), &"rgb".into()));
    let read = room.ok(&["export", "a.gip", "-"]);
    let found: Vec<_> = read.lines().skip(1).map(numbers).collect();
    // Half as opaque as full, with f_dc times 0.2821 and 0.5 more; the second is turned around y, which shows z as x.
    for expected in
        [[4.0, 5.0, 2.0, 0.0, 3.0, 0.5, 0.25, 0.0], [9.0, 9.0, 3.0, 0.0, 3.0, 0.25, 0.25, 0.25]]
    {
        let is_near =
            |found: &Vec<f64>| found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5);
        assert!(found.iter().any(is_near), "{found:?}");
    }

    // Over a base colour, amplitudes are what is left to the shown colour; that which a file says comes first.
    room.ok(&["import", "a.ply", "base.gip", "--size", "20x20", "--base-color", "51"]);
    let read = room.ok(&["export", "base.gip", "-"]);
    let is_near = |found: Vec<f64>| {
        let expected = [4.0, 5.0, 2.0, 0.0, 3.0, 0.4, 0.15, -0.1];
        found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5)
    };
    assert!(read.lines().skip(1).map(numbers).any(is_near), "{read}");
    room.ok(&["export", "base.gip", "base.ply"]);
    room.ok(&["import", "base.ply", "again.gip", "--base-color", "0"]);
    let again = room.ok(&["export", "again.gip", "-"]);
    assert!(again.lines().skip(1).map(numbers).any(is_near), "{again}");
    assert!(again.contains("\"base_color\":[0,0,0]"), "{again}");

    // The numbers of the tool's own binary, from the highest byte on.
    room.ok(&["export", "a.gip", "b.ply"]);
    room.ok(&["import", "b.ply", "b.gip"]);
    let mut bytes = room.read("b.ply");
    let start = bytes.len() - 2 * 17 * 4;
    let mut swapped: Vec<u8> = bytes.split_off(start);
    swapped.as_chunks_mut::<4>().0.iter_mut().for_each(|number| number.reverse());
    let head = text(&bytes).replace("binary_little_endian", "binary_big_endian");
    room.write("c.ply", [head.as_bytes(), &swapped].concat());
    room.ok(&["import", "c.ply", "c.gip"]);
    assert_eq!(room.read("c.gip"), room.read("b.gip"));
}

#[test]
fn what_is_wrong_is_told_with_its_place() {
    let room = room(ColorType::Rgb8);
    room.write("b.gip", "it was here before");
    let refused = |name: &str, contents: &[u8], expected: &str| {
        room.write(name, contents);
        let error = room.fails(&["import", name, "b.gip"]);
        assert!(error.contains(name) && error.contains(expected), "{expected}: {error}");
        assert_eq!(room.read("b.gip"), b"it was here before");
    };
    for format in FORMATS {
        room.ok(&["export", "a.gip", &format!("a.{format}")]);
        refused(&format!("empty.{format}"), b"", "");
        refused(&format!("bytes.{format}"), &[0x80; 99], "");
    }
    let all = text(&room.read("a.jsonl"));
    let with = |line: usize, text: &str| {
        let mut lines: Vec<&str> = all.lines().collect();
        lines[line - 1] = text;
        lines.join("\n")
    };
    for (line, wrong, expected) in [
        (1, r#"{"format":"other","version":1}"#, "line 1: format \"other\""),
        (1, r#"{"format":"gip-gaussians","version":2}"#, "line 1: version 2"),
        (1, r#"{"format":"gip-gaussians"}"#, "line 1, column 26: missing field `version`"),
        (3, r#"{"format":"gip-gaussians","version":1}"#, "line 3: a header after the first line"),
        (3, "", "the first line says 90 Gaussians, and there are 89"),
        (3, "{", "line 3, column 1: EOF"),
        (
            3,
            r#"{"center":[1],"cholesky":[1,0,1],"color":[1,1,1]}"#,
            "line 3, column 13: invalid length 1",
        ),
        (3, r#"{"center":[1,1],"cholesky":[1,0,1]}"#, "line 3, column 35: missing field `color`"),
        (
            3,
            r#"{"center":[1,1],"cholesky":[1,0,1],"color":[1]}"#,
            "line 3: Gaussian 1: its color has 1 numbers",
        ),
        (3, r#"{"center":[1,1],"color":[1,1,1]}"#, "line 3: Gaussian 1: there is neither"),
        (
            3,
            r#"{"center":[1,1],"covariance":[1,1,1],"color":[1,1,1]}"#,
            "line 3: Gaussian 1: the covariance is not positive definite",
        ),
        (
            3,
            r#"{"center":[1,1],"covariance":[1,0,2],"cholesky":[1,0,1],"color":[1,1,1]}"#,
            "do not agree",
        ),
        (
            4,
            r#"{"center":[1e39,1],"cholesky":[1,0,1],"color":[1,1,1]}"#,
            "line 4: Gaussian 2: its centre",
        ),
        (
            4,
            r#"{"center":[1,1],"cholesky":[1,0,0],"color":[1,1,1]}"#,
            "line 4: Gaussian 2: l11 and l22",
        ),
        (4, r#"{"center":[1,1],"cholesky":[1,0,1],"color":[1e999,1,1]}"#, "line 4, column"),
    ] {
        refused("c.jsonl", with(line, wrong).as_bytes(), expected);
    }
    let object = text(&room.read("a.json"));
    refused("c.json", object.replacen("quartic", "cubic", 1).as_bytes(), "kernel \"cubic\"");
    refused(
        "c.json",
        object.replacen("\"cutoff\":4.0", "\"cutoff\":5.0", 1).as_bytes(),
        "cutoff 5",
    );
    refused("c.json", object.replacen("\"depth\":8", "\"depth\":9", 1).as_bytes(), "depth 9");
    refused("c.json", object.replacen("\"width\":96", "\"width\":0", 1).as_bytes(), "width");
    refused("c.json", object.replacen("center", "centre", 1).as_bytes(), "line 3 column");
    refused("c.json", b"[]", "line 1 column");

    let ply = SPLATS.replacen("comment by hand", "comment gip width 9\ncomment gip height 9", 1);
    for (old, new, expected) in [
        ("format ascii 1.0", "format text 1.0", "line 2 of its header"),
        ("format ascii 1.0\n", "", "no format"),
        ("comment gip width 9", "comment gip width w", "line 3 of its header"),
        ("property float opacity", "property opacity", "of its header"),
        ("property float scale_1", "property float scale", "no property scale_1"),
        ("element vertex 2", "element vertex 3", "it ends before vertex 2"),
        ("element vertex 2", "element vertex -2", "line 5 of its header"),
        ("9 9 1 0", "9 9 1", "line 25: 14 numbers; there must be 15"),
        ("9 9 1 0", "9 9 x 0", "line 25: \"x\" is not a number"),
        ("9 9 1 0", "NaN 9 1 0", "Gaussian 1: its centre"),
        ("5 2 0 0 0", "5 0 0 0 0", "vertex 0: its rotation"),
        ("0.69314718", "1e9", "vertex 0: its scales"),
        ("end_header", "", "no end_header"),
    ] {
        refused("c.ply", ply.replacen(old, new, 1).as_bytes(), expected);
    }
    let listed = ply.replacen("property float opacity", "property list uchar int a", 1);
    refused("c.ply", listed.as_bytes(), "vertices with lists are not read");
    let cameras = ply.replacen("element vertex", "element camera 1\nelement vertex", 1);
    refused("c.ply", cameras.as_bytes(), "its first element is camera");
    let binary = room.read("a.ply");
    refused("c.ply", &binary[..binary.len() - 1], "it ends at rot_3 of vertex 89");

    let archive = room.read("a.npz");
    refused("c.npz", &archive[..archive.len() - 30], "not a ZIP archive");
    let changed = |old: &[u8], new: &[u8], last: bool| {
        let mut places = archive.windows(old.len()).enumerate().filter(|(_, part)| *part == old);
        let place = if last { places.next_back() } else { places.next() };
        let (place, _) = place.expect("it is there");
        let mut archive = archive.clone();
        archive[place..place + new.len()].copy_from_slice(new);
        archive
    };
    refused("c.npz", &changed(b"(90, 3,)", b"(91, 3,)", false), "it is damaged");
    refused("c.npz", &changed(b"center.npy", b"Center.npy", true), "it has no array center");
    let error = room.fails(&["import", "a.npz", "b.gip", "--limit", "memory=1k"]);
    assert!(error.contains("more than 1024 bytes"), "{error}");
    for args in [["export", "a.png", "b.npz"], ["export", "none.gip", "b.npz"]] {
        room.fails(&args);
    }
    assert!(!room.path("b.npz").exists());
    for (args, expected) in [
        (["export", "a.gip", "b.txt"], "the extension must name the format"),
        (["import", "a.svg", "b.gip"], "SVG is not imported"),
    ] {
        room.write("a.svg", "<svg/>");
        let output = room.run(&args);
        assert_eq!(output.status.code(), Some(2));
        assert!(text(&output.stderr).contains(expected), "{}", text(&output.stderr));
    }
    let error = room.fails(&["import", "a.npz", "b.png"]);
    assert!(error.contains("b.png: gip import writes .gip files only"), "{error}");
    room.ok(&["import", "a.npz", "b.png", "--force"]);
}

#[test]
fn what_editors_and_other_programs_add_is_skipped() {
    let room = room(ColorType::Rgb8);
    let mark = b"\xEF\xBB\xBF".as_slice();
    for format in ["json", "jsonl"] {
        room.ok(&["export", "a.gip", &format!("a.{format}")]);
        let contents = text(&room.read(&format!("a.{format}"))).replace('\n', "\r\n");
        room.write(&format!("b.{format}"), [mark, contents.as_bytes()].concat());
        room.ok(&["import", &format!("b.{format}"), "b.gip"]);
        assert_eq!(lines(&room, "b.gip"), lines(&room, "a.gip"));
    }
    room.write("a.ply", SPLATS);
    room.ok(&["import", "a.ply", "a.gip", "--size", "20x20"]);
    let spaced = SPLATS.replacen("\n9 9", "\n\n9 9", 1);
    let (before, after) = spaced.split_once("comment by hand").expect("a comment");
    // In Latin-1, as old programs write.
    let comment = b"comment \xE9 end_header of others".as_slice();
    room.write("b.ply", [mark, before.as_bytes(), comment, after.as_bytes()].concat());
    room.ok(&["import", "b.ply", "b.gip", "--size", "20x20"]);
    assert_eq!(room.read("b.gip"), room.read("a.gip"));
}

#[test]
fn other_files_in_an_archive_are_skipped() {
    let room = room(ColorType::Rgb8);
    room.ok(&["export", "a.gip", "a.npz"]);
    room.ok(&["import", "a.npz", "b.gip"]);
    let archive = room.read("a.npz");
    // Another name, and contents that are no array: the covariance is not needed, as there is the Cholesky factor.
    let place = |part: &[u8]| {
        let all = archive.windows(part.len()).enumerate().filter(|(_, found)| *found == part);
        all.map(|(place, _)| place).collect::<Vec<_>>()
    };
    let mut other = archive.clone();
    for at in place(b"covariance.npy") {
        other[at..][..14].copy_from_slice(b"read_me_______");
    }
    other[place(b"\x93NUMPY")[1]] = b' ';
    room.write("c.npz", other);
    room.ok(&["import", "c.npz", "c.gip"]);
    assert_eq!(room.read("c.gip"), room.read("b.gip"));
}

#[test]
fn svg_of_strong_colours_is_bounded() {
    let room = Room::new();
    let spot = r#"{"center":[8,8],"cholesky":[2,0,2],"color":[-60000]}"#;
    let head = r#"{"format":"gip-gaussians","version":1,"width":16,"height":16}"#;
    room.write("a.jsonl", format!("{head}\n{spot}\n"));
    room.ok(&["import", "a.jsonl", "a.gip"]);
    let error = room.fails(&["export", "a.gip", "a.svg", "--limit", "memory=4M"]);
    assert!(error.contains("limit exceeded: bytes of memory"), "{error}");
    room.ok(&["export", "a.gip", "a.svg"]);
}

#[test]
fn damaged_files_end_with_an_error_or_a_file() {
    let room = room(ColorType::Rgba8);
    let mut rng = fastrand::Rng::with_seed(9);
    for format in FORMATS {
        let name = format!("a.{format}");
        room.ok(&["export", "a.gip", &name]);
        let whole = room.read(&name);
        for _ in 0..40 {
            let mut damaged = whole.clone();
            // Most of it are numbers; beginnings and ends are where the structure is.
            let bounds = [0..damaged.len(), 0..300, damaged.len() - 300..damaged.len()];
            for _ in 0..rng.usize(1..4) {
                let part = rng.choice(&bounds).expect("three").clone();
                damaged[rng.usize(part)] = rng.u8(..);
            }
            damaged.truncate(rng.usize(damaged.len() / 2..2 * damaged.len()));
            room.write("b", &damaged);
            let output = room.run(&["import", "b", "b.gip", "--format", format]);
            let error = text(&output.stderr);
            assert!(matches!(output.status.code(), Some(0 | 1)), "{error}");
        }
    }
}

/// The sums that an SVG of the tool stands for, without the rounding of a renderer.
fn evaluate(svg: &str) -> Vec<[f64; 3]> {
    let document = roxmltree::Document::parse(svg).expect("XML");
    let number = |node: roxmltree::Node<'_, '_>, name: &str| -> f64 {
        node.attribute(name).expect("it is there").parse().expect("a number")
    };
    let gradients: BTreeMap<String, Vec<(f64, f64)>> = document
        .descendants()
        .filter(|node| node.has_tag_name("radialGradient"))
        .map(|node| {
            let stops = node.children().filter(|child| child.has_tag_name("stop"));
            let stops = stops.map(|stop| (number(stop, "offset"), number(stop, "stop-opacity")));
            (node.attribute("id").expect("a name").to_owned(), stops.collect())
        })
        .collect();
    let group = document.descendants().find(|node| node.attribute("class") == Some("g"));
    let group = group.expect("a group");
    let mut sums = vec![[0.0; 3]; (WIDTH * HEIGHT) as usize];
    for node in group.children().filter(|node| node.is_element()) {
        let class = node.attribute("class").unwrap_or_default();
        match (node.tag_name().name(), class) {
            ("rect", "") => {}
            ("rect", "p") => {
                let fill = node.attribute("fill").expect("a colour");
                let opacity = number(node, "fill-opacity");
                for sum in sums.as_flattened_mut().chunks_exact_mut(3) {
                    for (channel, sum) in sum.iter_mut().enumerate() {
                        *sum += if &fill[channel + 1..channel + 2] == "f" { opacity } else { 0.0 };
                    }
                }
            }
            ("rect", "i") => {
                sums.as_flattened_mut().iter_mut().for_each(|sum| *sum = 1.0 - sum.min(1.0));
            }
            ("circle", class) => {
                let matrix = node.attribute("transform").expect("a matrix");
                let matrix = matrix.trim_start_matches("matrix(").trim_end_matches(')');
                let m: Vec<f64> =
                    matrix.split(' ').map(|part| part.parse().expect("a number")).collect();
                let (radius, opacity) = (number(node, "r"), number(node, "fill-opacity"));
                let stops = &gradients[class];
                for (index, sum) in sums.iter_mut().enumerate() {
                    let x = f64::from(index as u32 % WIDTH) + 0.5 - m[4];
                    let y = f64::from(index as u32 / WIDTH) + 0.5 - m[5];
                    let u = x / m[0];
                    let v = (y - m[1] * u) / m[3];
                    let offset = u.hypot(v) / radius;
                    let Some(next) = stops.iter().position(|stop| stop.0 >= offset) else {
                        continue;
                    };
                    let ((a, from), (b, to)) = (stops[next.saturating_sub(1)], stops[next]);
                    let weight =
                        if a == b { to } else { from + (to - from) * (offset - a) / (b - a) };
                    match class {
                        "c3" => sum.iter_mut().for_each(|sum| *sum += opacity * weight),
                        class => {
                            sum[class[1..].parse::<usize>().expect("a channel")] +=
                                opacity * weight;
                        }
                    }
                }
            }
            other => panic!("{other:?}"),
        }
    }
    let slope = document.descendants().find(|node| node.has_tag_name("feFuncR"));
    let slope = slope.map_or(1.0, |node| number(node, "slope"));
    sums.as_flattened_mut().iter_mut().for_each(|sum| *sum = (*sum * slope).clamp(0.0, 1.0));
    sums
}

#[test]
fn svg_adds_up_to_the_picture() {
    for (color, kernel) in [
        (ColorType::L8, "quartic"),
        (ColorType::Rgb8, "quartic"),
        (ColorType::Rgb8, "exponential"),
        (ColorType::Rgba8, "quartic"),
    ] {
        let room = room(color);
        room.ok(&["export", "a.gip", "a.json"]);
        room.ok(&["import", "a.json", "b.gip", "--kernel", kernel]);
        room.ok(&["export", "b.gip", "b.svg"]);
        let svg = text(&room.read("b.svg"));
        if color == ColorType::Rgba8 {
            let document = roxmltree::Document::parse(&svg).expect("XML");
            let masks = document.descendants().filter(|node| node.has_tag_name("mask"));
            assert_eq!(masks.count(), 1);
            continue;
        }
        room.ok(&["decode", "b.gip", "b.png"]);
        let expected = image::open(room.path("b.png")).expect("a picture").into_rgb8();
        let found = evaluate(&svg);
        let squares = found.as_flattened().iter().zip(expected.as_raw());
        let error: f64 = squares.map(|(a, b)| (a * 255.0 - f64::from(*b)).powi(2)).sum();
        let psnr = 10.0 * (255.0 * 255.0 * expected.as_raw().len() as f64 / error).log10();
        // Rounding to 8 bits alone gives 58.9 dB.
        assert!(psnr > 55.0, "{color:?}, {kernel}: {psnr} dB");
    }
}
