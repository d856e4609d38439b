//! The command line, from outside: files, streams, JSON, exit status.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use image::metadata::Orientation;
use image::{ColorType, DynamicImage, ImageDecoder, ImageEncoder, ImageReader};
use image_gip::{Region, RenderOptions};
use serde_json::Value;

use super::common::texture::Texture;
use super::common::{chunk, layered};
use super::pictures::{self, EXIF_ROTATE_90};
use super::room::{Room, text};

const WIDTH: u32 = 48;
const HEIGHT: u32 = 36;

impl Room {
    /// Saves a test picture as `name`.
    fn save(&self, name: &str, color: ColorType) -> DynamicImage {
        let picture = picture(color);
        self.save_picture(name, &picture);
        picture
    }

    /// Makes a small .gip file from a test picture.
    fn gip(&self, name: &str, color: ColorType) {
        let source = format!("{name}.source.png");
        self.save(&source, color);
        self.encode(&source, name);
    }

    fn encode(&self, input: &str, output: &str) {
        self.ok(&["encode", input, output, "--gaussians", "20", "--effort", "1"]);
    }
}

fn open(path: &Path) -> DynamicImage {
    let reader = ImageReader::open(path).expect("the file exists");
    reader.with_guessed_format().expect("readable").decode().expect("a sound picture")
}

/// The shared picture at the size of these tests.
fn picture(color: ColorType) -> DynamicImage {
    pictures::picture((WIDTH, HEIGHT), color)
}

#[test]
fn encode_info_decode_compare() {
    let room = Room::new();
    room.save("a.png", ColorType::Rgb8);
    let report =
        room.json(&["encode", "a.png", "a.gip", "--gaussians", "30", "--effort", "1", "--json"]);
    let bytes = fs::metadata(room.path("a.gip")).expect("written").len();
    assert_eq!((&report["width"], &report["height"]), (&48.into(), &36.into()));
    assert_eq!(report["bytes"], bytes);
    let bpp = report["bpp"].as_f64().expect("a number");
    assert!((bpp - bytes as f64 * 8.0 / (48.0 * 36.0)).abs() < 1e-9);
    let gaussians = report["gaussians"].as_u64().expect("a number");
    assert!((1..=30).contains(&gaussians), "{report}");
    for field in ["psnr", "psnr_float", "iterations", "evaluations", "seconds", "peak_memory"] {
        assert!(report[field].is_number(), "{field}: {report}");
    }
    assert!(report["shortfall"].is_null(), "{report}");

    let info = room.json(&["info", "a.gip", "--json"]);
    for field in ["width", "height", "gaussians", "bytes", "bpp"] {
        assert_eq!(info[field], report[field], "{field}");
    }
    assert_eq!((&info["color"], &info["depth"]), (&"rgb".into(), &8.into()));
    for field in
        ["version", "layers", "kernel", "cutoff", "parameterization", "base_color", "metadata"]
    {
        assert!(!info[field].is_null(), "{field}: {info}");
    }
    let chunks = info["chunks"].as_array().expect("an array");
    let kinds: Vec<_> = chunks.iter().filter_map(|c| c["kind"].as_str()).collect();
    assert_eq!((kinds.first(), kinds.last()), (Some(&"H"), Some(&"E")), "letters alone");
    let sum: u64 = chunks.iter().map(|c| c["bytes"].as_u64().expect("a number")).sum();
    assert_eq!(sum + 8, bytes, "the chunks and the signature are the whole file");
    assert_eq!(info["coding"], "entropy");
    for step in ["position", "size", "ratio", "slant"] {
        assert!(info["quantization_steps"][step].is_number(), "{step}: {info}");
    }
    assert_eq!(info["quantization_steps"]["color"].as_array().expect("an array").len(), 3);
    let bits = |info: &Value, names: &[&str]| -> f64 {
        let bits = &info["bits_per_gaussian"];
        names.iter().map(|&name| bits[name].as_f64().expect("a number")).sum()
    };
    let attributes = ["position", "precision", "shape", "color"];
    let total = bits(&info, &["total"]);
    assert!((bits(&info, &attributes) - total).abs() < 1e-9);
    // All but the framing, which has a length of two bytes, and the rounding of the last word.
    let framing = (bits(&info, &["coded"]) - total) * report["gaussians"].as_f64().expect("some");
    assert!((56.0..56.0 + 64.0).contains(&framing), "{framing}");

    let packed = ["--gaussians", "30", "--effort", "1", "--precision", "packed"];
    room.ok(&[&["encode", "a.png", "p.gip"], &packed[..]].concat());
    let info = room.json(&["info", "p.gip", "--json"]);
    assert_eq!(info["coding"], "packed");
    let components = info["components"].as_array().expect("an array");
    assert_eq!(components.len(), 8);
    let sum: u64 = components.iter().map(|c| c["bits"].as_u64().expect("a number")).sum();
    assert_eq!(bits(&info, &["total"]), sum as f64);
    assert_eq!(bits(&info, &attributes), sum as f64);

    room.ok(&["decode", "a.gip", "b.png"]);
    let decoded = open(&room.path("b.png"));
    assert_eq!((decoded.width(), decoded.height()), (WIDTH, HEIGHT));
    assert_eq!(decoded.color(), ColorType::Rgb8);

    // A .gip file compares as what it decodes to.
    let with_gip = room.json(&["compare", "a.png", "a.gip", "--json"]);
    assert_eq!(with_gip, room.json(&["compare", "a.png", "b.png", "--json"]));
    assert_eq!(with_gip["psnr"], report["psnr"], "what was reported is what the file shows");
    for field in ["psnr", "ms_ssim", "max_abs_error"] {
        assert!(with_gip[field].is_number(), "{field}: {with_gip}");
    }
}

