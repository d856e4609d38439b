//! Pictures that are stored turned: what the tool takes and writes is upright.

use exif::experimental::Writer;
use exif::{Field, In, Tag, Value};
use image::metadata::Orientation;
use image::{ColorType, DynamicImage, GenericImageView, ImageDecoder, ImageEncoder, ImageReader};
use image_gip::{Encoder, GipEncoder, Metadata, Target};

use super::room::Room;
use super::{jpeg, pictures};

/// As it is stored.
const SIZE: (u32, u32) = (30, 20);

/// Exif with nothing but an orientation.
fn exif(orientation: u16, little_endian: bool) -> Vec<u8> {
    let value = Value::Short(vec![orientation]);
    let field = Field { tag: Tag::Orientation, ifd_num: In::PRIMARY, value };
    let (mut writer, mut out) = (Writer::new(), std::io::Cursor::new(Vec::new()));
    writer.push_field(&field);
    writer.write(&mut out, little_endian).expect("in memory");
    out.into_inner()
}

fn xmp(orientation: u16) -> String {
    format!(
        "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\"><rdf:RDF \
         xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\"><rdf:Description \
         xmlns:tiff=\"http://ns.adobe.com/tiff/1.0/\" tiff:Orientation=\"{orientation}\"/></rdf:RDF>\
         </x:xmpmeta>"
    )
}

/// The shared picture as a .gip with these metadata.
fn gip(exif: Option<Vec<u8>>, xmp: Option<String>) -> Vec<u8> {
    let mut metadata = Metadata::default();
    (metadata.exif, metadata.xmp) = (exif, xmp.map(String::into_bytes));
    let encoder = Encoder::new().with_target(Target::Gaussians(20)).with_effort(1);
    let mut file = Vec::new();
    let encoder = GipEncoder::with_encoder(&mut file, encoder.with_metadata(metadata));
    pictures::picture(SIZE, ColorType::Rgb8).write_with_encoder(encoder).expect("in memory");
    file
}

impl Room {
    fn open(&self, name: &str) -> DynamicImage {
        ImageReader::open(self.path(name)).expect("it was written").decode().expect("a picture")
    }
}

#[test]
fn sizes_and_regions_are_those_of_the_upright_picture() {
    let room = Room::new();
    room.write("stored.gip", gip(None, None));
    room.ok(&["decode", "stored.gip", "stored.png"]);
    room.ok(&["decode", "stored.gip", "double.png", "--scale", "2"]);
    let (stored, double) = (room.open("stored.png"), room.open("double.png"));
    for value in 1..=8 {
        let orientation = Orientation::from_exif(value).expect("one of eight");
        let turned = |picture: &DynamicImage| {
            let mut picture = picture.clone();
            picture.apply_orientation(orientation);
            picture
        };
        let (whole, double) = (turned(&stored), turned(&double));
        let file = gip(Some(exif(value.into(), value % 2 == 0)), Some(xmp(value.into())));
        room.write("a.gip", &file);
        let decode = |options: &[&str]| {
            room.ok(&[&["decode", "a.gip", "a.png"], options].concat());
            room.open("a.png")
        };
        assert_eq!(decode(&[]), whole, "{value}");
        assert_eq!(decode(&["--scale", "2"]), double, "{value}");
        let (width, height) = double.dimensions();
        let size = format!("{width}x{height}");
        assert_eq!(decode(&["--size", &size]), double, "{value}");
        assert_eq!(decode(&["--size", "7x11"]).dimensions(), (7, 11), "{value}");
        let part = |picture: &DynamicImage| picture.crop_imm(3, 5, 12, 9);
        assert_eq!(decode(&["--region", "3,5,12,9"]), part(&whole), "{value}");
        assert_eq!(decode(&["--region", "3,5,12,9", "--scale", "2"]), part(&double), "{value}");
        let error = room.fails(&["decode", "a.gip", "b.png", "--region", "15,15,10,10"]);
        let (width, height) = whole.dimensions();
        assert!(error.contains(&format!("{width}x{height}")), "{error}");

        let info = room.json(&["info", "a.gip", "--json"]);
        assert_eq!((&info["width"], &info["height"]), (&30.into(), &20.into()));
        assert_eq!(info["orientation"], value);
        assert_eq!(
            (&info["upright_width"], &info["upright_height"]),
            (&width.into(), &height.into())
        );
        let text = room.ok(&["info", "a.gip"]);
        assert!(text.starts_with("size                30x20, "), "{text}");
        assert_eq!(text.contains(&format!("\nupright             {width}x{height}")), value != 1);

        whole.save(room.path("upright.png")).expect("writable");
        assert_eq!(room.ok(&["compare", "a.gip", "upright.png"]), "identical\n");

        room.batch(0, &["a.gip", "--decode", "--out", "back"]);
        assert_eq!(room.open("back/a.png"), whole, "{value}");
        room.batch(0, &["a.gip", "--thumbnail", "10x200", "--out", "thumbs"]);
        assert_eq!(room.open("thumbs/a.png").width(), 10, "{value}");
        assert_eq!(decode(&["--fit", "10x200"]), room.open("thumbs/a.png"), "{value}");

        room.write("cut.gip", &file[..file.len() - 20]);
        let options = ["--allow-partial", "--region", "3,5,12,9", "--size", "40x41"];
        room.ok(&[&["decode", "cut.gip", "cut.png"], &options[..]].concat());
        assert_eq!(room.open("cut.png").dimensions(), (12, 9), "{value}");
    }
}

