//! What of a picture's metadata is kept, and its orientation.

use std::io::Cursor;

use exif::experimental::Writer;
use exif::{Context, Field, In, Rational, Tag, Value};
use image_gip::{Cicp, Metadata, MetadataLoss, MetadataPolicy, Orientation, Text};

/// Stands in everything that must not be passed on.
const SECRET: &str = "SECRET";

fn field(tag: Tag, value: Value) -> Field {
    Field { tag, ifd_num: In::PRIMARY, value }
}

fn ascii(tag: Tag, text: &str) -> Field {
    field(tag, Value::Ascii(vec![text.into()]))
}

fn short(tag: Tag, number: u16) -> Field {
    field(tag, Value::Short(vec![number]))
}

fn write(fields: &[Field], thumbnail: Option<&[u8]>, little_endian: bool) -> Vec<u8> {
    let (mut writer, mut out) = (Writer::new(), Cursor::new(Vec::new()));
    fields.iter().for_each(|field| writer.push_field(field));
    if let Some(jpeg) = thumbnail {
        writer.set_jpeg(jpeg, In::THUMBNAIL);
    }
    writer.write(&mut out, little_endian).expect("small");
    out.into_inner()
}

/// What the policy keeps.
fn safe() -> Vec<Field> {
    let rational = |num, denom| Value::Rational(vec![Rational { num, denom }]);
    vec![
        short(Tag::Orientation, 6),
        field(Tag::XResolution, rational(300, 1)),
        short(Tag::ResolutionUnit, 2),
        short(Tag::ColorSpace, 65535),
        field(Tag::Gamma, rational(22, 10)),
        ascii(Tag::InteroperabilityIndex, "R03"),
        field(Tag::ExifVersion, Value::Undefined(b"0232".to_vec(), 0)),
        ascii(Tag::ImageDescription, "A lake"),
        ascii(Tag::Artist, "Emma"),
        field(Tag::Copyright, Value::Ascii(vec![b"Emma".to_vec(), b"An editor".to_vec()])),
        ascii(Tag::DateTime, "2020:01:02 03:04:05"),
        ascii(Tag::DateTimeOriginal, "2020:01:02 03:04:05"),
        ascii(Tag::OffsetTimeOriginal, "+01:00"),
        ascii(Tag::SubSecTimeOriginal, "123"),
    ]
}

/// What it drops.
fn unsafe_fields() -> Vec<Field> {
    let secret = || Value::Undefined(SECRET.repeat(9).into_bytes(), 0);
    vec![
        ascii(Tag::Make, SECRET),
        ascii(Tag::Model, SECRET),
        ascii(Tag::Software, SECRET),
        field(Tag::MakerNote, secret()),
        field(Tag::UserComment, secret()),
        ascii(Tag::CameraOwnerName, SECRET),
        ascii(Tag::BodySerialNumber, SECRET),
        ascii(Tag::LensSerialNumber, SECRET),
        ascii(Tag::ImageUniqueID, SECRET),
        ascii(Tag::GPSLatitudeRef, "N"),
        ascii(Tag::GPSDateStamp, SECRET),
        ascii(Tag(Context::Tiff, 0xEA1C), SECRET),
        ascii(Tag(Context::Exif, 0xFDE8), SECRET),
        // Of the right name, but not what the name says.
        ascii(Tag::DateTimeDigitized, SECRET),
        ascii(Tag::OffsetTime, "+SEC:RET"),
        field(Tag(Context::Interop, 2), Value::Undefined(b"SECR".to_vec(), 0)),
        field(Tag::SubSecTime, secret()),
        field(Tag::YResolution, Value::Short(vec![0; 99])),
        ascii(Tag::WhitePoint, SECRET),
    ]
}

fn of_exif(exif: Vec<u8>) -> Metadata {
    let mut metadata = Metadata::default();
    metadata.exif = Some(exif);
    metadata
}

fn of_xmp(xmp: &str) -> Metadata {
    let mut metadata = Metadata::default();
    metadata.xmp = Some(xmp.into());
    metadata
}