#[test]
fn prints_for_humans() {
    let room = Room::new();
    room.save("a.png", ColorType::L16);
    let line = room.ok(&["encode", "a.png", "a.gip", "--gaussians", "5", "--effort", "1"]);
    assert!(line.starts_with("a.gip: 48x36, ") && line.contains(" dB, "), "{line}");
    let info = room.ok(&["info", "a.gip"]);
    assert!(info.contains("48x36, gray, 16 bits per sample"), "{info}");
    assert!(info.contains(" in 1 layer\n"), "{info}");
    assert!(info.contains("chunk E (end)"), "{info}");
    assert_eq!(room.ok(&["compare", "a.gip", "a.gip"]), "identical\n");
    assert!(room.ok(&["compare", "a.png", "a.gip"]).starts_with("PSNR "));
}

#[test]
fn many_files_are_told_each_with_its_name() {
    let room = Room::new();
    room.gip("a.gip", ColorType::Rgb8);
    room.gip("b.gip", ColorType::L8);
    let alone = ["a.gip", "b.gip"].map(|name| room.ok(&["info", name]));
    let told = room.ok(&["info", "a.gip", "b.gip"]);
    assert_eq!(told, format!("a.gip:\n{}\nb.gip:\n{}", alone[0], alone[1]));

    let lines = room.ok(&["info", "--json", "b.gip", "a.gip"]);
    let lines: Vec<&str> = lines.lines().collect();
    for (line, name) in lines.iter().zip(["b.gip", "a.gip"]) {
        let told: Value = serde_json::from_str(line).expect("JSON");
        assert_eq!(told, room.json(&["info", name, "--json"]));
        assert_eq!(told["file"], name);
    }
    assert_eq!(lines.len(), 2);

    // What cannot be read does not keep the rest from being told.
    room.write("text.gip", "no picture");
    let output = room.run(&["info", "missing.gip", "a.gip", "text.gip"]);
    assert_eq!(output.status.code(), Some(3));
    assert_eq!(text(&output.stdout), format!("a.gip:\n{}", alone[0]));
    let errors = text(&output.stderr);
    let errors: Vec<&str> = errors.lines().collect();
    assert!(errors[0].starts_with("error: missing.gip: "), "{errors:?}");
    assert!(errors[1].starts_with("error: text.gip: ") && errors.len() == 2, "{errors:?}");

    let a = fs::read(room.path("a.gip")).expect("just written");
    let output = room.pipe(&["info", "-", "b.gip"], &a);
    assert!(text(&output.stdout).starts_with("standard input:\nsize "), "{output:?}");
}

#[test]
fn the_texture_of_a_file_is_told() {
    let room = Room::new();
    let mut rng = fastrand::Rng::with_seed(3);
    let grains = image::GrayImage::from_fn(144, 128, |_, _| image::Luma([rng.u8(90..160)]));
    DynamicImage::from(grains).save(room.path("a.png")).expect("writable");
    let encode = ["encode", "a.png", "a.gip", "--effort", "1", "--gaussians", "20"];
    let report = room.json(&[&encode[..], &["--json"]].concat());
    let info = room.json(&["info", "a.gip", "--json"]);
    assert!(report["texture_gaussians"].as_u64() > Some(0), "{report}");
    for field in ["gaussians", "bytes"] {
        assert_eq!(info["texture"][field], report[format!("texture_{field}")], "{info}");
    }
    assert!(room.ok(&["info", "a.gip"]).contains("\ntexture  "));
    assert!(room.ok(&encode).contains(" without its texture of "));
    // Figures are those without texture, and what is encoded again has none.
    let difference = room.json(&["compare", "a.png", "a.gip", "--json"]);
    let [encoded, compared] = [&report, &difference].map(|json| json["psnr"].as_f64());
    assert!((encoded.expect("a PSNR") - compared.expect("a PSNR")).abs() < 0.01, "{difference}");
    let again = room.json(&["encode", "a.gip", "b.gip", "--effort", "1", "--json"]);
    assert_eq!(again["texture_bytes"], 0, "{again}");
    assert!(again["warnings"].to_string().contains("its texture is left out"), "{again}");
    let report = room.json(&[&encode[..], &["--texture", "0", "--json"]].concat());
    assert_eq!(report["texture_bytes"], 0);
    assert!(room.json(&["info", "a.gip", "--json"])["texture"].is_null());
}