#[test]
fn orientations_that_exif_does_not_know_are_none() {
    let room = Room::new();
    let of_type = |little_endian: bool, kind: u16| {
        let mut exif = exif(6, little_endian);
        exif[12..14].copy_from_slice(&if little_endian {
            kind.to_le_bytes()
        } else {
            kind.to_be_bytes()
        });
        exif
    };
    for exif in
        [exif(0, false), exif(9, true), exif(262, true), of_type(false, 4), of_type(true, 1)]
    {
        room.write("a.gip", gip(Some(exif.clone()), Some(xmp(6))));
        assert_eq!(room.json(&["info", "a.gip", "--json"])["orientation"], 1);
        room.ok(&["decode", "a.gip", "a.png", "--metadata", "all"]);
        assert_eq!(room.open("a.png").dimensions(), SIZE);
        // What is not applied is not changed.
        let reader = ImageReader::open(room.path("a.png")).expect("it was written");
        let written = reader.into_decoder().expect("a picture").exif_metadata();
        assert_eq!(written.expect("a picture"), Some(exif));
    }
}

#[test]
fn what_is_turned_is_reset_in_exif_and_xmp() {
    let room = Room::new();
    let picture = pictures::picture(SIZE, ColorType::Rgb8);
    let jpeg = |exif: Option<Vec<u8>>| {
        let mut jpeg = Vec::new();
        let mut encoder = image::codecs::jpeg::JpegEncoder::new(&mut jpeg);
        if let Some(exif) = exif {
            encoder.set_exif_metadata(exif).expect("JPEG has Exif");
        }
        picture.write_with_encoder(encoder).expect("in memory");
        jpeg::with_xmp(&jpeg, &xmp(6))
    };
    let xmp_of = |name: &str| {
        let bytes = room.read(name);
        let mut decoder = image_gip::StreamDecoder::new();
        decoder.feed(&bytes).expect("a sound file");
        let xmp = decoder.metadata().xmp.clone().expect("it is kept");
        (String::from_utf8(xmp).expect("UTF-8"), decoder.orientation().expect("known").to_exif())
    };
    let encode = |name: &str| {
        room.ok(&["encode", name, "a.gip", "--gaussians", "20", "--effort", "1"]);
    };
    room.write("both.jpg", jpeg(Some(exif(6, true))));
    encode("both.jpg");
    assert_eq!(room.json(&["info", "a.gip", "--json"])["width"], 20);
    assert_eq!(xmp_of("a.gip"), (xmp(1), 1));

    // That of XMP alone is not applied, as in browsers, and it stays as it is.
    room.write("xmp.jpg", jpeg(None));
    encode("xmp.jpg");
    assert_eq!(room.json(&["info", "a.gip", "--json"])["width"], 30);
    assert_eq!(xmp_of("a.gip"), (xmp(6), 1));

    // Some programs write the prefix of JPEG's Exif into other formats.
    let mut webp = Vec::new();
    let mut encoder = image::codecs::webp::WebPEncoder::new_lossless(&mut webp);
    let prefixed = [b"Exif\0\0", &exif(6, true)[..]].concat();
    encoder.set_exif_metadata(prefixed).expect("WebP has Exif");
    picture.write_with_encoder(encoder).expect("in memory");
    room.write("prefix.webp", webp);
    encode("prefix.webp");
    let info = room.json(&["info", "a.gip", "--json"]);
    assert_eq!((&info["width"], &info["orientation"]), (&20.into(), &1.into()));

    // A .gip that is stored turned is a source as any other.
    room.write("turned.gip", gip(Some(exif(6, false)), Some(xmp(6))));
    encode("turned.gip");
    assert_eq!(room.json(&["info", "a.gip", "--json"])["width"], 20);
    assert_eq!(xmp_of("a.gip"), (xmp(1), 1));
}
