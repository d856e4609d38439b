//! Which metadata, and which times, go from a source to its result.

use std::fs::{self, File, FileTimes};
use std::io::Cursor;
use std::time::{Duration, SystemTime};

use exif::experimental::Writer;
use exif::{Exif, Field, In, Reader, Tag, Value};
use image::codecs::{jpeg::JpegEncoder, png::PngEncoder, tiff::TiffEncoder, webp::WebPEncoder};
use image::{ColorType, ImageDecoder, ImageEncoder, ImageReader};
use image_gip::{Metadata, StreamDecoder};

use super::common::{SIGNATURE, chunk, kind, payload};
use super::room::{Room, by_input, text};
use super::{jpeg, pictures};

const SIZE: (u32, u32) = (40, 30);
/// Stands in everything that must not be passed on.
const SECRET: &str = "SECRET";
const FAST: [&str; 4] = ["--gaussians", "20", "--effort", "1"];

/// As of a camera: 60 kB of maker notes, a position, and an artist.
fn camera_exif() -> Vec<u8> {
    let field = |tag, value| Field { tag, ifd_num: In::PRIMARY, value };
    let fields = [
        field(Tag::Orientation, Value::Short(vec![6])),
        field(Tag::Artist, Value::Ascii(vec![b"Emma".to_vec()])),
        field(Tag::MakerNote, Value::Undefined(SECRET.repeat(10_000).into_bytes(), 0)),
        field(Tag::GPSAreaInformation, Value::Undefined(SECRET.into(), 0)),
    ];
    let (mut writer, mut out) = (Writer::new(), Cursor::new(Vec::new()));
    fields.iter().for_each(|field| writer.push_field(field));
    writer.set_jpeg(SECRET.as_bytes(), In::THUMBNAIL);
    writer.write(&mut out, true).expect("in memory");
    out.into_inner()
}

fn xmp(properties: &str) -> String {
    format!(
        "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\"><rdf:RDF \
         xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\"><rdf:Description rdf:about=\"\" \
         xmlns:dc=\"http://purl.org/dc/elements/1.1/\" \
         xmlns:xmpNote=\"http://ns.adobe.com/xmp/note/\">{properties}</rdf:Description></rdf:RDF>\
         </x:xmpmeta>"
    )
}

/// An ICC profile of RGB that is not sRGB's.
fn profile() -> Vec<u8> {
    let mut profile = vec![7; 200];
    profile[..4].copy_from_slice(&200_u32.to_be_bytes());
    profile[16..20].copy_from_slice(b"RGB ");
    profile
}

fn jpeg(exif: Option<Vec<u8>>) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = JpegEncoder::new(&mut file);
    encoder.set_icc_profile(profile()).expect("JPEG has profiles");
    if let Some(exif) = exif {
        encoder.set_exif_metadata(exif).expect("JPEG has Exif");
    }
    pictures::picture(SIZE, ColorType::Rgb8).write_with_encoder(encoder).expect("in memory");
    file
}

fn has_secret(file: &[u8]) -> bool {
    file.windows(SECRET.len()).any(|bytes| bytes == SECRET.as_bytes())
}

impl Room {
    fn gip_metadata(&self, name: &str) -> Metadata {
        let mut decoder = StreamDecoder::new();
        decoder.feed(&self.read(name)).expect("a sound file");
        decoder.metadata().clone()
    }

    fn exif_of(&self, name: &str) -> Option<Exif> {
        image_gip::register();
        let reader = ImageReader::open(self.path(name)).expect("it was written");
        let mut decoder =
            reader.with_guessed_format().expect("readable").into_decoder().expect("sound");
        let exif = decoder.exif_metadata().expect("sound")?;
        Some(Reader::new().read_raw(exif).expect("sound"))
    }

    /// Runs `gip`, which must succeed, and returns its warnings.
    pub(crate) fn warnings(&self, args: &[&str]) -> String {
        let output = self.run(args);
        assert!(output.status.success(), "{args:?}: {}", text(&output.stderr));
        text(&output.stderr)
    }
}