#[test]
fn a_texture_that_is_skipped_is_none() {
    let room = Room::new();
    let sides = [WIDTH, HEIGHT];
    let good = chunk(b"tXTR", &Texture::constant(sides, [0.1, 0.0, 0.1]).payload(sides));
    let broken = chunk(b"tXTR", &[]);
    room.gip("plain.gip", ColorType::Rgb8);
    let plain = room.read("plain.gip");
    let (before, end) = plain.split_at(plain.len() - chunk(b"E", &[]).len());
    let told = |textures: &[&[u8]]| {
        room.write("a.gip", [before, &textures.concat(), end].concat());
        let info = room.json(&["info", "a.gip", "--json"]);
        let shown = room.ok(&["info", "a.gip"]);
        let row = shown.lines().find(|line| line.starts_with("texture "));
        (info["texture"].clone(), row.map(str::to_owned), info["warnings"].clone())
    };
    let (texture, row, _) = told(&[&good]);
    assert_eq!(texture["bytes"], good.len());
    assert!(row.expect("a row").ends_with(" bits per Gaussian"));
    let (texture, row, warnings) = told(&[&broken]);
    assert_eq!((texture, row), (Value::Null, None));
    assert_eq!(warnings.as_array().map(Vec::len), Some(1));
    // Their bytes are counted together.
    let (texture, row, _) = told(&[&broken, &good]);
    assert_eq!((&texture["bytes"], &texture["bits_per_gaussian"]), (&Value::Null, &Value::Null));
    assert_eq!(row.as_deref(), Some("texture             1 Gaussians"));
    // The decoder lists the first 16.
    for (count, lines) in [(15, 15), (16, 17), (40, 17)] {
        let (_, _, warnings) = told(&vec![&broken[..]; count]);
        let warnings = warnings.as_array().expect("an array");
        assert_eq!(warnings.len(), lines);
        let last = warnings.last().expect("at least 15").to_string();
        assert_eq!(last.contains("only the first 16 "), lines > 16, "{last}");
    }
}

#[test]
fn a_target_that_is_not_met_is_told_with_its_reason() {
    let room = Room::new();
    DynamicImage::from(image::GrayImage::from_pixel(20, 20, image::Luma([77])))
        .save(room.path("flat.png"))
        .expect("writable");
    let args = ["encode", "flat.png", "a.gip", "--effort", "1", "--bytes", "5000"];
    let report = room.json(&[&args[..], &["--json"]].concat());
    let reason = report["shortfall"].as_str().expect("it says why");
    assert!(reason.contains(&format!("0 Gaussians, {} bytes", report["bytes"])), "{reason}");
    // An exact copy, which JSON has no number for.
    assert_eq!(report["psnr"], 999.0);
    let line = room.ok(&args);
    assert!(line.contains(", inf dB, ") && line.ends_with(&format!("note: {reason}\n")), "{line}");
}

#[test]
fn a_size_below_the_least_file_is_a_target_that_is_not_met() {
    let room = Room::new();
    room.save("icon.png", ColorType::Rgba8);
    let args = ["encode", "icon.png", "a.gip", "--effort", "1", "--bpp", "0.01", "--json"];
    let report = room.json(&args);
    let reason = report["shortfall"].as_str().expect("it says why");
    assert!(reason.contains(&format!("{} bytes are the least", report["bytes"])), "{reason}");
    assert_eq!(report["gaussians"], 0);
}

#[test]
fn standard_streams() {
    let room = Room::new();
    room.save("a.png", ColorType::Rgb8);
    let source = fs::read(room.path("a.png")).expect("just written");
    let args = ["encode", "-", "-", "--gaussians", "20", "--effort", "1", "--json"];
    let encoded = room.pipe(&args, &source);
    assert!(encoded.status.success());
    let report: Value = serde_json::from_slice(&encoded.stderr).expect("the report is on stderr");
    assert_eq!(report["bytes"], encoded.stdout.len());
    room.encode("a.png", "a.gip");
    assert_eq!(encoded.stdout, fs::read(room.path("a.gip")).expect("just written"));

    let decoded = room.pipe(&["decode", "-", "-"], &encoded.stdout);
    assert!(decoded.status.success() && decoded.stderr.is_empty());
    room.ok(&["decode", "a.gip", "b.png"]);
    assert_eq!(decoded.stdout, fs::read(room.path("b.png")).expect("just written"));

    let info = room.pipe(&["info", "-"], &encoded.stdout);
    assert_eq!(text(&info.stdout), room.ok(&["info", "a.gip"]));
    let compared = room.pipe(&["compare", "-", "b.png"], &encoded.stdout);
    assert_eq!(text(&compared.stdout), "identical\n");
    let wrong = room.run(&["compare", "-", "-"]);
    assert_eq!(wrong.status.code(), Some(2));
    assert!(text(&wrong.stderr).contains("only one"));
}

#[test]
fn color_model_and_depth_are_kept() {
    let room = Room::new();
    for (color, model, depth) in [
        (ColorType::L8, "gray", 8),
        (ColorType::La8, "gray-alpha", 8),
        (ColorType::Rgba8, "rgba", 8),
        (ColorType::L16, "gray", 16),
        (ColorType::La16, "gray-alpha", 16),
        (ColorType::Rgb16, "rgb", 16),
        (ColorType::Rgba16, "rgba", 16),
    ] {
        room.gip("a.gip", color);
        let info = room.json(&["info", "a.gip", "--json"]);
        assert_eq!((&info["color"], &info["depth"]), (&model.into(), &depth.into()));
        room.ok(&["decode", "a.gip", "b.png"]);
        assert_eq!(open(&room.path("b.png")).color(), color);
    }
}

#[test]
fn alpha_is_stored_only_where_there_is_any() {
    let room = Room::new();
    for (opaque, model) in [
        (DynamicImage::from(picture(ColorType::Rgb8).to_rgba8()), "rgb"),
        (DynamicImage::from(picture(ColorType::L16).to_luma_alpha16()), "gray"),
    ] {
        opaque.save(room.path("a.png")).expect("writable");
        let report = room.json(&[
            "encode",
            "a.png",
            "a.gip",
            "--gaussians",
            "20",
            "--effort",
            "1",
            "--json",
        ]);
        let comparison = room.json(&["compare", "a.png", "a.gip", "--json"]);
        assert_eq!(comparison["psnr"], report["psnr"], "alpha that is not stored does not count");
        assert_eq!(room.json(&["info", "a.gip", "--json"])["color"], model);
    }
}

