//! What sources say about their colours: it is kept in codes or as an ICC profile or turned to sRGB, or its loss
//! is told.

use std::io::Cursor;

use image::{ColorType, DynamicImage, ImageDecoder, ImageEncoder, ImageFormat, ImageReader};
use image_gip::{Cicp, ColorModel, Encoder, Metadata, Source, Target};
use moxcms::ColorProfile;

use super::pictures;
use super::room::{Room, text};

const GAMMA: &[u8] = b"gAMA";
const CHROMATICITIES: &[u8] = b"cHRM";
const CODE_POINTS: &[u8] = b"cICP";
const SRGB_GAMMA: u32 = 45_455;
const SRGB: [u32; 8] = [31_270, 32_900, 64_000, 33_000, 30_000, 60_000, 15_000, 6_000];
const ADOBE: [u32; 8] = [31_270, 32_900, 64_000, 33_000, 21_000, 71_000, 15_000, 6_000];

/// A PNG of one colour with more chunks.
fn png(picture: &DynamicImage, chunks: &[(&[u8], Vec<u8>)]) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    picture.write_to(&mut file, ImageFormat::Png).expect("in memory");
    let file = file.into_inner();
    let mut all = file[..33].to_vec();
    for (name, contents) in chunks {
        all.extend((contents.len() as u32).to_be_bytes());
        let contents = [*name, contents].concat();
        all.extend(&contents);
        all.extend(crc32fast::hash(&contents).to_be_bytes());
    }
    [&all, &file[33..]].concat()
}

fn gamma(value: u32) -> (&'static [u8], Vec<u8>) {
    (GAMMA, value.to_be_bytes().to_vec())
}

fn chromaticities(values: [u32; 8]) -> (&'static [u8], Vec<u8>) {
    (CHROMATICITIES, values.iter().flat_map(|value| value.to_be_bytes()).collect())
}

fn code_points(primaries: u8, transfer: u8) -> (&'static [u8], Vec<u8>) {
    (CODE_POINTS, vec![primaries, transfer, 0, 1])
}