#[test]
fn thumbnails_have_what_is_safe_and_all_else_has_all_unless_asked_otherwise() {
    let room = Room::new();
    let xmp = xmp(&format!("<dc:title>A lake</dc:title><dc:source>{SECRET}</dc:source>"));
    room.write("a.jpg", jpeg::with_xmp(&jpeg(Some(camera_exif())), &xmp));
    let encode = |policy: &[&str]| {
        room.warnings(&[&["encode", "a.jpg", "a.gip"], &FAST[..], policy].concat())
    };
    let artist = |exif: Option<Exif>| {
        let exif = exif?;
        Some(exif.get_field(Tag::Artist, In::PRIMARY)?.display_value().to_string())
    };
    let emma = || Some("\"Emma\"".to_owned());

    let dropped =
        "warning: a.jpg: the colour profile was dropped, so the colours are taken for sRGB\n";
    assert_eq!(encode(&["--metadata", "none"]), dropped);
    assert_eq!(room.gip_metadata("a.gip"), Metadata::default());
    assert_eq!(encode(&["--metadata", "safe"]), "");
    assert!(!has_secret(&room.read("a.gip")));
    let metadata = room.gip_metadata("a.gip");
    assert_eq!(metadata.icc_profile, Some(profile()));
    assert!(text(&metadata.xmp.expect("some is safe")).contains("<dc:title>A lake</dc:title>"));
    assert_eq!(artist(room.exif_of("a.gip")), emma());
    assert_eq!(encode(&[]), "");
    assert!(has_secret(&room.gip_metadata("a.gip").exif.expect("all of it")));
    assert!(has_secret(&room.gip_metadata("a.gip").xmp.expect("all of it")));

    for format in ["jpg", "png", "webp"] {
        let args = ["batch", "a.gip", "--out", "out", "--format", format];
        let with = |options: &[&str]| room.warnings(&[&args[..], options].concat());
        let name = format!("out/a.{format}");
        assert_eq!(with(&["--thumbnail", "16"]), "");
        assert!(!has_secret(&room.read(&name)) && room.read(&name).len() < 2000, "{format}");
        assert_eq!(artist(room.exif_of(&name)), emma());
        assert_eq!(with(&["--thumbnail", "16", "--metadata", "none"]).lines().count(), 1);
        assert!(room.exif_of(&name).is_none());
        assert!(
            with(&["--thumbnail", "16", "--metadata", "all"]).contains(": the XMP is not written")
        );
        assert!(has_secret(&room.read(&name)));
        assert!(with(&["--decode"]).contains(": the XMP is not written"));
        assert!(has_secret(&room.read(&name)));

        let name = format!("a.{format}");
        let decode =
            |options: &[&str]| room.warnings(&[&["decode", "a.gip", &name], options].concat());
        assert!(decode(&[]).starts_with("warning: a.gip: the XMP is not written"), "{format}");
        assert!(has_secret(&room.read(&name)));
        decode(&["--metadata", "safe"]);
        assert!(!has_secret(&room.read(&name)));
        assert_eq!(artist(room.exif_of(&name)), emma());
    }
    // Formats without metadata; of TIFF, `image` writes the profile alone.
    assert_eq!(room.warnings(&["decode", "a.gip", "a.bmp"]).lines().count(), 3);
    assert_eq!(room.warnings(&["decode", "a.gip", "a.tif"]).lines().count(), 2);
    assert_eq!(
        room.warnings(&["decode", "a.gip", "a.bmp", "--metadata", "none"]),
        dropped.replace("jpg", "gip")
    );
}