#[test]
fn floats_are_stored_as_srgb() {
    let room = Room::new();
    let linear = image::Rgb32FImage::from_pixel(20, 20, image::Rgb([0.5, 7.0, f32::NAN]));
    DynamicImage::from(linear).save(room.path("a.exr")).expect("writable");
    // sRGB of one half, of more than full, and of what is no number.
    let stored = image::ImageBuffer::from_pixel(20, 20, image::Rgb([48192_u16, 65535, 0]));
    DynamicImage::from(stored).save(room.path("b.png")).expect("writable");
    let comparison = room.json(&["compare", "a.exr", "b.png", "--json"]);
    assert_eq!(comparison["max_abs_error"], 0, "{comparison}");
    room.encode("a.exr", "a.gip");
    assert_eq!(room.json(&["info", "a.gip", "--json"])["depth"], 16);
}

#[test]
fn every_output_format_can_be_read_back() {
    let room = Room::new();
    room.gip("gray.gip", ColorType::L16);
    room.gip("color.gip", ColorType::Rgb16);
    room.gip("alpha.gip", ColorType::Rgba16);
    for (name, extension, color) in [
        ("gray", "png", ColorType::L16),
        ("gray", "tif", ColorType::L16),
        ("gray", "pgm", ColorType::L16),
        ("gray", "pnm", ColorType::L16),
        ("gray", "pam", ColorType::L16),
        ("gray", "jpg", ColorType::L8),
        ("gray", "qoi", ColorType::Rgb8),
        ("color", "png", ColorType::Rgb16),
        ("color", "TIFF", ColorType::Rgb16),
        ("color", "ppm", ColorType::Rgb16),
        ("color", "pnm", ColorType::Rgb16),
        ("color", "JPEG", ColorType::Rgb8),
        ("color", "bmp", ColorType::Rgb8),
        ("color", "webp", ColorType::Rgb8),
        ("color", "qoi", ColorType::Rgb8),
        ("color", "gif", ColorType::Rgba8),
        ("alpha", "png", ColorType::Rgba16),
        ("alpha", "tif", ColorType::Rgba16),
        ("alpha", "pam", ColorType::Rgba16),
        ("alpha", "ff", ColorType::Rgba16),
        ("alpha", "webp", ColorType::Rgba8),
        ("alpha", "tga", ColorType::Rgba8),
        ("alpha", "ico", ColorType::Rgba8),
        ("alpha", "bmp", ColorType::Rgba8),
    ] {
        let output = format!("{name}.{extension}");
        room.ok(&["decode", &format!("{name}.gip"), &output]);
        let decoded = open(&room.path(&output));
        assert_eq!(decoded.color(), color, "{output}");
        assert_eq!((decoded.width(), decoded.height()), (WIDTH, HEIGHT), "{output}");
        if color.bytes_per_pixel() / color.channel_count() == 2 {
            let compared = room.ok(&["compare", &format!("{name}.gip"), &output]);
            assert_eq!(compared, "identical\n", "{output}");
        }
    }
    for (input, output, missing) in [
        ("alpha.gip", "a.jpg", "alpha"),
        ("alpha.gip", "a.ppm", "alpha"),
        ("color.gip", "a.pgm", "colour"),
    ] {
        let error = room.fails(&["decode", input, output]);
        assert!(error.contains(missing) && error.contains(output), "{output}: {error}");
        assert!(!room.path(output).exists());
    }
    for output in ["a", "a.exr"] {
        let wrong = room.run(&["decode", "color.gip", output]);
        assert_eq!(wrong.status.code(), Some(2));
        assert!(text(&wrong.stderr).contains("extension"));
        assert!(!room.path(output).exists());
    }
    // Formats have sides of so many pixels.
    for (output, size, most) in
        [("a.ico", "257x8", "256"), ("a.webp", "1x16385", "16384"), ("a.tga", "65536x1", "65535")]
    {
        let error = room.fails(&["decode", "color.gip", output, "--size", size]);
        assert!(error.contains(output) && error.contains(&format!("{most}x{most}")), "{error}");
        assert!(!room.path(output).exists());
    }
}

#[test]
fn sizes_and_regions() {
    let room = Room::new();
    room.gip("a.gip", ColorType::Rgb8);
    let size = |flags: &[&str]| {
        room.ok(&[&["decode", "a.gip", "b.png"], flags].concat());
        let decoded = open(&room.path("b.png"));
        (decoded.width(), decoded.height())
    };
    assert_eq!(size(&["--scale", "2"]), (96, 72));
    assert_eq!(size(&["--scale", "0.3"]), (14, 11));
    assert_eq!(size(&["--scale", "0.001"]), (1, 1));
    assert_eq!(size(&["--size", "33x7"]), (33, 7));
    for (bounds, expected) in
        [("24", (24, 18)), ("24x9", (12, 9)), ("1", (1, 1)), ("9000", (48, 36))]
    {
        assert_eq!(size(&["--fit", bounds]), expected, "{bounds}");
    }
    assert_eq!(size(&["--fit", "24", "--region", "20,0,4,18"]), (4, 18));
    assert_eq!(size(&["--region", "40,30,8,6"]), (8, 6));
    assert_eq!(size(&["--scale", "3", "--region", "100,50,44,58"]), (44, 58));

    room.ok(&["decode", "a.gip", "whole.png", "--scale", "3"]);
    let crop = open(&room.path("whole.png")).crop_imm(100, 50, 44, 58);
    assert_eq!(open(&room.path("b.png")), crop);

    for (flag, value, reason) in [
        ("--region", "41,30,8,6", "region"),
        ("--size", "4000000000x1", "each side must be 1 to 8388608"),
        ("--scale", "1000", "limit exceeded"),
    ] {
        let error = room.fails(&["decode", "a.gip", "c.png", flag, value]);
        assert!(error.contains(reason), "{error}");
        assert!(!room.path("c.png").exists());
    }
    let output = room.run(&["decode", "a.gip", "c.png", "--region", "-1,0,5,5"]);
    let error = text(&output.stderr);
    assert!(error.contains("not four whole numbers") && !error.contains("tip:"), "{error}");
}

