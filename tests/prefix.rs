//! Files of the first layers of others: what is in them, what they keep, and the encoder's option for a first layer of
//! a given size.
//!
//! `BLESS=1 cargo test --test prefix` writes the table `prefixes.tsv` again.

mod common;

use std::fs;
use std::path::Path;

use common::{Entry, File, Header, crc32, decode_valid, entropy, of_chunks};
use image_gip::{
    Cicp, ColorModel, ContentLight, DecodeError, EncodeError, Encoder, Metadata, OptionError,
    Precision, Prefix, Prefixes, RenderOptions, Source, StreamDecoder, Target, Text,
};

const SIDES: [u32; 2] = [256, 192];
const PROFILE: &[u8] = b"a profile";
/// Exif with the orientation 6, and with 1.
const TURNED: &[u8] = b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0";
const UPRIGHT: &[u8] = b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x01\0\0\0\0\0\0\0";

/// Waves and noise, so that there are strong and weak Gaussians, and texture.
fn samples() -> Vec<u8> {
    let mut rng = fastrand::Rng::with_seed(3);
    let [width, height] = SIDES;
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x as f32, y as f32)));
    let pixel = |(x, y): (f32, f32)| {
        let wave = 60.0 * (x / 31.0).sin() * (y / 23.0).cos();
        let noise = if y > 96.0 { 30.0 * (rng.f32() - 0.5) } else { 0.0 };
        (128.0 + wave + noise) as u8
    };
    pixels.map(pixel).collect()
}

fn encode(encoder: Encoder) -> Result<Vec<u8>, EncodeError> {
    let samples = samples();
    let source = Source::new_u8(SIDES[0], SIDES[1], ColorModel::Gray, &samples).expect("a picture");
    let encoder = encoder.with_target(Target::Bytes(6000)).with_effort(1);
    Ok(encoder.encode(&source)?.bytes)
}

fn metadata(exif: &[u8]) -> Metadata {
    let mut metadata = Metadata::default();
    metadata.icc_profile = Some(PROFILE.into());
    metadata.exif = Some(exif.into());
    metadata.xmp = Some(vec![b'x'; 300]);
    metadata.texts.push(Text::new("Title", "Waves"));
    metadata
}

/// Checks a prefix against the file that it is of.
#[track_caller]
fn check(file: &[u8], prefixes: &Prefixes<'_>, prefix: Prefix) -> StreamDecoder {
    let small = prefixes.file(prefix);
    assert_eq!(small.len(), prefix.bytes);
    let small = decode_valid(&small);
    assert_eq!(small.layers().len(), usize::from(prefix.layers));
    assert_eq!(small.gaussians().len(), prefix.gaussians as usize);
    // The beginning of the file has the same Gaussians, and not one byte less.
    let mut whole = StreamDecoder::new();
    whole.feed(&file[..prefix.end]).expect("a valid file");
    assert_eq!(whole.gaussians(), small.gaussians());
    let mut shorter = StreamDecoder::new();
    shorter.feed(&file[..prefix.end - 1]).expect("a valid file");
    assert!(shorter.layers().len() < small.layers().len());
    small
}

#[test]
fn prefixes_are_files_of_the_same_gaussians() {
    for precision in [Precision::Entropy, Precision::Packed, Precision::Float] {
        let file = encode(Encoder::new().with_precision(precision)).expect("valid options");
        let prefixes = Prefixes::new(&file).expect("a valid file");
        let all: Vec<_> = prefixes.iter().collect();
        assert_eq!(all.len(), usize::from(prefixes.layers()));
        let layers = |prefix: &Prefix| prefix.layers;
        assert!(all.iter().map(layers).eq(1..=prefixes.layers()));
        for prefix in &all {
            check(&file, &prefixes, *prefix);
            assert_eq!(prefixes.within(prefix.bytes), Some(*prefix));
            let before = all.get(usize::from(prefix.layers).wrapping_sub(2)).copied();
            assert_eq!(prefixes.within(prefix.bytes - 1), before);
        }
        assert_eq!(prefixes.within(usize::MAX), all.last().copied());
        // A prefix of a prefix is a prefix.
        let last = prefixes.file(all[all.len() - 1]);
        let again = Prefixes::new(&last).expect("a valid file");
        assert_eq!(again.file(again.iter().next().expect("a layer")), prefixes.file(all[0]));
    }
}