/// The file with such metadata as may stand there behind the layers.
fn with_late_metadata(file: &[u8]) -> Vec<u8> {
    let (mut early, mut late) = (SIGNATURE.to_vec(), Vec::new());
    let mut rest = &file[SIGNATURE.len()..];
    while kind(rest) != b"E" {
        let length = chunk(kind(rest), payload(rest)).len();
        let (found, later) = rest.split_at(length);
        rest = later;
        let is_early = [&b"H"[..], b"L", b"iCCP"].contains(&kind(found));
        let place = if is_early { &mut early } else { &mut late };
        place.extend_from_slice(found);
    }
    assert!(!late.is_empty());
    [early, late, rest.to_vec()].concat()
}

#[test]
fn metadata_after_the_layers_is_kept() {
    let room = Room::new();
    let xmp = xmp("<dc:title>A lake</dc:title>");
    room.write("a.jpg", jpeg::with_xmp(&jpeg(Some(camera_exif())), &xmp));
    room.ok(&[&["encode", "a.jpg", "early.gip"], &FAST[..]].concat());
    let metadata = room.gip_metadata("early.gip");
    let kinds = [&metadata.icc_profile, &metadata.exif, &metadata.xmp];
    assert!(kinds.iter().all(|kind| kind.is_some()));
    room.write("late.gip", with_late_metadata(&room.read("early.gip")));
    for file in ["early", "late"] {
        let gip = format!("{file}.gip");
        room.warnings(&["decode", &gip, &format!("{file}.png")]);
        room.ok(&[&["encode", &gip, &format!("{file}.again.gip")], &FAST[..]].concat());
        room.warnings(&["batch", &gip, "--out", "out", "--decode"]);
    }
    assert!(has_secret(&room.read("late.png")));
    assert_eq!(room.read("late.png"), room.read("early.png"));
    assert_eq!(room.read("out/late.png"), room.read("out/early.png"));
    assert_eq!(room.gip_metadata("late.again.gip"), metadata);
    assert_eq!(room.read("late.again.gip"), room.read("early.again.gip"));
}

#[test]
fn exif_that_is_too_long_for_a_jpeg_is_told() {
    let room = Room::new();
    let mut exif = camera_exif();
    exif.resize(70_000, 0);
    let mut png = Vec::new();
    let mut encoder = PngEncoder::new(&mut png);
    encoder.set_exif_metadata(exif.clone()).expect("PNG has Exif");
    pictures::picture(SIZE, ColorType::L8).write_with_encoder(encoder).expect("in memory");
    room.write("a.png", png);
    room.ok(&[&["encode", "a.png", "a.gip"], &FAST[..]].concat());
    assert_eq!(room.gip_metadata("a.gip").exif.map(|exif| exif.len()), Some(70_000));
    assert!(
        room.warnings(&["decode", "a.gip", "a.jpg"]).contains("the Exif is not written to Jpeg")
    );
    assert!(room.exif_of("a.jpg").is_none());
    assert_eq!(room.warnings(&["decode", "a.gip", "b.jpg", "--metadata", "safe"]), "");
    assert!(room.exif_of("b.jpg").is_some());
}

#[test]
fn a_size_that_metadata_alone_exceeds_names_the_way_out() {
    let room = Room::new();
    room.write("a.jpg", jpeg(Some(camera_exif())));
    let args = ["encode", "a.jpg", "a.gip", "--bytes", "5000", "--effort", "1"];
    let output = room.run(&args);
    let error = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{error}");
    assert!(error.starts_with("error: invalid option: a size of 5000 bytes; "), "{error}");
    assert!(error.ends_with(" are metadata; --metadata safe or none leaves room\n"), "{error}");
    room.ok(&[&args[..], &["--metadata", "safe"]].concat());
    assert!(room.read("a.gip").len() <= 5000);

    // What is too small without metadata, too, is as small as can be.
    let report =
        room.json(&["encode", "a.jpg", "b.gip", "--bytes", "20", "--effort", "1", "--json"]);
    let reason = report["shortfall"].as_str().expect("it says why");
    assert!(reason.contains("are metadata"), "{reason}");
    let (_, errors) = room.batch(3, &["a.jpg", "--out", "out", "--bytes", "5000", "--effort", "1"]);
    assert!(errors.contains("--metadata safe"), "{errors}");
}