#[test]
fn a_picture_that_fits_is_rendered_at_its_size() {
    let room = Room::new();
    fs::write(room.path("a.gip"), layered::damaged(&[])).expect("writable");
    room.ok(&["decode", "a.gip", "fit.png", "--fit", "30"]);
    room.ok(&["decode", "a.gip", "size.png", "--size", "30x20"]);
    assert_eq!(room.read("fit.png"), room.read("size.png"));
}

#[test]
fn a_format_can_be_named() {
    let room = Room::new();
    room.gip("a.gip", ColorType::Rgb8);
    room.ok(&["decode", "a.gip", "a.png"]);
    // Thumbnailers give names without an extension, of files that are there.
    room.write("empty", "");
    for output in ["new", "empty", ".hidden", "a.jpg", "a.tmp"] {
        room.ok(&["decode", "a.gip", output, "--format", "png"]);
        assert_eq!(room.read(output), room.read("a.png"), "{output}");
    }
    let output = room.run(&["decode", "a.gip", "-", "--format", "PPM"]);
    assert!(output.stdout.starts_with(b"P6\n48 36\n"));
    // A format takes what it has, whatever the name says.
    room.gip("alpha.gip", ColorType::Rgba8);
    let error = room.fails(&["decode", "alpha.gip", "alpha.png", "--format", "jpg"]);
    assert!(error.contains("no alpha"), "{error}");
}

#[test]
fn texture_can_be_left_out() {
    let room = Room::new();
    let file = include_bytes!("../../spec/vectors/texture-gray8.gip");
    fs::write(room.path("a.gip"), file).expect("writable");
    let decoder = super::common::decode_valid(file);
    let picture = decoder.picture().expect("a complete file");
    room.ok(&["decode", "a.gip", "with.png"]);
    room.ok(&["decode", "a.gip", "without.png", "--no-texture"]);
    for (name, texture) in [("with.png", true), ("without.png", false)] {
        let options = RenderOptions::new().with_texture(texture);
        let mut expected = vec![0; picture.output_len(&options).expect("it fits")];
        picture.render_u8(&options, &mut expected).expect("a sound request");
        assert_eq!(open(&room.path(name)).as_bytes(), expected, "{name}");
    }
}

#[test]
fn layers_that_do_not_show_are_not_decoded() {
    let room = Room::new();
    let decode = |layers: &[usize], flags: &[&str]| {
        fs::write(room.path("a.gip"), layered::damaged(layers)).expect("writable");
        room.run(&[&["decode", "a.gip", "b.png"], flags].concat())
    };
    for ((width, height), region, count) in layered::regions() {
        let size = format!("{width}x{height}");
        let Region { x, y, width: columns, height: rows } = region;
        let region_flag = format!("{x},{y},{columns},{rows}");
        let showing = layered::showing((width, height), region);
        assert_eq!(showing.len(), count);
        let hidden: Vec<usize> =
            (0..layered::LAYERS).filter(|layer| !showing.contains(layer)).collect();
        let mut flags = vec![["--size", &size, "--region", &region_flag]];
        // Where both axes are scaled alike, by a factor or not at all.
        let scale = (f64::from(width) / f64::from(layered::SIZE.0)).to_string();
        if width * layered::SIZE.1 == height * layered::SIZE.0 {
            flags.push(["--scale", &scale, "--region", &region_flag]);
        }
        for flags in flags {
            let output = decode(&hidden, &flags);
            assert!(output.status.success(), "{flags:?}: {}", text(&output.stderr));
            for &layer in &showing[..count.min(2)] {
                let output = decode(&[layer], &flags);
                let error = text(&output.stderr);
                assert_eq!(output.status.code(), Some(1), "{flags:?}, layer {layer}");
                assert!(error.starts_with("error: a.gip: chunk L (layer): "), "{error}");
            }
        }
    }
    // The whole picture takes the first layer and the last, and those between them.
    for layer in [0, 11, layered::LAYERS - 1] {
        for flags in [&[][..], &["--scale", "0.1"]] {
            assert_eq!(decode(&[layer], flags).status.code(), Some(1), "{flags:?}, {layer}");
        }
    }
}

#[test]
fn threads_change_nothing() {
    let room = Room::new();
    room.save("a.png", ColorType::Rgb8);
    for threads in ["1", "2"] {
        let name = format!("{threads}.gip");
        let flags = ["--gaussians", "20", "--effort", "1", "--threads", threads];
        room.ok(&[&["encode", "a.png", &name], &flags[..]].concat());
        room.ok(&["decode", &name, &format!("{threads}.png"), "--threads", threads]);
    }
    for extension in ["gip", "png"] {
        let read = |threads| fs::read(room.path(&format!("{threads}.{extension}"))).unwrap();
        assert_eq!(read(1), read(2), "{extension}");
    }
}

