//! What the encoder makes of real pictures, to the last bit: each change of it shows in
//! `golden/encodings.tsv`.
//!
//! `BLESS=1 cargo test --test golden` writes the table again. Its diff tells what a change of the encoder
//! brings and costs.

use std::fs;
use std::path::Path;

use image::DynamicImage;
use image_gip::{ColorModel, Encoder, Precision, Source, Target, Tune};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden");
const PICTURES: [&str; 4] = ["photograph", "cut-out", "gray", "deep"];
const COLUMNS: &str =
    "picture\tprecision\teffort\ttune\ttarget\thash\tbytes\tGaussians\tPSNR\tquality\n";
const EFFORTS: [(&str, u8); 2] = [("1", 1), ("4", 4)];
const VISUAL: (&str, Tune) = ("visual", Tune::Visual);
const PSNR: (&str, Tune) = ("psnr", Tune::Psnr);
const RATE: (&str, Target) = ("1.5 bpp", Target::BitsPerPixel(1.5));
const QUALITY: (&str, Target) = ("quality 70", Target::Quality(70.0));
const COUNT: (&str, Target) = ("150 Gaussians", Target::Gaussians(150));
const DECIBELS: (&str, Target) = ("34 dB", Target::Psnr(34.0));

/// Ways to encode: a precision with tunes and targets.
type Ways<'a> = ((&'a str, Precision), &'a [(&'a str, Tune)], &'a [(&'a str, Target)]);
const WAYS: [Ways<'_>; 4] = [
    (("entropy", Precision::Entropy), &[VISUAL, PSNR], &[RATE, QUALITY, COUNT]),
    (("entropy", Precision::Entropy), &[PSNR], &[DECIBELS]),
    (("packed", Precision::Packed), &[VISUAL], &[RATE, QUALITY, COUNT]),
    (("float", Precision::Float), &[VISUAL], &[COUNT]),
];

/// All that is trained and rendered is the same bit for bit on all machines. But the logarithms and powers
/// that steer the search are those of the platform's library: with another one a file may differ, and is
/// about as good. Those of glibc and musl give the same files.
const HAS_SAME_FILES: bool = cfg!(target_os = "linux");
/// By how much the last two columns may differ there: 0.02 dB, and 0.1 points of quality. Those before them,
/// which tell of bytes, are not compared.
const CLOSE: [f64; 2] = [0.02, 0.1];
/// The columns that tell what was encoded, and the first of the last two.
const KEYS: usize = 5;
const FIGURES: usize = 8;

/// The 64-bit FNV-1a hash. The CRC-32 would not do: as every chunk ends with its own, all files with
/// chunks of the same lengths have the same.
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash: u64, &byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

/// An encoder, after the columns of the table that tell it.
type Named = (String, Encoder);

/// The encoders of [`WAYS`].
fn encoders() -> impl Iterator<Item = Named> {
    WAYS.into_iter().flat_map(|(precision, tunes, targets)| {
        let all = vec![(String::new(), Encoder::new())];
        let all = with_each(&all, &[precision], Encoder::with_precision);
        let all = with_each(&all, &EFFORTS, Encoder::with_effort);
        let all = with_each(&all, tunes, Encoder::with_tune);
        with_each(&all, targets, Encoder::with_target)
    })
}

/// Each of the encoders with each of the options, which have names.
fn with_each<T: Copy>(
    encoders: &[Named],
    options: &[(&str, T)],
    with: impl Fn(Encoder, T) -> Encoder,
) -> Vec<Named> {
    let each = |(names, encoder): &Named| {
        let named = |(name, option): &(&str, T)| {
            (format!("{names}\t{name}"), with(encoder.clone(), *option))
        };
        options.iter().map(named).collect::<Vec<_>>()
    };
    encoders.iter().flat_map(each).collect()
}

/// The lines of the table for a picture.
fn lines(name: &str) -> Vec<String> {
    let image = image::open(Path::new(FOLDER).join(format!("{name}.png"))).expect(name);
    let (width, height) = (image.width(), image.height());
    let source = match &image {
        DynamicImage::ImageLuma8(image) => {
            Source::new_u8(width, height, ColorModel::Gray, image.as_raw())
        }
        DynamicImage::ImageRgb8(image) => {
            Source::new_u8(width, height, ColorModel::Rgb, image.as_raw())
        }
        DynamicImage::ImageRgba8(image) => {
            Source::new_u8(width, height, ColorModel::Rgba, image.as_raw())
        }
        DynamicImage::ImageRgb16(image) => {
            Source::new_u16(width, height, ColorModel::Rgb, image.as_raw())
        }
        _ => unreachable!("no picture is of another kind"),
    };
    let source = source.expect("the sizes agree");
    let line = |(way, encoder): Named| {
        let encoded = encoder.encode(&source).expect("it encodes");
        let (hash, bytes) = (fnv1a(&encoded.bytes), encoded.bytes.len());
        let (count, psnr) = (encoded.report.gaussians, encoded.report.psnr);
        let quality = encoded.report.quality;
        format!("{name}{way}\t{hash:016x}\t{bytes}\t{count}\t{psnr:.3}\t{quality:.2}")
    };
    encoders().map(line).collect()
}

/// Whether a line says what another one does, as far as platforms agree.
fn agrees(found: &str, expected: &str) -> bool {
    if HAS_SAME_FILES {
        return found == expected;
    }
    let columns = |line: &str| -> Vec<String> { line.split('\t').map(str::to_owned).collect() };
    let (found, expected) = (columns(found), columns(expected));
    let figures = |columns: &[String]| -> Vec<f64> {
        columns[FIGURES..].iter().map(|figure| figure.parse().expect("a number")).collect()
    };
    let differences = figures(&found).into_iter().zip(figures(&expected)).map(|(a, b)| a - b);
    found[..KEYS] == expected[..KEYS] && differences.zip(CLOSE).all(|(by, most)| by.abs() <= most)
}

#[test]
fn the_encoder_makes_the_files_of_the_table() {
    let lines: Vec<String> = PICTURES.into_iter().flat_map(lines).collect();
    let path = Path::new(FOLDER).join("encodings.tsv");
    if std::env::var_os("BLESS").is_some() {
        let table = lines.iter().fold(COLUMNS.to_owned(), |table, line| table + line + "\n");
        fs::write(&path, table).expect("writable");
    }
    let table = fs::read_to_string(&path).expect("the table");
    let expected = table.strip_prefix(COLUMNS).expect("its columns");
    assert_eq!(lines.len(), expected.lines().count());
    let differ = |(found, expected): &(&String, &str)| !agrees(found, expected);
    let differing: Vec<String> = lines
        .iter()
        .zip(expected.lines())
        .filter(differ)
        .map(|(found, expected)| format!("table: {expected}\nfound: {found}\n"))
        .collect();
    assert!(differing.is_empty(), "{} lines differ:\n{}", differing.len(), differing.concat());
}