#[test]
fn what_says_how_the_picture_is_shown_is_kept_and_nothing_else() {
    for (exif, is_kept) in [(TURNED, true), (UPRIGHT, false)] {
        let mut metadata = metadata(exif);
        metadata.cicp = Some(Cicp::DISPLAY_P3);
        metadata.content_light =
            Some(ContentLight { max_content: 2_000_000, max_frame_average: 0 });
        let file = encode(Encoder::new().with_metadata(metadata.clone())).expect("valid options");
        let whole = decode_valid(&file);
        assert!(whole.picture().expect("a header").texture_map().is_some());
        assert_eq!(whole.metadata(), &metadata);
        let prefixes = Prefixes::new(&file).expect("a valid file");
        for prefix in prefixes.iter() {
            let small = check(&file, &prefixes, prefix);
            let kept = small.metadata();
            assert_eq!((kept.cicp, kept.content_light), (metadata.cicp, metadata.content_light));
            assert_eq!(kept.icc_profile.as_deref(), Some(PROFILE));
            assert_eq!(kept.exif.is_some(), is_kept);
            assert_eq!(small.orientation(), whole.orientation());
            assert!(kept.xmp.is_none() && kept.texts.is_empty());
            assert!(small.picture().expect("a header").texture_map().is_none());
        }
    }
}

#[test]
fn a_file_that_is_cut_off_has_the_prefixes_of_its_layers() {
    let file = encode(Encoder::new()).expect("valid options");
    let whole = Prefixes::new(&file).expect("a valid file");
    let all: Vec<_> = whole.iter().collect();
    for length in 0..file.len() {
        match Prefixes::new(&file[..length]) {
            Ok(prefixes) => {
                let expected = all.iter().filter(|prefix| prefix.end <= length);
                assert!(prefixes.iter().eq(expected.copied()), "{length}");
            }
            Err(error) => {
                assert!(error.is_unexpected_end(), "{error}");
                assert!(length < 40, "{length}");
            }
        }
    }
}

/// A packed file of two layers.
fn packed() -> File {
    let header = Header { width: 16, height: 16, ..Header::default() };
    let codes = [4.0_f32, 4.0, 1.0, 0.0, 1.0, 0.5].map(f32::to_bits).to_vec();
    let layers = vec![codes.clone(), codes.repeat(3)];
    File::new(header, vec![Entry::FLOAT; header.components()], layers)
}

#[test]
fn flaws_are_told() {
    let sound = packed().with(b"iCCP", PROFILE).chunks();
    let [header, profile, first, second, end] = [0, 1, 2, 3, 4].map(|index| sound[index].clone());
    Prefixes::new(&of_chunks(&sound)).expect("it is sound");
    let mut damaged = first.clone();
    *damaged.last_mut().expect("a CRC") ^= 1;
    let critical = common::chunk(b"Q", &[]);
    let long = common::chunk(b"H", &[0x30; 256]);
    for (chunks, expected) in [
        (vec![first.clone(), end.clone()], "chunk L (layer): "),
        (vec![header.clone(), header.clone()], "chunk H (header): "),
        (vec![long], "chunk H (header): unsupported: length 256"),
        (vec![header.clone(), damaged.clone()], "chunk L (layer): the CRC does not match"),
        (vec![header.clone(), critical.clone()], "chunk Q: unsupported"),
    ] {
        let error = Prefixes::new(&of_chunks(&chunks)).expect_err("a flaw").to_string();
        assert!(error.contains(expected), "{error}");
    }
    assert!(matches!(Prefixes::new(b"GIF89a"), Err(DecodeError::Signature)));
    // What comes after the first layer does not take it away.
    let whole = Prefixes::new(&of_chunks(&sound)).expect("it is sound").iter().next();
    for flaw in [damaged, critical, header.clone(), common::chunk(b"E", &[0])] {
        let file = of_chunks(&[header.clone(), profile.clone(), first.clone(), flaw]);
        let prefixes = Prefixes::new(&file).expect("a layer");
        assert_eq!((prefixes.iter().next(), prefixes.iter().len()), (whole, 1));
    }
    let many = [header, profile, first, second.clone(), second, end];
    assert_eq!(Prefixes::new(&of_chunks(&many)).expect("two layers").iter().len(), 2);
    // What follows the end is no part of the file.
    let longer = [of_chunks(&sound), vec![7; 9]].concat();
    assert_eq!(Prefixes::new(&longer).expect("it is sound").iter().len(), 2);
}