#[test]
fn metadata_is_carried_and_orientation_applied_once() {
    let room = Room::new();
    let source = room.save("a.png", ColorType::Rgb8);
    let mut profile = vec![7; 200];
    profile[..4].copy_from_slice(&200_u32.to_be_bytes());
    profile[16..20].copy_from_slice(b"RGB ");
    let mut file = Vec::new();
    let mut png = image::codecs::png::PngEncoder::new(&mut file);
    png.set_icc_profile(profile.clone()).expect("PNG has profiles");
    png.set_exif_metadata(EXIF_ROTATE_90.to_vec()).expect("PNG has Exif");
    source.write_with_encoder(png).expect("writable");
    fs::write(room.path("turned.png"), file).expect("writable");

    room.encode("turned.png", "a.gip");
    let info = room.json(&["info", "a.gip", "--json"]);
    assert_eq!((&info["width"], &info["height"]), (&HEIGHT.into(), &WIDTH.into()));
    assert_eq!(info["metadata"]["icc_profile"], 200);
    assert_eq!(info["metadata"]["exif"], EXIF_ROTATE_90.len());

    for name in ["b.png", "b.jpg", "b.webp"] {
        room.ok(&["decode", "a.gip", name]);
        let reader = ImageReader::open(room.path(name)).unwrap();
        let mut decoder = reader.into_decoder().unwrap();
        assert_eq!(decoder.dimensions(), (HEIGHT, WIDTH), "{name}");
        assert_eq!(decoder.icc_profile().unwrap().as_ref(), Some(&profile), "{name}");
        let exif = decoder.exif_metadata().unwrap().expect("carried");
        assert_eq!(Orientation::from_exif_chunk(&exif), Some(Orientation::NoTransforms), "{name}");
    }
    // Turned by hand, it is the same picture.
    source.rotate90().save(room.path("upright.png")).unwrap();
    assert_eq!(room.ok(&["compare", "turned.png", "upright.png"]), "identical\n");
}

#[test]
fn gif_has_no_alpha_between_transparent_and_opaque() {
    let room = Room::new();
    let color = |x: u32| image::Rgba([200, 60, 20, (x * 17) as u8]);
    room.save_picture("a.png", &image::RgbaImage::from_fn(16, 8, |x, _| color(x)).into());
    room.ok(&["encode", "a.png", "a.gip", "--psnr", "60"]);
    let output = room.run(&["decode", "a.gip", "a.gif"]);
    assert!(output.status.success());
    let gif = ImageReader::open(room.path("a.gif")).expect("it was written").decode();
    let gif = gif.expect("a picture").to_rgba8();
    let alphas = gif.rows().next().expect("a row").map(|pixel| pixel.0[3]);
    assert_eq!(alphas.collect::<Vec<_>>(), [[0; 8], [255; 8]].concat());
    let warning = text(&output.stderr);
    assert_eq!(warning, "warning: a.gip: its alpha is rounded to transparent or opaque\n");
}

#[test]
fn a_profile_for_another_color_space_is_dropped() {
    let room = Room::new();
    let mut profile = vec![7; 200];
    profile[..4].copy_from_slice(&200_u32.to_be_bytes());
    profile[16..20].copy_from_slice(b"CMYK");
    let mut file = Vec::new();
    let mut png = image::codecs::png::PngEncoder::new(&mut file);
    png.set_icc_profile(profile).expect("PNG has profiles");
    picture(ColorType::Rgb8).write_with_encoder(png).expect("writable");
    fs::write(room.path("a.png"), file).expect("writable");
    room.encode("a.png", "a.gip");
    assert!(room.json(&["info", "a.gip", "--json"])["metadata"]["icc_profile"].is_null());
}

#[test]
fn comparison_meets_at_the_richer_picture() {
    let room = Room::new();
    let gray = room.save("gray.png", ColorType::L8);
    DynamicImage::from(gray.to_rgb8()).save(room.path("rgb.png")).unwrap();
    DynamicImage::from(gray.to_rgba16()).save(room.path("rgba16.png")).unwrap();
    for (b, channels, depth) in [("gray.png", 1, 8), ("rgb.png", 3, 8), ("rgba16.png", 3, 16)] {
        let comparison = room.json(&["compare", "gray.png", b, "--json"]);
        assert_eq!(comparison["psnr"], 999.0);
        assert_eq!(comparison["ms_ssim"], 1.0);
        assert_eq!(comparison["max_abs_error"], 0);
        assert_eq!(
            (&comparison["channels"], &comparison["depth"]),
            (&channels.into(), &depth.into())
        );
    }

    let mut changed = gray.to_luma8();
    changed.get_pixel_mut(3, 4).0[0] += 51;
    changed.save(room.path("changed.png")).unwrap();
    let comparison = room.json(&["compare", "gray.png", "changed.png", "--json"]);
    let expected = 10.0 * (25.0 * f64::from(WIDTH * HEIGHT)).log10();
    assert!((comparison["psnr"].as_f64().expect("a number") - expected).abs() < 1e-9);
    assert_eq!(comparison["max_abs_error"], 51);

    gray.crop_imm(0, 0, WIDTH, 8).save(room.path("small.png")).unwrap();
    assert!(room.fails(&["compare", "gray.png", "small.png"]).contains("48x36 and 48x8"));
}