/// A packet with these properties, as attributes and as elements.
fn packet(attributes: &str, elements: &str) -> String {
    format!(
        "<?xpacket begin=\"\u{feff}\" id=\"W5M0MpCehiHzreSzNTczkc9d\"?>\n\
         <x:xmpmeta xmlns:x=\"adobe:ns:meta/\"><rdf:RDF \
         xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\"><rdf:Description rdf:about=\"\" \
         xmlns:dc=\"http://purl.org/dc/elements/1.1/\" xmlns:xmp=\"http://ns.adobe.com/xap/1.0/\" \
         xmlns:t=\"http://ns.adobe.com/tiff/1.0/\" xmlns:exif=\"http://ns.adobe.com/exif/1.0/\" \
         xmlns:xmpMM=\"http://ns.adobe.com/xap/1.0/mm/\" \
         xmlns:xmpRights=\"http://ns.adobe.com/xap/1.0/rights/\" \
         xmlns:crs=\"http://ns.adobe.com/camera-raw-settings/1.0/\" {attributes}>{elements}\
         </rdf:Description></rdf:RDF></x:xmpmeta>\n{}<?xpacket end=\"w\"?>",
        " ".repeat(200)
    )
}

#[test]
fn safe_exif_has_what_serves_viewer_and_author_and_nothing_else() {
    for little_endian in [false, true] {
        let thumbnail = SECRET.as_bytes();
        let all = write(&[safe(), unsafe_fields()].concat(), Some(thumbnail), little_endian);
        let mut metadata = of_exif(all);
        assert!(metadata.retain(MetadataPolicy::Safe).is_empty());
        let exif = metadata.exif.expect("some is safe");
        // Tags are in the order of their numbers, and nothing is between them.
        assert_eq!(exif, write(&safe(), None, little_endian));
    }
    let mut metadata = of_exif(write(&unsafe_fields(), None, true));
    assert!(metadata.retain(MetadataPolicy::Safe).is_empty());
    assert_eq!(metadata, Metadata::default());
}

#[test]
fn all_keeps_all_and_none_keeps_nothing() {
    let mut metadata = of_exif(write(&unsafe_fields(), Some(b"thumbnail"), false));
    metadata.xmp = Some(packet("", "").into());
    metadata.texts.push(Text::new("Comment", SECRET));
    let before = metadata.clone();
    assert!(metadata.retain(MetadataPolicy::All).is_empty());
    assert_eq!(metadata, before);
    assert!(metadata.retain(MetadataPolicy::None).is_empty());
    assert_eq!(metadata, Metadata::default());
    assert_eq!(MetadataPolicy::default(), MetadataPolicy::All);
}

#[test]
fn an_orientation_is_missed_unless_the_picture_is_upright() {
    for code in 0..=9 {
        let exif = write(&[short(Tag::Orientation, code)], None, code % 2 == 0);
        for policy in [MetadataPolicy::All, MetadataPolicy::Safe] {
            assert!(of_exif(exif.clone()).retain(policy).is_empty(), "{code}");
        }
        let lost = of_exif(exif.clone()).retain(MetadataPolicy::None);
        let expected: &[_] =
            if (2..=8).contains(&code) { &[MetadataLoss::Orientation] } else { &[] };
        assert_eq!(lost, expected, "{code}");
        let mut turned = of_exif(exif);
        turned.reset_orientation();
        assert!(turned.retain(MetadataPolicy::None).is_empty(), "{code}");
    }
}

/// Exif in big-endian order with the entries of two directories, the second of which the first refers to:
/// tag, type, number of values, and the value or its offset. The values come after them, at an offset of
/// 200. Neither directory ends with the offset of another one.
fn exif_of_entries(
    tiff: &[(Tag, u16, u32, u32)],
    exif: &[(Tag, u16, u32, u32)],
    values: &[u8],
) -> Vec<u8> {
    let mut bytes = b"MM\0*\0\0\0\x08".to_vec();
    let second = 8 + 2 + 12 * (tiff.len() as u32 + 1);
    let pointer = (Tag::ExifIFDPointer, 4, 1, second);
    for directory in [&[tiff, &[pointer]].concat()[..], exif] {
        bytes.extend((directory.len() as u16).to_be_bytes());
        for &(tag, kind, count, value) in directory {
            bytes.extend([tag.number().to_be_bytes(), kind.to_be_bytes()].concat());
            bytes.extend([count.to_be_bytes(), value.to_be_bytes()].concat());
        }
    }
    assert!(bytes.len() <= 200);
    bytes.resize(200, 0xA5);
    bytes.extend(values);
    bytes
}