/// The table is what other implementations are compared with, such as that of `bindings/wasm`.
#[test]
fn the_vectors_have_the_prefixes_of_the_table() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let index = fs::read_to_string(root.join("spec/vectors/index.tsv")).expect("the index");
    let names = index.lines().skip(1).filter_map(|line| line.split('\t').next());
    let mut names: Vec<_> = names.filter(|name| !name.starts_with('x')).collect();
    names.dedup();
    let mut found = String::from("file\tlayers\tgaussians\tbytes\tend\tcrc32\n");
    for name in names {
        let file = fs::read(root.join("spec/vectors").join(name)).expect("a vector");
        let prefixes = Prefixes::new(&file).expect("a valid file");
        for prefix in prefixes.iter() {
            let Prefix { layers, gaussians, bytes, end, .. } = prefix;
            let crc = crc32(&prefixes.file(prefix));
            found += &format!("{name}\t{layers}\t{gaussians}\t{bytes}\t{end}\t{crc:08x}\n");
        }
    }
    let path = root.join("tests/prefixes.tsv");
    if std::env::var_os("BLESS").is_some() {
        fs::write(&path, &found).expect("writable");
    }
    let table = fs::read_to_string(&path).expect("the table");
    for (found, expected) in found.lines().zip(table.lines()) {
        assert_eq!(found, expected);
    }
    assert_eq!(found.lines().count(), table.lines().count());
}

#[test]
fn what_decoders_skip_is_left_out() {
    let whole = |file: &[u8]| {
        let prefixes = Prefixes::new(file).expect("it is read");
        prefixes.file(prefixes.within(usize::MAX).expect("a layer"))
    };
    let sound = packed().with(b"iCCP", PROFILE).chunks();
    let expected = whole(&of_chunks(&sound));
    // No samples of full range, a second profile, one that comes too late.
    let limited = (1, common::chunk(b"cICP", &[1, 1, 0, 0]));
    let second = (2, common::chunk(b"iCCP", b"another"));
    let late = (3, common::chunk(b"cICP", &[1, 13, 0, 1]));
    // Exif that turns the picture after some that does not.
    let upright = common::chunk(b"eXIF", UPRIGHT);
    let turned = (1, [upright, common::chunk(b"eXIF", TURNED)].concat());
    for (at, flaw) in [limited, second, late, turned] {
        let mut chunks = sound.clone();
        chunks.insert(at, flaw);
        let file = of_chunks(&chunks);
        assert_eq!(decode_valid(&file).skipped().len(), 1);
        assert_eq!(whole(&file), expected);
    }
}

#[test]
fn of_exif_the_orientation_alone_is_kept() {
    for order in [TURNED, b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0"] {
        let exif = [order, &[7; 20_000]].concat();
        let file = packed().with(b"eXIF", &exif).bytes();
        let prefixes = Prefixes::new(&file).expect("it is sound");
        for prefix in prefixes.iter() {
            let small = prefixes.file(prefix);
            assert_eq!(small.len(), prefix.bytes);
            assert_eq!(decode_valid(&small).metadata().exif.as_deref(), Some(TURNED));
        }
    }
}

#[test]
fn a_file_without_gaussians_is_its_own_prefix() {
    let header = Header::default().chunk(&[]);
    let text = common::chunk(b"tEXt", b"Title\0Black");
    let turned = common::chunk(b"eXIF", TURNED);
    let end = common::chunk(b"E", &[]);
    let file = of_chunks(&[header.clone(), text, turned.clone(), end.clone()]);
    decode_valid(&file);
    let prefixes = Prefixes::new(&file).expect("a valid file");
    let [prefix] = prefixes.iter().collect::<Vec<_>>()[..] else { panic!("{prefixes:?}") };
    assert_eq!((prefixes.layers(), prefix.layers, prefix.gaussians), (0, 0, 0));
    assert_eq!(prefix.end, file.len());
    let small = prefixes.file(prefix);
    assert_eq!(small, of_chunks(&[header, turned, end]));
    assert_eq!(prefix.bytes, small.len());
    assert_eq!(prefixes.within(small.len() - 1), None);
    // Not before its end.
    let cut = Prefixes::new(&file[..file.len() - 1]).expect("the header is there");
    assert_eq!(cut.iter().len(), 0);
}