#[test]
fn what_cannot_be_read_of_damaged_exif_is_told_where_it_is_filtered() {
    let room = Room::new();
    // The end is in the text of the artist, which comes before the maker notes.
    let cut = |length: usize| jpeg(Some(camera_exif()[..length].to_vec()));
    room.write("in/a.jpg", cut(100));
    let encode = |policy: &[&str]| {
        room.json(&[&["encode", "in/a.jpg", "a.gip", "--json"], &FAST[..], policy].concat())
    };
    assert_eq!(encode(&[])["warnings"], serde_json::json!([]));
    assert!(room.gip_metadata("a.gip").exif.is_some());
    let warnings =
        serde_json::json!(["the Exif is damaged, and what could not be read of it was dropped"]);
    assert_eq!(encode(&["--metadata", "safe"])["warnings"], warnings);
    // The pixels are turned already.
    assert_eq!(room.gip_metadata("a.gip").exif, None);

    // Only what is not kept is damaged.
    room.write("b.jpg", cut(30_000));
    let args = ["encode", "b.jpg", "b.gip", "--metadata", "safe"];
    assert_eq!(room.warnings(&[&args[..], &FAST].concat()), "");
    let artist = room.exif_of("b.gip").expect("the artist");
    assert_eq!(artist.fields().map(|field| field.tag).collect::<Vec<_>>(), [Tag::Artist]);
    assert!(!has_secret(&room.read("b.gip")));

    let args = ["in", "--out", "out", "--manifest", "m.jsonl", "--metadata", "safe"];
    let (_, errors) = room.batch(0, &[&args[..], &FAST].concat());
    assert!(errors.contains("warning: in/a.jpg: the Exif is damaged"), "{errors}");
    assert_eq!(by_input(&room.read("m.jsonl"))["in/a.jpg"]["warnings"], warnings);
}

#[test]
fn exif_that_is_none_is_told() {
    let room = Room::new();
    let mut png = Vec::new();
    let mut encoder = PngEncoder::new(&mut png);
    encoder.set_exif_metadata(b"no Exif".to_vec()).expect("PNG has it");
    let samples = pictures::picture(SIZE, ColorType::L8).into_bytes();
    encoder.write_image(&samples, SIZE.0, SIZE.1, ColorType::L8.into()).expect("in memory");
    for (name, file) in [("a.jpg", jpeg(Some(b"no Exif".to_vec()))), ("a.png", png)] {
        room.write(name, file);
        let output = room.run(&[&["encode", name, "a.gip"], &FAST[..]].concat());
        assert!(output.status.success(), "{output:?}");
        let expected = "the Exif is damaged, and what could not be read of it was dropped";
        assert_eq!(text(&output.stderr), format!("warning: {name}: {expected}\n"));
    }
}