#[test]
fn what_can_be_read_of_damaged_exif_is_kept() {
    let whole = write(&[safe(), unsafe_fields()].concat(), None, true);
    let mut metadata = of_exif(whole[..whole.len() - 1].to_vec());
    assert!(
        metadata.retain(MetadataPolicy::Safe).is_empty(),
        "the last value is none that is kept"
    );
    assert_eq!(metadata.exif, Some(write(&safe(), None, true)));

    // One of the texts is beyond the end.
    let tiff = [(Tag::Artist, 2, 5, 200), (Tag::Copyright, 2, 50, 200)];
    let exif = [(Tag::DateTimeOriginal, 2, 20, 206)];
    let bytes = exif_of_entries(&tiff, &exif, b"Emma\0\x002020:01:02 03:04:05\0");
    let expected =
        [ascii(Tag::Artist, "Emma"), ascii(Tag::DateTimeOriginal, "2020:01:02 03:04:05")];
    let mut metadata = of_exif(bytes.clone());
    assert_eq!(metadata.retain(MetadataPolicy::Safe), [MetadataLoss::DamagedExif]);
    assert_eq!(metadata.exif, Some(write(&expected, None, false)));

    // A directory is beyond the end, or ends there.
    for cut in [44, 50] {
        let mut metadata = of_exif(bytes[..cut].to_vec());
        assert_eq!(metadata.retain(MetadataPolicy::Safe), [MetadataLoss::DamagedExif]);
        assert_eq!(metadata.exif, None);
    }

    let mut metadata = of_exif(SECRET.into());
    assert_eq!(metadata.retain(MetadataPolicy::Safe), [MetadataLoss::DamagedExif]);
    assert_eq!(metadata.exif, None);
}

#[test]
fn directories_need_not_end_with_the_offset_of_another_one() {
    let tiff = [(Tag::Artist, 2, 5, 200)];
    let exif = [(Tag::SubSecTimeOriginal, 2, 3, u32::from_be_bytes(*b"12\0\0"))];
    let mut metadata = of_exif(exif_of_entries(&tiff, &exif, b"Emma\0"));
    assert!(metadata.retain(MetadataPolicy::Safe).is_empty());
    let expected = [ascii(Tag::Artist, "Emma"), ascii(Tag::SubSecTimeOriginal, "12")];
    assert_eq!(metadata.exif, Some(write(&expected, None, false)));
}

#[test]
fn safe_texts_of_exif_end_where_they_are_seen_to_end() {
    let text = |tag: Tag, texts: &[&str]| {
        let texts = texts.iter().map(|text| text.as_bytes().to_vec());
        field(tag, Value::Ascii(texts.collect()))
    };
    let bytes = write(
        &[
            text(Tag::Artist, &["Emma", SECRET]),
            text(Tag::ImageDescription, &["", SECRET]),
            text(Tag::Copyright, &[" ", "An editor", SECRET]),
            text(Tag::DateTime, &["2020:01:02 03:04:05", SECRET]),
            text(Tag::DateTimeOriginal, &["    :  :     :  :  "]),
            text(Tag::DateTimeDigitized, &["2020-01-02 03:04:05"]),
            text(Tag::SubSecTime, &["1234567890"]),
            text(Tag::SubSecTimeOriginal, &["12 "]),
        ],
        None,
        true,
    );
    let mut metadata = of_exif(bytes);
    assert!(metadata.retain(MetadataPolicy::Safe).is_empty());
    let expected = [
        text(Tag::Artist, &["Emma"]),
        text(Tag::Copyright, &[" ", "An editor"]),
        text(Tag::DateTime, &["2020:01:02 03:04:05"]),
        text(Tag::DateTimeOriginal, &["    :  :     :  :  "]),
        text(Tag::SubSecTimeOriginal, &["12 "]),
    ];
    assert_eq!(metadata.exif, Some(write(&expected, None, true)));
}