#[test]
fn many_layers_take_no_time() {
    let header = Header { width: 64, height: 64, ..Header::default() };
    let center = entropy::Grid::new([64, 64]).units([9.0, 9.0]);
    let code = entropy::Code { axes: vec![3], center, ..entropy::Code::default() };
    let steps = vec![0.5, 0.5, 0.5, 0.5, 0.125];
    let file = File::of_entropy_coded(header, steps, vec![vec![code]; 65_535]).bytes();
    let prefixes = Prefixes::new(&file).expect("a valid file");
    let last = prefixes.within(usize::MAX).expect("layers");
    assert_eq!((last.layers, last.gaussians), (65_535, 65_535));
    assert_eq!(prefixes.file(last), file);
}

#[test]
fn the_first_layer_makes_a_file_of_the_size_that_was_asked_for() {
    let sizes = [80, 150, 300, 1000];
    for size in sizes {
        let file = encode(Encoder::new().with_first_layer(Some(size))).expect("valid options");
        let prefixes = Prefixes::new(&file).expect("a valid file");
        let first = prefixes.iter().next().expect("a layer");
        let size = size as usize;
        // Another Gaussian would have taken more, some of the strongest 20 bytes.
        assert!((size - 24..=size).contains(&first.bytes), "{size}: {first:?}");
        check(&file, &prefixes, first);
        // Of all layers together there are as many Gaussians as there are in the file.
        let last = prefixes.iter().last().expect("a layer");
        assert_eq!(last.gaussians as usize, decode_valid(&file).gaussians().len());
    }
}

#[test]
fn a_first_layer_comes_before_what_need_not_be_known_at_once() {
    let encoder = || Encoder::new().with_metadata(metadata(UPRIGHT));
    let file = encode(encoder().with_first_layer(Some(200))).expect("valid options");
    let prefixes = Prefixes::new(&file).expect("a valid file");
    let first = prefixes.iter().next().expect("a layer");
    // The beginning of the file has the bytes of the small file but its end, and some more in numbers.
    assert!(first.end <= first.bytes, "{first:?}");
    let mut stream = StreamDecoder::new();
    stream.feed(&file[..first.end]).expect("a valid file");
    assert_eq!(stream.metadata().icc_profile.as_deref(), Some(PROFILE));
    assert!(stream.metadata().exif.is_none() && stream.metadata().xmp.is_none());
    assert_eq!(decode_valid(&file).metadata(), &metadata(UPRIGHT));

    // Without the option, a decoder has all metadata before the first Gaussian.
    let file = encode(encoder()).expect("valid options");
    let end = Prefixes::new(&file).expect("a valid file").iter().next().expect("a layer").end;
    let mut stream = StreamDecoder::new();
    stream.feed(&file[..end - 1]).expect("a valid file");
    assert_eq!(stream.metadata(), &metadata(UPRIGHT));
}

#[test]
fn a_first_layer_without_room_for_a_gaussian_is_refused() {
    let least = |encoder: Encoder| match encode(encoder.with_first_layer(Some(1))) {
        Err(EncodeError::Option(OptionError::FirstLayer { bytes: 1, least })) => least,
        other => panic!("{other:?}"),
    };
    let bare = least(Encoder::new());
    assert!((60..90).contains(&bare), "{bare}");
    let with_profile = least(Encoder::new().with_metadata(metadata(UPRIGHT)));
    assert_eq!(with_profile, bare + 4 + 1 + PROFILE.len() as u32 + 4);
    for size in [bare, with_profile] {
        let file = encode(Encoder::new().with_first_layer(Some(size))).expect("valid options");
        let prefixes = Prefixes::new(&file).expect("a valid file");
        assert!(prefixes.iter().next().expect("a layer").bytes <= size as usize);
    }
}

#[test]
fn the_pixels_do_not_depend_on_the_first_layer_but_for_rounding() {
    let pixels = |encoder| {
        let decoder = decode_valid(&encode(encoder).expect("valid options"));
        let mut out = vec![0; (SIDES[0] * SIDES[1]) as usize];
        let picture = decoder.picture().expect("a header");
        picture.render_u8(&RenderOptions::new(), &mut out).expect("a small picture");
        out
    };
    let (usual, early) =
        (pixels(Encoder::new()), pixels(Encoder::new().with_first_layer(Some(300))));
    let squares = usual.iter().zip(&early).map(|(&a, &b)| f64::from(a.abs_diff(b)).powi(2));
    // Some bytes more for framing are some less for Gaussians.
    assert!(squares.sum::<f64>() / (usual.len() as f64) < 4.0);
}