#[test]
fn wrong_usage_exits_with_2() {
    let room = Room::new();
    room.save("a.png", ColorType::L8);
    let encode = ["encode", "a.png", "a.gip"];
    let decode = ["decode", "a.gip", "b.png"];
    let batch = ["batch", "a.png", "--out", "out"];
    for (command, flags, allowed) in [
        (&[][..], &[][..], "subcommand"),
        (&["frobnicate"], &[], "unrecognized"),
        (&["encode", "a.png"], &[], "OUTPUT"),
        (&encode, &["--effort", "0"], "1..=7"),
        (&encode, &["--effort", "8"], "1..=7"),
        (&encode, &["--texture", "101"], "0..=100"),
        (&encode, &["--psnr", "-3"], "from 1 to 120"),
        (&encode, &["--psnr", "NaN"], "from 1 to 120"),
        (&encode, &["--psnr", "inf"], "from 1 to 120"),
        (&encode, &["--bpp", "0"], "from 0.000001 to 1000000"),
        (&encode, &["--quality", "101"], "from 0 to 100"),
        (&encode, &["--bytes", "0"], "1..=1073741824"),
        (&encode, &["--gaussians", "-5"], "1..=4194304"),
        (&encode, &["--gaussians", "5", "--bpp", "1"], "cannot be used with"),
        (&encode, &["--bytes", "5000", "--quality", "60"], "cannot be used with"),
        (&encode, &["--precision", "f16"], "f32, packed"),
        (&encode, &["--precision", "packed", "--first-layer", "300"], "cannot be used with"),
        (&encode, &["--precision", "f32", "--first-layer", "300"], "cannot be used with"),
        (&batch, &["--precision", "packed", "--first-layer", "300"], "cannot be used with"),
        (&encode, &["--threads", "0"], "1..=1024"),
        (&decode, &["--scale", "0"], "from 0.001 to 1000"),
        (&decode, &["--size", "640"], "640x480"),
        (&decode, &["--scale", "2", "--size", "6x4"], "cannot be used with"),
        (&decode, &["--fit", "0"], "160x120"),
        (&decode, &["--fit", "9", "--size", "6x4"], "cannot be used with"),
        (&decode, &["--fit", "9", "--scale", "2"], "cannot be used with"),
        (&decode, &["--format", "gip"], "png, tif"),
        (&["decode", "a.gip", "b"], &[], "--format"),
        (&["info"], &[], "FILE"),
        (&decode, &["--region", "1,2,3"], "X,Y,W,H"),
    ] {
        let args = [command, flags].concat();
        let output = room.run(&args);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {error}");
        assert!(error.starts_with("error: ") && error.contains(allowed), "{args:?}: {error}");
        assert!(output.stdout.is_empty(), "{args:?}");
    }
    assert_eq!(room.names(), ["a.png"], "nothing was written");

    // What comes next is told, too: a tip, how the command is used, and where to read more.
    let error = text(&room.run(&["encode", "a.png", "a.gip", "--qualty", "60"]).stderr);
    for words in ["similar argument exists: '--quality'", "Usage: gip encode ", "'--help'"] {
        assert!(error.contains(words), "{words}: {error}");
    }
}

#[test]
fn failures_leave_no_output() {
    let room = Room::new();
    room.save("a.png", ColorType::Rgb8);
    let png = fs::read(room.path("a.png")).expect("just written");
    let mut corrupt = png.clone();
    let middle = corrupt.len() / 2;
    corrupt[middle] ^= 0xFF;
    fs::write(room.path("corrupt.png"), corrupt).expect("writable");
    fs::write(room.path("short.png"), &png[..png.len() / 2]).expect("writable");
    fs::write(room.path("text.png"), "not a picture").expect("writable");
    room.encode("a.png", "a.gip");
    let gip = fs::read(room.path("a.gip")).expect("just written");
    fs::write(room.path("short.gip"), &gip[..gip.len() - 5]).expect("writable");
    fs::write(room.path("kept.gip"), "precious").expect("writable");
    fs::write(room.path("kept.png"), "precious").expect("writable");
    let before = room.names();

    for input in ["corrupt.png", "short.png", "text.png", "missing.png", "short.gip"] {
        for output in ["new.gip", "kept.gip"] {
            let error = room.fails(&["encode", input, output, "--effort", "1"]);
            assert!(error.contains(input), "{error}");
        }
    }
    for input in ["short.gip", "a.png", "missing.gip"] {
        for output in ["new.png", "kept.png"] {
            let error = room.fails(&["decode", input, output]);
            assert!(error.contains(input), "{error}");
        }
        room.fails(&["info", input]);
    }
    assert!(room.fails(&["encode", "a.png", "nowhere/a.gip"]).contains("no directory nowhere"));
    assert!(room.fails(&["encode", "a.png", "."]).contains("is a directory"));
    room.fails(&["compare", "a.png", "corrupt.png"]);

    assert_eq!(room.names(), before, "nothing new, no temporary file");
    for kept in ["kept.gip", "kept.png"] {
        assert_eq!(fs::read(room.path(kept)).expect("kept"), b"precious");
    }
}