#[test]
fn types_of_exif_that_are_newer_or_unknown() {
    // 129 is UTF-8.
    let tiff = [
        (Tag::Artist, 129, 6, 200),
        (Tag::Copyright, 130, 9, 200),
        (Tag::XResolution, 0xFFFF, u32::MAX, 200),
        (Tag::ImageDescription, 0, 1, 200),
    ];
    let mut metadata = of_exif(exif_of_entries(&tiff, &[], "Zo\u{eb}\0\0SECRET".as_bytes()));
    assert!(metadata.retain(MetadataPolicy::Safe).is_empty());
    assert_eq!(metadata.exif, Some(write(&[ascii(Tag::Artist, "Zo\u{eb}")], None, false)));
}

#[test]
fn directories_that_share_their_bytes_take_no_more_memory() {
    // Each entry refers to a directory of all entries that follow.
    const ENTRIES: u16 = 5_400;
    let mut bytes = b"MM\0*\0\0\0\x08".to_vec();
    bytes.extend(ENTRIES.to_be_bytes());
    for number in 0..u32::from(ENTRIES) {
        bytes.extend([0x8769_0004, 1, 8 + 12 * (number + 1)].map(u32::to_be_bytes).concat());
    }
    let mut metadata = of_exif(bytes.clone());
    metadata.retain(MetadataPolicy::Safe);
    assert_eq!(metadata.exif, None);
    metadata.set_exif_of_tiff(&bytes);
    assert_eq!(metadata.exif, None);
}

#[test]
fn an_orientation_that_is_said_twice_remains_the_first() {
    let exif = write(&[short(Tag::Orientation, 6), short(Tag::Orientation, 3)], None, false);
    let mut metadata = of_exif(exif);
    assert_eq!(metadata.orientation(), Orientation::Rotate90);
    assert!(metadata.retain(MetadataPolicy::Safe).is_empty());
    assert_eq!(metadata, of_exif(write(&safe()[..1], None, false)));
}

#[test]
fn hostile_exif_ends_in_time_and_tells_no_secret() {
    let exif = |metadata: &Metadata| metadata.exif.clone().unwrap_or_default();
    let check = |bytes: Vec<u8>| {
        let mut metadata = of_exif(bytes);
        metadata.retain(MetadataPolicy::Safe);
        let orientation = metadata.orientation();
        metadata.reset_orientation();
        assert_eq!(metadata.orientation(), Orientation::NoTransforms, "it was {orientation:?}");
        let length = SECRET.len();
        assert!(!exif(&metadata).windows(length).any(|bytes| bytes == SECRET.as_bytes()));
    };
    for little_endian in [false, true] {
        let whole = write(&[safe(), unsafe_fields()].concat(), None, little_endian);
        for length in 0..whole.len() {
            check(whole[..length].to_vec());
        }
        // Counts, offsets and types that are too large, and directories that are their own successors.
        for place in 0..whole.len() {
            for value in [0, 4, 8, 0xFF] {
                let mut bytes = whole.clone();
                bytes[place] = value;
                // A tag may have become another one, whose text may be seen.
                let secret = |bytes: &mut [u8]| bytes.copy_from_slice(b"public");
                while let Some(at) = bytes.windows(6).position(|b| b == SECRET.as_bytes()) {
                    secret(&mut bytes[at..at + 6]);
                }
                check(bytes);
            }
        }
    }
    // Tags that share the same megabyte.
    let mut bytes = b"II\x2a\0\x08\0\0\0\xFF\xFF".to_vec();
    for _ in 0..u16::MAX {
        bytes.extend(b"\x98\x82\x02\0\0\0\x10\0\x08\0\0\0");
    }
    bytes.resize(0x10_0008, 0);
    check(bytes);
}