#[test]
fn extended_xmp_is_put_together_or_dropped_as_a_whole() {
    const GUID: &str = "0123456789ABCDEF0123456789ABCDEF";
    let room = Room::new();
    let description = format!("<dc:description>{}</dc:description>", "x".repeat(150_000));
    let second = xmp(&description).into_bytes();
    let first = xmp("<dc:title>A lake</dc:title>")
        .replace("rdf:about=\"\"", &format!("rdf:about=\"\" xmpNote:HasExtendedXMP=\"{GUID}\""))
        .replace(" xmlns:dc", " xmlns:xmpNote=\"http://ns.adobe.com/xmp/note/\" xmlns:dc")
        .replace("xmlns:xmpNote=\"http://ns.adobe.com/xmp/note/\">", ">");
    let segment = |guid: &str, length: usize, place: usize, data: &[u8]| {
        let mut segment = b"http://ns.adobe.com/xmp/extension/\0".to_vec();
        segment.extend(guid.as_bytes());
        segment.extend([length, place].map(|n| (n as u32).to_be_bytes()).concat());
        segment.extend(data);
        segment
    };
    let length = second.len();
    let parts: Vec<_> = second
        .chunks(60_000)
        .enumerate()
        .map(|(index, data)| segment(GUID, length, index * 60_000, data))
        .collect();
    let encode = |segments: &[Vec<u8>]| {
        let segments = [&[jpeg::xmp_segment(&first)], segments].concat();
        room.write("a.jpg", jpeg::with_segments(&jpeg(None), &segments));
        let warnings = room.warnings(&[&["encode", "a.jpg", "a.gip"], &FAST[..]].concat());
        (text(&room.gip_metadata("a.gip").xmp.expect("at least the first part")), warnings)
    };
    let (zero, one, two) = (parts[0].clone(), parts[1].clone(), parts[2].clone());
    let other = segment(&"F".repeat(32), length, 0, b"x");
    for segments in [
        vec![zero.clone(), one.clone(), two.clone()],
        vec![two.clone(), other, zero.clone(), one.clone()],
    ] {
        let (xmp, warnings) = encode(&segments);
        assert_eq!(warnings, "");
        assert!(xmp.contains(&description) && xmp.contains("<dc:title>A lake</dc:title>"));
        assert!(!xmp.contains(GUID));
    }
    let data = &second[60_000..120_000];
    for segments in [
        vec![],
        vec![zero.clone(), one.clone()],
        vec![zero.clone(), two.clone()],
        vec![zero.clone(), one.clone(), one.clone(), two.clone()],
        vec![zero.clone(), segment(GUID, length - 1, 60_000, data), two.clone()],
        vec![zero.clone(), segment(GUID, length, 59_999, data), two.clone()],
        vec![zero.clone(), segment(GUID, length, u32::MAX as usize, data), two.clone()],
        vec![zero.clone(), one.clone(), two[..two.len() - 1].to_vec()],
        vec![segment(GUID, u32::MAX as usize, 0, data)],
    ] {
        let (xmp, warnings) = encode(&segments);
        assert!(
            warnings.contains("the second part of the XMP is missing or damaged"),
            "{warnings}"
        );
        assert!(xmp.contains("<dc:title>A lake</dc:title>") && !xmp.contains(GUID), "{xmp}");
        assert!(!xmp.contains("xxxx"));
    }
}

#[test]
fn a_profile_that_is_not_as_long_as_it_says_is_dropped_with_a_warning() {
    fn with(profile: &[u8], encoder: impl FnOnce(&mut Vec<u8>, Vec<u8>)) -> Vec<u8> {
        let mut file = Vec::new();
        encoder(&mut file, profile.to_vec());
        file
    }
    fn save(mut encoder: impl ImageEncoder, profile: Vec<u8>) {
        encoder.set_icc_profile(profile).expect("the format has profiles");
        pictures::picture(SIZE, ColorType::Rgb8).write_with_encoder(encoder).expect("in memory");
    }
    let room = Room::new();
    let whole = profile();
    let longer = [&whole[..], &[0]].concat();
    for (profile, is_kept) in [(&whole[..], true), (&whole[..199], false), (&longer, false)] {
        for (name, file) in [
            ("a.jpg", with(profile, |file, profile| save(JpegEncoder::new(file), profile))),
            ("a.png", with(profile, |file, profile| save(PngEncoder::new(file), profile))),
            (
                "a.webp",
                with(profile, |file, profile| save(WebPEncoder::new_lossless(file), profile)),
            ),
            (
                "a.tif",
                with(profile, |file, profile| save(TiffEncoder::new(Cursor::new(file)), profile)),
            ),
        ] {
            room.write(name, file);
            let warnings = room.warnings(&[&["encode", name, "a.gip"], &FAST[..]].concat());
            let expected =
                format!("warning: {name}: its ICC profile is damaged and cannot be kept\n");
            assert_eq!(warnings, if is_kept { "" } else { &expected });
            assert_eq!(room.gip_metadata("a.gip").icc_profile.is_some(), is_kept, "{name}");
        }
    }
}