#[test]
fn a_name_of_another_format_is_refused() {
    let room = Room::new();
    room.save("a.png", ColorType::Rgb8);
    fs::write(room.path("kept.jpg"), "precious").expect("writable");
    for output in ["kept.jpg", "new.jpg", "new"] {
        let args = ["encode", "a.png", output, "--gaussians", "20", "--effort", "1"];
        let error = room.fails(&args);
        assert!(error.contains(output) && error.contains("--force"), "{error}");
        assert!(!room.names().iter().any(|name| name.starts_with("new")), "{output}");
    }
    assert_eq!(fs::read(room.path("kept.jpg")).expect("kept"), b"precious");
    // Upper case is as good, and who insists is obeyed.
    for output in [&["B.GIP"][..], &["kept.jpg", "--force"]] {
        room.ok(&[&["encode", "a.png", "--gaussians", "20", "--effort", "1"], output].concat());
        let file = fs::read(room.path(output[0])).expect("just written");
        assert!(file.starts_with(b"\xC7GIP"), "{output:?}");
    }
}

#[test]
fn existing_output_is_replaced_with_its_permissions() {
    let room = Room::new();
    room.save("a.png", ColorType::L8);
    fs::write(room.path("a.gip"), "old").expect("writable");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = fs::Permissions::from_mode(0o640);
        fs::set_permissions(room.path("a.gip"), mode).expect("our file");
        std::os::unix::fs::symlink("a.gip", room.path("link.gip")).expect("links are supported");
        room.encode("a.png", "link.gip");
        assert!(room.path("link.gip").is_symlink(), "the link stays");
        let mode = fs::metadata(room.path("a.gip")).expect("written").permissions().mode();
        assert_eq!(mode & 0o777, 0o640);
    }
    room.encode("a.png", "a.gip");
    room.ok(&["info", "a.gip"]);
}

#[test]
#[cfg(unix)]
fn devices_are_written_to_not_replaced() {
    let room = Room::new();
    room.save("a.png", ColorType::L8);
    room.encode("a.png", "a.gip");
    room.encode("a.png", "/dev/null");
    assert!(!Path::new("/dev/null").is_file());
    let args = ["encode", "a.png", "/dev/stdout", "--gaussians", "20", "--effort", "1"];
    assert_eq!(room.run(&args).stdout, fs::read(room.path("a.gip")).expect("just written"));
}

#[test]
fn partial_files_are_shown_on_request() {
    let room = Room::new();
    room.gip("a.gip", ColorType::Rgb8);
    let gip = fs::read(room.path("a.gip")).expect("just written");
    fs::write(room.path("short.gip"), &gip[..gip.len() - 20]).expect("writable");
    let args = ["decode", "short.gip", "b.png", "--allow-partial"];
    let output = room.run(&args);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let warning = text(&output.stderr);
    assert!(warning.starts_with("warning: short.gip: ") && warning.lines().count() == 1);
    assert_eq!(open(&room.path("b.png")).width(), WIDTH);

    // Without a header there is nothing to show.
    fs::write(room.path("stub.gip"), &gip[..20]).expect("writable");
    room.fails(&["decode", "stub.gip", "c.png", "--allow-partial"]);
    // A whole file is not warned about.
    let output = room.run(&["decode", "a.gip", "d.png", "--allow-partial"]);
    assert!(output.status.success() && output.stderr.is_empty());
}

#[test]
fn help_is_printed_on_request() {
    let room = Room::new();
    assert!(room.ok(&["--help"]).contains("gip encode photo.jpg photo.gip"));
    assert!(room.ok(&["--version"]).contains(env!("CARGO_PKG_VERSION")));
    for command in ["encode", "decode", "batch", "info", "compare"] {
        let help = room.ok(&[command, "--help"]);
        assert!(help.contains(&format!("Usage: gip {command} ")), "{help}");
        assert_eq!(room.ok(&["help", command]), help);
    }
}

#[test]
#[cfg(target_os = "linux")]
fn messages_that_nobody_can_read_change_no_status() {
    let room = Room::new();
    room.save_picture("a.png", &pictures::picture((40, 30), ColorType::Rgb8));
    room.ok(&["encode", "a.png", "a.gip", "--effort", "1"]);
    room.write("broken.gip", &room.read("a.gip")[..20]);
    let status = |args: &[&str]| {
        let full = fs::File::options().write(true).open("/dev/full").expect("Linux has it");
        let mut gip = Command::new(env!("CARGO_BIN_EXE_gip"));
        let gip = gip.args(args).current_dir(room.path(".")).stdout(Stdio::null()).stderr(full);
        gip.status().expect("the binary was built").code()
    };
    assert_eq!(status(&["info", "a.gip", "broken.gip"]), Some(3));
    assert_eq!(status(&["info", "broken.gip"]), Some(1));
    assert_eq!(status(&["encode", "a.png", "-", "--effort", "1"]), Some(0));
}

#[test]
fn no_result_takes_the_place_of_its_input() {
    let room = Room::new();
    room.save_picture("a.png", &pictures::picture((40, 30), ColorType::Rgb8));
    room.ok(&["encode", "a.png", "a.gip", "--effort", "1"]);
    let file = room.read("a.gip");
    room.write("b/c", "");
    for args in [
        ["decode", "--format", "png", "a.gip", "a.gip"],
        ["decode", "--format", "png", "a.gip", "b/../a.gip"],
        ["export", "--format", "json", "./a.gip", "a.gip"],
    ] {
        assert!(room.fails(&args).contains("a.gip is the input; use another name"), "{args:?}");
        assert_eq!(room.read("a.gip"), file);
    }
}