#[test]
fn the_orientation_is_that_of_exif() {
    let entry = |little_endian: bool, kind: u16, count: u32, value: u16| {
        let u16s = |n: u16| if little_endian { n.to_le_bytes() } else { n.to_be_bytes() };
        let u32s = |n: u32| if little_endian { n.to_le_bytes() } else { n.to_be_bytes() };
        let mut bytes = if little_endian { b"II".to_vec() } else { b"MM".to_vec() };
        bytes.extend([u16s(42), [0; 2], [0; 2], u16s(1), u16s(0x112), u16s(kind)].concat());
        bytes[4..8].copy_from_slice(&u32s(8));
        bytes.extend(u32s(count));
        bytes.extend([u16s(value), [0; 2], [0; 2], [0; 2]].concat());
        of_exif(bytes)
    };
    for little_endian in [false, true] {
        for value in 0..=300 {
            let mut metadata = entry(little_endian, 3, 1, value);
            let expected = u8::try_from(value).ok().and_then(Orientation::from_exif);
            assert_eq!(metadata.orientation(), expected.unwrap_or_default(), "{value}");
            metadata.reset_orientation();
            assert_eq!(metadata, entry(little_endian, 3, 1, 1), "{value}");
        }
        for (kind, count) in [(1, 1), (4, 1), (3, 2), (3, 0)] {
            let mut metadata = entry(little_endian, kind, count, 6);
            assert_eq!(
                metadata.orientation(),
                Orientation::NoTransforms,
                "type {kind}, count {count}"
            );
            let before = metadata.clone();
            metadata.reset_orientation();
            assert_eq!(metadata, before);
        }
    }
}

#[test]
fn safe_xmp_has_what_serves_viewer_and_author_and_nothing_else() {
    let secrets = format!(
        "exif:GPSLatitude=\"{SECRET}\" xmpMM:DocumentID=\"{SECRET}\" crs:Exposure=\"{SECRET}\" \
         xmp:CreatorTool=\"{SECRET}\" rdf:ID=\"{SECRET}\" "
    );
    let nested = format!(
        "<!-- {SECRET} --><xmpMM:History><rdf:Seq><rdf:li rdf:parseType=\"Resource\">\
         <dc:title>{SECRET}</dc:title></rdf:li></rdf:Seq></xmpMM:History>\
         <xmp:MetadataDate rdf:parseType=\"Resource\"><rdf:value>{SECRET}</rdf:value>\
         </xmp:MetadataDate><dc:subject><rdf:Bag><rdf:li>{SECRET}</rdf:li></rdf:Bag></dc:subject>"
    );
    let attributes = format!("{secrets} xmp:CreateDate='2020-01-02' t:Orientation=\"6\"");
    let elements = format!(
        "{nested}<dc:rights><rdf:Alt><rdf:li xml:lang=\"x-default\">Emma &amp; &lt;Co&gt;</rdf:li>\
         <rdf:li xml:lang=\"de\" t:Make=\"{SECRET}\"><![CDATA[Emma & <Co>]]></rdf:li></rdf:Alt>\
         </dc:rights><dc:creator><rdf:Seq><rdf:li>Emma</rdf:li></rdf:Seq></dc:creator>\
         <dc:title xml:lang=\"{SECRET}\">A &#x41;</dc:title>\
         <xmpRights:WebStatement rdf:resource=\"https://example.org/\"/>"
    );
    let mut metadata = of_xmp(&packet(&attributes, &elements));
    assert!(metadata.retain(MetadataPolicy::Safe).is_empty());
    let xmp = String::from_utf8(metadata.xmp.clone().expect("some is safe")).expect("UTF-8");
    assert!(!xmp.contains(SECRET), "{xmp}");
    for expected in [
        "<dc:title>A A</dc:title>",
        "<dc:creator><rdf:Seq><rdf:li>Emma</rdf:li></rdf:Seq></dc:creator>",
        "<dc:rights><rdf:Alt><rdf:li xml:lang=\"x-default\">Emma &amp; &lt;Co&gt;</rdf:li>\
         <rdf:li xml:lang=\"de\">Emma &amp; &lt;Co&gt;</rdf:li></rdf:Alt></dc:rights>",
        "<xmp:CreateDate>2020-01-02</xmp:CreateDate>",
        "<xmpRights:WebStatement>https://example.org/</xmpRights:WebStatement>",
        "<tiff:Orientation>6</tiff:Orientation>",
        "xmlns:tiff=\"http://ns.adobe.com/tiff/1.0/\"",
    ] {
        assert!(xmp.contains(expected), "{expected} is not in {xmp}");
    }
    // It is a packet itself.
    let once = metadata.clone();
    assert!(metadata.retain(MetadataPolicy::Safe).is_empty());
    assert_eq!(metadata, once);

    let mut metadata = of_xmp(&packet(&secrets, &nested));
    assert!(metadata.retain(MetadataPolicy::Safe).is_empty());
    assert_eq!(metadata.xmp, None);
}