/// `mDCV` and `cLLI` of a display of BT.2020's primaries with 0.005 to 1000 cd/m².
fn light() -> [(&'static [u8], Vec<u8>); 2] {
    let points = [35_400_u16, 14_600, 8_500, 39_850, 6_550, 2_300, 15_635, 16_450];
    let luminances = [10_000_000_u32, 50].map(u32::to_be_bytes).concat();
    let display = [points.map(u16::to_be_bytes).concat(), luminances].concat();
    let levels = [9_000_000_u32, 1_234_567].map(u32::to_be_bytes).concat();
    [(b"mDCV", display), (b"cLLI", levels)]
}

/// What a PNG says of its samples beside a profile, with its payloads.
fn said(file: &[u8]) -> Vec<(Vec<u8>, Vec<u8>)> {
    let (mut at, mut found) = (8, Vec::new());
    while let Some(length) = file.get(at..).and_then(|rest| rest.first_chunk()) {
        let end = at + 8 + u32::from_be_bytes(*length) as usize;
        let name = file[at + 4..at + 8].to_vec();
        if [CODE_POINTS, b"mDCV", b"cLLI"].contains(&&name[..]) {
            found.push((name, file[at + 8..end].to_vec()));
        }
        at = end + 4;
    }
    found
}

/// What becomes of a source: the profile of the decoded picture, and what is printed.
fn carried(room: &Room, name: &str, file: &[u8]) -> (Option<ColorProfile>, String) {
    room.write(name, file);
    let args = ["encode", name, "a.gip", "--effort", "1", "--gaussians", "1"];
    let output = room.run(&args);
    assert!(output.status.success(), "{name}: {}", text(&output.stderr));
    room.ok(&["decode", "a.gip", "a.png"]);
    let reader = ImageReader::open(room.path("a.png")).expect("it was written");
    let profile = reader.into_decoder().expect("a PNG").icc_profile().expect("a PNG");
    let profile = profile.map(|profile| ColorProfile::new_from_slice(&profile).expect("valid"));
    (profile, text(&output.stderr))
}

#[test]
fn chunks_of_png_become_a_profile() {
    let room = Room::new();
    let picture = pictures::picture((8, 8), ColorType::Rgb8);
    // x and y of the red of the primaries, adapted to D50.
    let adobe = (0.6097, 0.3111);
    for (chunks, red) in [
        (&[gamma(SRGB_GAMMA), chromaticities(ADOBE)][..], Some(adobe)),
        (&[chromaticities(ADOBE)], Some(adobe)),
        // sRGB in other words.
        (&[code_points(1, 13)], None),
        (&[gamma(SRGB_GAMMA), chromaticities(SRGB)], None),
        (&[gamma(SRGB_GAMMA)], None),
        (&[(b"sRGB", vec![0]), gamma(100_000), chromaticities(ADOBE)], None),
        // Not specified, or only what is as in sRGB.
        (&[code_points(2, 2)], None),
        (&[code_points(1, 2)], None),
        (&[code_points(2, 13)], None),
    ] {
        let (profile, printed) = carried(&room, "a.png", &png(&picture, chunks));
        assert_eq!(printed, "", "{chunks:?}");
        let found = profile.map(|profile| (profile.red_colorant.x, profile.red_colorant.y));
        match (found, red) {
            (Some((x, y)), Some((u, v))) => {
                assert!((x - u).abs() < 0.001 && (y - v).abs() < 0.001, "{chunks:?}: {x} {y}");
            }
            (found, red) => assert_eq!(found, red, "{chunks:?}"),
        }
    }
}

#[test]
fn code_points_of_png_are_kept() {
    let room = Room::new();
    let picture = pictures::picture((8, 8), ColorType::Rgb8);
    let profile = ColorProfile::new_adobe_rgb().encode().expect("valid");
    let mut with_profile = Vec::new();
    let mut encoder = image::codecs::png::PngEncoder::new(&mut with_profile);
    encoder.set_icc_profile(profile).expect("PNG has it");
    picture.write_with_encoder(encoder).expect("in memory");
    // x and y of the red of a profile in their place, where there is one.
    let (p3, wide) = ((0.5151, 0.2412), (0.6735, 0.2790));
    for (codes, other, red) in [
        ((12, 13), vec![], Some(p3)),
        ((9, 14), vec![gamma(100_000), chromaticities(SRGB)], Some(wide)),
        ((9, 16), light().to_vec(), None),
        ((9, 18), vec![], None),
        ((9, 2), vec![], None),
        ((2, 4), vec![], None),
        ((200, 201), vec![], None),
    ] {
        let (primaries, transfer) = codes;
        let chunks = [vec![code_points(primaries, transfer)], other].concat();
        room.write("a.png", png(&picture, &chunks));
        let warnings =
            room.warnings(&["encode", "a.png", "a.gip", "--effort", "1", "--gaussians", "1"]);
        assert_eq!(warnings, "", "{codes:?}");
        let found = &room.json(&["info", "a.gip", "--json"])["metadata"]["cicp"];
        assert_eq!(
            (&found["primaries"], &found["transfer"]),
            (&primaries.into(), &transfer.into())
        );
        assert_eq!(room.warnings(&["decode", "a.gip", "b.png"]), "");
        let expected: Vec<_> = (chunks.iter())
            .filter(|(name, _)| ![GAMMA, CHROMATICITIES].contains(name))
            .map(|(name, payload)| (name.to_vec(), payload.clone()))
            .collect();
        assert_eq!(said(&room.read("b.png")), expected);

        for name in ["b.jpg", "b.webp", "b.bmp"] {
            let warnings = room.warnings(&["decode", "a.gip", name]);
            let reader = ImageReader::open(room.path(name)).expect("it was written");
            let profile = reader.into_decoder().expect("sound").icc_profile().expect("sound");
            let red = red.filter(|_| name != "b.bmp");
            let told = format!("cICP {primaries}/{transfer}/0/1) is not written to");
            assert_eq!(warnings.contains(&told), red.is_none(), "{name}: {warnings}");
            assert_eq!(warnings.contains("mastering"), expected.len() == 3, "{name}: {warnings}");
            let found = profile.map(|profile| {
                let profile = ColorProfile::new_from_slice(&profile).expect("valid");
                (profile.red_colorant.x, profile.red_colorant.y)
            });
            assert_eq!(found.is_some(), red.is_some(), "{name}");
            if let (Some((x, y)), Some((u, v))) = (found, red) {
                assert!((x - u).abs() < 0.001 && (y - v).abs() < 0.001, "{name}: {x} {y}");
            }
        }
    }

    // A profile remains beside them for who does not know them, but they count.
    let (before, after) = with_profile.split_at(33);
    let codes = png(&picture, &[code_points(12, 13)]);
    room.write("a.png", [before, &codes[33..49], after].concat());
    room.ok(&["encode", "a.png", "a.gip", "--effort", "1", "--gaussians", "1"]);
    room.ok(&["decode", "a.gip", "b.png"]);
    assert_eq!(said(&room.read("b.png")).len(), 1);
    let info = room.json(&["info", "a.gip", "--json"]);
    assert!(info["metadata"]["icc_profile"].is_u64(), "{info}");
    room.ok(&["decode", "a.gip", "b.jpg"]);
    let reader = ImageReader::open(room.path("b.jpg")).expect("it was written");
    let profile = reader.into_decoder().expect("a JPEG").icc_profile().expect("a JPEG");
    let profile = ColorProfile::new_from_slice(&profile.expect("there is one")).expect("valid");
    assert!((profile.red_colorant.x - 0.5151).abs() < 0.001);

    // No policy drops them.
    for policy in ["safe", "none"] {
        let warnings = room.warnings(&[
            "encode",
            "a.png",
            "a.gip",
            "--effort",
            "1",
            "--gaussians",
            "1",
            "--metadata",
            policy,
        ]);
        assert_eq!(warnings, "");
        assert_eq!(room.json(&["info", "a.gip", "--json"])["metadata"]["cicp"]["primaries"], 12);
        room.ok(&["decode", "a.gip", "b.png", "--metadata", policy]);
        assert_eq!(said(&room.read("b.png")).len(), 1);
    }
    let shown = room.ok(&["info", "a.gip"]);
    assert!(shown.contains("colour space        Display P3, cICP 12/13/0/1"), "{shown}");
}

/// The profile of a picture of any format.
fn profile_of(room: &Room, name: &str) -> Option<Vec<u8>> {
    let reader = ImageReader::open(room.path(name)).expect("it was written");
    reader.into_decoder().expect("sound").icc_profile().expect("sound")
}

/// A gray .gip file with these colours.
fn gray_gip(codes: Option<Cicp>, profile: Option<&Vec<u8>>) -> Vec<u8> {
    let mut metadata = Metadata::default();
    (metadata.cicp, metadata.icc_profile) = (codes, profile.cloned());
    let encoder = Encoder::new().with_target(Target::Gaussians(1)).with_effort(1);
    let picture = pictures::picture((8, 8), ColorType::L8);
    let source = Source::new_u8(8, 8, ColorModel::Gray, picture.as_bytes()).expect("64 samples");
    encoder.with_metadata(metadata).encode(&source).expect("valid").bytes
}

#[test]
fn a_gray_picture_has_a_profile_of_rgb_in_webp() {
    let room = Room::new();
    let gray = ColorProfile::new_gray_with_gamma(2.2).encode().expect("valid");
    let rgb = ColorProfile::new_adobe_rgb().encode().expect("valid");
    let (linear, p3, pq) = (Cicp::new(1, 8), Cicp::new(12, 13), Cicp::new(9, 16));
    let dropped = "its ICC profile is one of GRAY and cannot be kept";
    for (codes, profile, space, expected) in [
        (Some(linear), None, Some(b"RGB "), None),
        (Some(p3), None, Some(b"RGB "), None),
        // Codes count before a profile.
        (Some(p3), Some(&gray), Some(b"RGB "), None),
        (None, Some(&gray), None, Some(dropped)),
        (Some(pq), None, None, Some("cICP 9/16/0/1) is not written to WebP")),
        (None, Some(&rgb), Some(b"RGB "), None),
    ] {
        room.write("a.gip", gray_gip(codes, profile));
        let warnings = room.warnings(&["decode", "a.gip", "a.webp"]);
        let found = profile_of(&room, "a.webp");
        let case = format!("{codes:?}: {warnings}");
        assert_eq!(found.as_ref().map(|found| &found[16..20]), space.map(|s| &s[..]), "{case}");
        assert_eq!(warnings.lines().count(), expected.iter().count(), "{case}");
        assert!(expected.is_none_or(|expected| warnings.contains(expected)), "{case}");
        if codes.is_none() && space.is_some() {
            assert_eq!(found.as_ref(), profile);
        }
        // Other formats have gray.
        room.warnings(&["decode", "a.gip", "a.jpg"]);
        let found = profile_of(&room, "a.jpg");
        assert!(found.is_none_or(|found| found[16..20] == *b"GRAY"), "{case}");
    }
}

#[test]
fn colours_that_a_thumbnail_lacks_are_told() {
    let room = Room::new();
    let picture = pictures::picture((8, 8), ColorType::Rgb8);
    let with_profile = |profile: ColorProfile| {
        let mut file = Vec::new();
        let mut encoder = image::codecs::png::PngEncoder::new(&mut file);
        encoder.set_icc_profile(profile.encode().expect("valid")).expect("PNG has it");
        picture.write_with_encoder(encoder).expect("in memory");
        file
    };
    let pq = [vec![code_points(9, 16)], light().to_vec()].concat();
    for (file, told) in [
        (png(&picture, &pq), &["jpg", "webp", "bmp", "gif"][..]),
        (png(&picture, &[code_points(12, 13)]), &["bmp", "gif"]),
        (with_profile(ColorProfile::new_adobe_rgb()), &["bmp", "gif"]),
        (with_profile(ColorProfile::new_srgb()), &[]),
    ] {
        room.write("a.png", file);
        room.ok(&["encode", "a.png", "a.gip", "--effort", "1", "--gaussians", "1"]);
        for format in ["png", "jpg", "webp", "bmp", "gif"] {
            let args = ["batch", "a.gip", "--out", "out", "--thumbnail", "4", "--format", format];
            let warnings = room.warnings(&args);
            assert_eq!(warnings.contains(" is not written to "), told.contains(&format));
            assert!(warnings.lines().count() <= 1, "{warnings}");
        }
    }
    // Codes of sRGB say what is taken for granted.
    room.write("a.gip", gray_gip(Some(Cicp::SRGB), None));
    assert_eq!(room.warnings(&["decode", "a.gip", "a.bmp"]), "");
}

#[test]
fn pictures_of_pq_with_16_bits_come_back_as_they_were() {
    let room = Room::new();
    // From dark to 1000 cd/m², with a few 16-bit codes between neighbours.
    let picture = DynamicImage::from(image::ImageBuffer::from_fn(96, 64, |x, y| {
        let code = |value: f64| (value.clamp(0.0, 1.0) * 65_535.0).round() as u16;
        let (x, y) = (f64::from(x) / 96.0, f64::from(y) / 64.0);
        image::Rgb([code(0.75 * x), code(0.1 + 0.6 * y), code(0.3 + 0.2 * (6.0 * x * y).sin())])
    }));
    let chunks = [&[code_points(9, 16)], &light()[..]].concat();
    room.write("a.png", png(&picture, &chunks));
    let args = ["encode", "a.png", "a.gip", "--quality", "80", "--effort", "2"];
    assert_eq!(room.warnings(&args), "");
    room.ok(&["decode", "a.gip", "b.png"]);
    let expected: Vec<_> =
        chunks.iter().map(|(name, payload)| (name.to_vec(), payload.clone())).collect();
    assert_eq!(said(&room.read("b.png")), expected);
    let compared = room.json(&["compare", "a.png", "b.png", "--json"]);
    assert_eq!(compared["depth"], 16);
    assert!(compared["psnr"].as_f64().expect("a number") > 40.0, "{compared}");
    // The prefix of the file says so, too.
    room.ok(&["prefix", "a.gip", "1000000", "c.gip"]);
    let info = room.json(&["info", "c.gip", "--json"]);
    assert_eq!(info["metadata"]["cicp"]["transfer"], 16);
    assert_eq!(info["metadata"]["mastering_display"]["max_luminance"], 1000.0);
    assert_eq!(info["metadata"]["content_light"]["max_content"], 900.0);
}

#[test]
fn chunks_of_png_that_are_invalid_are_ignored_with_a_warning() {
    let room = Room::new();
    let picture = pictures::picture((8, 8), ColorType::Rgb8);
    let line = [31_270, 32_900, 10_000, 10_000, 20_000, 20_000, 60_000, 60_000];
    let outside = [90_000, 90_000, 64_000, 33_000, 30_000, 60_000, 15_000, 6_000];
    let garbage = vec![b'a', 0, 0, 1, 2, 3];
    for (name, contents) in [
        chromaticities([0; 8]),
        chromaticities([31_270; 8]),
        chromaticities(line),
        chromaticities(outside),
        gamma(0),
        gamma(1),
        gamma(u32::MAX),
        (GAMMA, vec![1]),
        (CODE_POINTS, vec![1, 13, 1, 1]),
        (CODE_POINTS, vec![1, 13, 0, 7]),
        (b"iCCP", garbage),
        (b"sRGB", vec![9]),
    ] {
        let (profile, printed) = carried(&room, "a.png", &png(&picture, &[(name, contents)]));
        assert!(profile.is_none());
        let name = text(name);
        let expected = format!("warning: a.png: its chunk {name} is invalid, and is ignored\n");
        assert_eq!(printed, expected);
    }
    // A background before the palette that it needs is no concern of the picture.
    let bad = png(&picture, &[(b"bKGD", vec![1]), code_points(12, 13)]);
    carried(&room, "a.png", &bad);
    assert_eq!(said(&room.read("a.png")).len(), 1);

    let mut file = Vec::new();
    let mut encoder = image::codecs::png::PngEncoder::new(&mut file);
    encoder.set_icc_profile(vec![1; 200]).expect("PNG has it");
    picture.write_with_encoder(encoder).expect("in memory");
    let (profile, printed) = carried(&room, "a.png", &file);
    assert!(profile.is_none());
    assert_eq!(printed, "warning: a.png: its ICC profile is damaged and cannot be kept\n");
}

#[test]
fn a_gamma_alone_is_turned_to_that_of_srgb() {
    let room = Room::new();
    let linear =
        image::RgbaImage::from_raw(3, 1, vec![0, 55, 255, 255, 55, 55, 55, 9, 1, 255, 128, 0]);
    let linear = DynamicImage::from(linear.expect("a row"));
    let expected =
        image::RgbaImage::from_raw(3, 1, vec![0, 128, 255, 255, 128, 128, 128, 9, 13, 255, 188, 0]);
    let expected = DynamicImage::from(expected.expect("a row"));
    room.write("linear.png", png(&linear, &[gamma(100_000)]));
    room.save_picture("srgb.png", &expected);
    assert_eq!(room.ok(&["compare", "linear.png", "srgb.png"]), "identical\n");
    // With 16 bits, and gray, too.
    for (picture, full) in
        [(linear.to_rgba16().into(), 65_535.0), (linear.to_luma8().into(), 255.0)]
    {
        room.write("linear.png", png(&picture, &[gamma(100_000)]));
        let plain = room.json(&["compare", "linear.png", "srgb.png", "--json"]);
        let error = plain["max_abs_error"].as_f64().expect("a number");
        assert!(full == 255.0 || error < full / 250.0, "{plain}");
    }
}

#[test]
fn cameras_name_adobe_rgb_in_exif() {
    let room = Room::new();
    let picture = pictures::picture((8, 8), ColorType::Rgb8);
    for (index, red) in [(b"R03\0", Some(0.6097)), (b"R98\0", None)] {
        // Three directories of an entry each: to that of Exif, to that of interoperability, the index.
        let mut exif = b"II*\0\x08\0\0\0".to_vec();
        exif.extend(b"\x01\0\x69\x87\x04\0\x01\0\0\0\x1A\0\0\0\0\0\0\0");
        exif.extend(b"\x01\0\x05\xA0\x04\0\x01\0\0\0\x2C\0\0\0\0\0\0\0");
        exif.extend([&b"\x01\0\x01\0\x02\0\x04\0\0\0"[..], index, &[0; 4]].concat());
        let mut file = Vec::new();
        let mut encoder = image::codecs::jpeg::JpegEncoder::new(&mut file);
        encoder.set_exif_metadata(exif).expect("JPEG has it");
        picture.write_with_encoder(encoder).expect("in memory");
        let (profile, printed) = carried(&room, "a.jpg", &file);
        assert_eq!(printed, "");
        let found = profile.map(|profile| profile.red_colorant.x);
        assert_eq!(found.map(|x| (x * 1e3).round()), red.map(|x: f64| (x * 1e3).round()));
    }
}

#[test]
fn colours_that_cannot_be_kept_are_told() {
    let room = Room::new();
    let picture = pictures::picture((8, 8), ColorType::Rgb8);
    for (chunks, kept) in [
        (&[(CODE_POINTS, vec![9, 16, 0, 0])][..], "its samples are taken as sRGB"),
        (
            &[(CODE_POINTS, vec![1, 1, 0, 0]), gamma(SRGB_GAMMA)],
            "what else it says about its colours counts",
        ),
    ] {
        let (profile, printed) = carried(&room, "a.png", &png(&picture, chunks));
        assert!(profile.is_none());
        let [primaries, transfer, ..] = chunks[0].1[..] else { panic!("four bytes") };
        let expected = format!(
            "warning: a.png: its colour space (cICP {primaries}/{transfer}/0/0, of limited range) \
             cannot be kept; {kept}\n"
        );
        assert_eq!(printed, expected);
    }

    let mut radiance = Cursor::new(Vec::new());
    let floats = DynamicImage::from(picture.to_rgb32f());
    floats.write_to(&mut radiance, ImageFormat::Hdr).expect("in memory");
    let radiance = radiance.into_inner();
    assert_eq!(carried(&room, "a.hdr", &radiance).1, "");
    let line = radiance.iter().position(|&byte| byte == b'\n').expect("a header") + 1;
    let primaries = b"PRIMARIES= .7 .3 .2 .7 .1 .05 .33 .33\n";
    let other = [&radiance[..line], primaries, &radiance[line..]].concat();
    assert!(carried(&room, "a.hdr", &other).1.contains("its primaries (.7 .3"));
}

#[test]
fn colours_of_bmp_are_kept_as_a_profile_or_told() {
    let room = Room::new();
    let mut plain = Cursor::new(Vec::new());
    let picture = pictures::picture((8, 8), ColorType::Rgb8);
    picture.write_to(&mut plain, ImageFormat::Bmp).expect("in memory");
    let plain = plain.into_inner();
    let place = |at: usize| u32::from_le_bytes(*plain[at..].first_chunk().expect("a header"));
    let (header, samples) = (place(14) as usize, &plain[place(10) as usize..]);
    let profile = ColorProfile::new_adobe_rgb().encode().expect("valid");
    // Kind, primaries, gammas, intent, place and length of the profile.
    let file = |kind: &[u8; 4], primaries: [f64; 9], gamma: f64, length: usize| {
        let fixed = |value: f64, bits: i32| ((value * 2_f64.powi(bits)) as u32).to_le_bytes();
        let mut file = plain[..14 + header.min(40)].to_vec();
        file.resize(14 + 56, 0);
        file.extend(kind);
        file.extend(primaries.map(|value| fixed(value, 30)).concat());
        file.extend([fixed(gamma, 16); 3].concat());
        for number in [4, 124 + samples.len(), length, 0] {
            file.extend((number as u32).to_le_bytes());
        }
        file[10..14].copy_from_slice(&(14 + 124_u32).to_le_bytes());
        file[14..18].copy_from_slice(&124_u32.to_le_bytes());
        [file, samples.to_vec(), profile.clone()].concat()
    };
    let srgb = [0.64, 0.33, 0.03, 0.3, 0.6, 0.1, 0.15, 0.06, 0.79];
    let adobe = [0.64, 0.33, 0.03, 0.21, 0.71, 0.08, 0.15, 0.06, 0.79];
    for (file, is_kept, expected) in [
        (file(b"DEBM", [0.0; 9], 0.0, profile.len()), true, ""),
        (file(b"DEBM", [0.0; 9], 0.0, profile.len() + 1), false, "its ICC profile is damaged"),
        (file(b"KNIL", [0.0; 9], 0.0, 9), false, "its ICC profile is in another file"),
        (file(b" niW", adobe, 1.0, 0), false, ""),
        (file(b"BGRs", [0.0; 9], 0.0, 0), false, ""),
        (file(&[0; 4], [0.0; 9], 0.0, 0), false, ""),
        (file(&[0; 4], srgb, 2.2, 0), false, ""),
        (file(&[0; 4], adobe, 2.2, 0), false, "its primaries and gammas cannot be kept"),
        (file(&[0; 4], srgb, 1.0, 0), false, "its primaries and gammas cannot be kept"),
    ] {
        let (profile, printed) = carried(&room, "a.bmp", &file);
        assert_eq!(profile.is_some(), is_kept, "{printed}");
        assert!(
            printed.contains(expected) && printed.is_empty() == expected.is_empty(),
            "{printed}"
        );
    }
}