#[test]
fn descriptive_tags_of_tiff_become_exif() {
    let room = Room::new();
    let file = File::create(room.path("a.tif")).expect("writable");
    let mut tiff = tiff::encoder::TiffEncoder::new(file).expect("writable");
    let mut image = tiff.new_image::<tiff::encoder::colortype::Gray8>(2, 3).expect("writable");
    let tags = image.encoder();
    tags.write_tag(tiff::tags::Tag::Copyright, "Emma").expect("writable");
    tags.write_tag(tiff::tags::Tag::DateTime, "2020:01:02 03:04:05").expect("writable");
    tags.write_tag(tiff::tags::Tag::Orientation, 6_u16).expect("writable");
    image.write_data(&[0, 50, 100, 150, 200, 250]).expect("writable");
    room.ok(&[&["encode", "a.tif", "a.gip"], &FAST[..]].concat());
    assert_eq!(room.json(&["info", "a.gip", "--json"])["width"], 3);
    let exif = room.exif_of("a.gip").expect("it has tags");
    let mut tags: Vec<_> = exif.fields().map(|field| field.tag).collect();
    tags.retain(|tag| ![Tag::XResolution, Tag::YResolution, Tag::ResolutionUnit].contains(tag));
    assert_eq!(tags, [Tag::DateTime, Tag::Copyright]);
}

#[test]
fn times_are_those_of_the_source_if_asked_for() {
    let room = Room::new();
    pictures::picture(SIZE, ColorType::L8).save(room.path("a.png")).expect("writable");
    let (old, older) = (Duration::from_millis(1_000_000_000_123), Duration::from_secs(900_000_000));
    let [changed, read] = [old, older].map(|age| SystemTime::UNIX_EPOCH + age);
    let set_times = |name: &str, changed: SystemTime| {
        let times = FileTimes::new().set_modified(changed).set_accessed(read);
        let file = File::options().write(true).open(room.path(name)).expect("it exists");
        file.set_times(times).expect("the file system has times");
    };
    let times = |name: &str| {
        let metadata = fs::metadata(room.path(name)).expect("it exists");
        (metadata.modified().expect("known"), metadata.accessed().expect("known"))
    };
    set_times("a.png", changed);
    let encode = [&["encode", "a.png", "a.gip"], &FAST[..]].concat();
    room.ok(&encode);
    assert!(times("a.gip").0 > changed);
    set_times("a.png", changed);
    room.ok(&[&encode[..], &["--preserve-times"]].concat());
    assert_eq!(times("a.gip"), (changed, read));
    room.ok(&["decode", "a.gip", "b.png", "--preserve-times"]);
    assert_eq!(times("b.png"), (changed, read));

    for args in [["encode", "-", "c.gip"], ["encode", "a.png", "-"], ["decode", "a.gip", "-"]] {
        let output = room.run(&[&args[..], &["--preserve-times"]].concat());
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", text(&output.stderr));
    }

    // Results as old as their sources are not made again.
    set_times("a.png", changed);
    let batch = |options: &[&str]| {
        let args = [&["a.png", "--out", "out", "--resume"], &FAST[..], options].concat();
        room.batch(0, &args).0.contains(" 1 skipped")
    };
    assert!(!batch(&["--preserve-times"]));
    assert_eq!(times("out/a.gip").0, changed);
    assert!(batch(&["--preserve-times"]));
    // Other file systems count in whole seconds.
    set_times("out/a.gip", changed - Duration::from_millis(123));
    assert!(batch(&["--preserve-times"]));
    set_times("out/a.gip", changed - Duration::from_millis(124));
    assert!(!batch(&["--preserve-times"]));
    set_times("a.png", changed + Duration::from_millis(1));
    assert!(!batch(&["--preserve-times"]));
    assert!(batch(&["--preserve-times"]));
    assert!(!batch(&[]), "without the option, equal times tell nothing");
    assert!(batch(&["--preserve-times"]), "a result that is newer is as good");
}