#[test]
fn xmp_that_is_damaged_or_hostile_is_dropped() {
    let sound = packet("xmp:CreateDate=\"2020\"", "");
    let many = |count: usize, text: &dyn Fn(usize) -> String| (0..count).map(text).collect();
    let attributes: String = many(100_000, &|n| format!(" xmp:a{n}=\">\""));
    let namespaces: String = many(5_000, &|n| format!("<a xmlns:b{n}=\"c{n}\">"));
    let deep = format!("{}{}", "<a>".repeat(200_000), "</a>".repeat(200_000));
    for (xmp, is_damaged) in [
        (sound.clone(), false),
        (format!("\u{feff}{sound}\0\0"), false),
        (packet("xmp:CreateDate=\"2020\"", &deep), false),
        (packet("xmp:CreateDate=\"2020\"", &"=' ".repeat(100_000)), false),
        (String::new(), true),
        ("no XML".into(), true),
        (sound[..sound.len() / 2].into(), true),
        (packet("xmp:CreateDate=\"2020\" xmp:CreateDate=\"2021\"", ""), true),
        (packet(&attributes, ""), true),
        (packet("", &(namespaces + &"</a>".repeat(5_000))), true),
        (packet("", &format!("<a>{}</a>", "<b/>".repeat(2 << 20))), true),
        (format!("<!DOCTYPE x [<!ENTITY a \"{SECRET}\">]>{}", packet("", "&a;")), true),
    ] {
        let mut metadata = of_xmp(&xmp);
        let expected: &[_] = if is_damaged { &[MetadataLoss::DamagedXmp] } else { &[] };
        assert_eq!(metadata.retain(MetadataPolicy::Safe), expected, "{xmp:.300}");
        assert_eq!(metadata.xmp.is_none(), is_damaged);
    }
    let mut metadata = Metadata::default();
    metadata.xmp = Some(b"<a>\xFF</a>".to_vec());
    assert_eq!(metadata.retain(MetadataPolicy::Safe), [MetadataLoss::DamagedXmp]);
}

#[test]
fn the_orientation_of_xmp_is_reset_in_any_form() {
    for (before, after) in [
        (packet("t:Orientation=\"6\"", ""), packet("t:Orientation=\"1\"", "")),
        (
            packet("t:Orientation = '6' t:Make='6'", ""),
            packet("t:Orientation = '1' t:Make='6'", ""),
        ),
        (
            packet("", "<t:Orientation>6</t:Orientation>"),
            packet("", "<t:Orientation>1</t:Orientation>"),
        ),
        (
            packet("", "<t:Orientation xml:lang='x'> <!-- x --><![CDATA[6]]>\n</t:Orientation>"),
            packet("", "<t:Orientation xml:lang='x'>1</t:Orientation>"),
        ),
        (
            packet(
                "",
                "<o:Orientation xmlns:o=\"http://ns.adobe.com/tiff/1.0/\">8</o:Orientation>",
            ),
            packet(
                "",
                "<o:Orientation xmlns:o=\"http://ns.adobe.com/tiff/1.0/\">1</o:Orientation>",
            ),
        ),
        (
            packet(
                "t:Orientation=\"10\"",
                "<t:Orientation><t:Orientation>3</t:Orientation></t:Orientation>",
            ),
            packet("t:Orientation=\"1\"", "<t:Orientation>1</t:Orientation>"),
        ),
    ] {
        let mut metadata = of_xmp(&before);
        assert_eq!(metadata.orientation(), Orientation::NoTransforms, "of XMP");
        metadata.reset_orientation();
        assert_eq!(metadata, of_xmp(&after));
    }
    for unchanged in [
        packet("exif:Orientation=\"6\" t:Make=\"6\"", "<t:Orientation/>"),
        packet("", "<Orientation>6</Orientation>"),
        "no XML, tiff:Orientation=\"6\"".into(),
    ] {
        let mut metadata = of_xmp(&unchanged);
        metadata.reset_orientation();
        assert_eq!(metadata, of_xmp(&unchanged));
    }
}

#[test]
fn safe_texts_are_those_of_known_keywords() {
    let mut metadata = Metadata::default();
    for keyword in ["Title", "Author", "Comment", "Software", "Copyright", "parameters", "title"] {
        metadata.texts.push(Text::new(keyword, "x"));
    }
    assert!(metadata.retain(MetadataPolicy::Safe).is_empty());
    let keywords: Vec<_> = metadata.texts.iter().map(|text| text.keyword.as_str()).collect();
    assert_eq!(keywords, ["Title", "Author", "Copyright"]);
}

#[test]
fn without_its_profile_a_picture_has_other_colours_unless_it_is_srgb() {
    let profile = |description: &[u8]| {
        let mut profile = vec![0; 128];
        for number in [1, u32::from_be_bytes(*b"desc"), 144, description.len() as u32] {
            profile.extend(number.to_be_bytes());
        }
        profile.extend(description);
        profile
    };
    let lost = |profile: Vec<u8>| {
        let mut metadata = Metadata::default();
        metadata.icc_profile = Some(profile.clone());
        assert!(metadata.retain(MetadataPolicy::Safe).is_empty());
        assert_eq!(metadata.icc_profile, Some(profile));
        metadata.retain(MetadataPolicy::None)
    };
    assert_eq!(lost(profile(b"desc\0\0\0\0\0\0\0\x12sRGB IEC61966-2.1\0")), []);
    assert_eq!(lost(profile(b"mluc\0\0\0\0\0s\0R\0G\0B")), []);
    let mut coded = Metadata::default();
    coded.cicp = Some(Cicp::DISPLAY_P3);
    let kept = coded.clone();
    coded.icc_profile = Some(profile(b"desc\0\0\0\0\0\0\0\x0bDisplay P3\0"));
    assert!(coded.retain(MetadataPolicy::None).is_empty(), "the codes say it all");
    assert_eq!(coded, kept);
    let mut cut = profile(b"desc\0\0\0\0\0\0\0\x12sRGB IEC61966-2.1\0");
    cut.pop();
    for profile in [profile(b"desc\0\0\0\0\0\0\0\x0bDisplay P3\0"), b"sRGB".to_vec(), cut] {
        assert_eq!(lost(profile), [MetadataLoss::ColorProfile]);
    }
}

#[test]
fn xmp_in_two_parts_is_put_together() {
    const NOTE: &str = "xmlns:xmpNote=\"http://ns.adobe.com/xmp/note/\"";
    let second = "<?xpacket begin=\"\"?><x:xmpmeta xmlns:x=\"adobe:ns:meta/\" xmlns:t=\"tools\">\
         <rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\" \
         xmlns:dc=\"http://purl.org/dc/elements/1.1/\"><rdf:Description rdf:about=\"\" \
         xmlns:t = \"mine\"><dc:source>long</dc:source></rdf:Description></rdf:RDF></x:xmpmeta>";
    let whole = packet(&format!("{NOTE} "), "<dc:title>short</dc:title>").replace(
        "</rdf:RDF>",
        "<rdf:Description xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\" \
         xmlns:dc=\"http://purl.org/dc/elements/1.1/\" xmlns:x=\"adobe:ns:meta/\" rdf:about=\"\" \
         xmlns:t = \"mine\"><dc:source>long</dc:source></rdf:Description></rdf:RDF>",
    );
    for (attribute, element) in [
        ("xmpNote:HasExtendedXMP='A1'", ""),
        ("", "<xmpNote:HasExtendedXMP>A1</xmpNote:HasExtendedXMP>"),
    ] {
        let of = |attribute: &str, element: &str| {
            let attributes = format!("{NOTE} {attribute}");
            of_xmp(&packet(&attributes, &format!("<dc:title>short</dc:title>{element}")))
        };
        let mut metadata = of(attribute, element);
        let loss = metadata.join_xmp(|name| (name == "A1").then(|| second.into()));
        assert_eq!(loss, None);
        assert_eq!(metadata, of_xmp(&whole));

        for second in [None, Some(""), Some("no XML"), Some("<a/>"), Some(&second[..200])] {
            let mut metadata = of(attribute, element);
            let loss = metadata.join_xmp(|_| second.map(Into::into));
            assert_eq!(loss, Some(MetadataLoss::XmpExtension));
            assert_eq!(metadata, of("", ""), "the first part remains, without the name");
        }
    }
    let mut metadata = of_xmp(&packet(NOTE, ""));
    let before = metadata.clone();
    assert_eq!(metadata.join_xmp(|_| panic!("there is no second part")), None);
    assert_eq!(metadata, before);
}
