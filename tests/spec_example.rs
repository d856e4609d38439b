//! The worked example of the specification: its own hex, decoded, gives the values and the pixels
//! that it prints.

mod common;

use common::decode_valid;
use image_gip::{Picture, RenderOptions};

const SPECIFICATION: &str = include_str!("../spec/gip.md");

/// The worked example's section.
fn section() -> &'static str {
    SPECIFICATION.split_once("\n## 14 ").expect("section 14").1
}

/// The contents of the fenced blocks of this kind.
fn blocks(kind: &str) -> Vec<&'static str> {
    let fence = format!("```{kind}\n");
    let after = section().split(&fence[..]).skip(1);
    after.map(|text| text.split_once("```").expect("the block ends").0).collect()
}

/// The rows of the table whose heading begins like this, cell by cell.
fn table(heading: &str) -> Vec<Vec<&'static str>> {
    let start = section().find(heading).expect("the table");
    let rows = section()[start..].lines().skip(2).take_while(|line| line.starts_with('|'));
    rows.map(|row| row.trim_matches('|').split('|').map(str::trim).collect()).collect()
}

fn number(text: &str) -> f32 {
    text.parse().expect("a number")
}

fn file() -> Vec<u8> {
    let hex = blocks("hex").concat();
    let bytes = hex
        .lines()
        .flat_map(|line| line.split(';').next().unwrap_or_default().split_ascii_whitespace());
    bytes.map(|byte| u8::from_str_radix(byte, 16).expect("a byte in hex")).collect()
}

fn pixels(block: &str) -> Vec<u8> {
    block
        .split(|c: char| c == ',' || c.is_ascii_whitespace())
        .filter(|sample| !sample.is_empty())
        .map(|sample| sample.parse().expect("a sample"))
        .collect()
}

fn render(picture: &Picture<'_>, options: &RenderOptions) -> Vec<u8> {
    let mut out = vec![0; 6 * 4 * 3];
    picture.render_u8(options, &mut out).expect("a sound request");
    out
}

#[test]
fn the_hex_decodes_to_the_values_and_pixels_that_are_printed() {
    let decoder = decode_valid(&file());
    let picture = decoder.picture().expect("a complete file");
    assert_eq!((picture.header().width, picture.header().height), (6, 4));
    assert_eq!(decoder.metadata().texts[0].text, "Three blobs");

    let values = table("| x | y |");
    assert_eq!(values.len(), decoder.gaussians().len());
    for (row, gaussian) in values.iter().zip(decoder.gaussians()) {
        let found = gaussian.center.iter().chain(&gaussian.cholesky).chain(&gaussian.color[..3]);
        let printed: Vec<f32> = row.iter().map(|cell| number(cell)).collect();
        assert!(found.eq(&printed), "{gaussian:?} is not {printed:?}");
    }
    // The codes of the first layer give the first row.
    let codes = table("| bits | component |");
    assert!(codes.iter().map(|row| row[3]).eq(values[0].iter().copied()));

    let printed = blocks("pixels");
    assert_eq!(render(&picture, &RenderOptions::new()), pixels(printed[0]));
    assert_eq!(render(&picture, &RenderOptions::new().prefix(1)), pixels(printed[1]));
}

#[test]
fn the_integer_holds_the_codes() {
    let (_, rest) = section().split_once("little-endian integer, are 0x").expect("the integer");
    let integer: String = rest.chars().take_while(char::is_ascii_hexdigit).collect();
    let integer = u128::from_str_radix(&integer, 16).expect("hexadecimal");
    for row in table("| bits | component |") {
        let (first, last) = row[0].split_once(" to ").expect("a range");
        let [first, last, code] =
            [first, last, row[2]].map(|n| n.parse::<u32>().expect("a number"));
        assert_eq!(integer >> first & ((1 << (last - first + 1)) - 1), code.into(), "{row:?}");
    }
    let start = file().len() - 12 - (12 + 22) - 4 - 9;
    let bytes = integer.to_le_bytes();
    assert_eq!(file()[start..start + 9], bytes[..9]);
}

#[test]
fn the_trace_of_one_pixel_is_what_prefixes_give() {
    let decoder = decode_valid(&file());
    let picture = decoder.picture().expect("a complete file");
    let trace = table("| Gaussian | q |");
    assert_eq!(trace.len(), 3);
    for (index, (row, gaussian)) in trace.iter().zip(decoder.gaussians()).enumerate() {
        let mut planes = [0.0; 6 * 4 * 3];
        let options = RenderOptions::new().prefix(index as u32 + 1);
        picture.render_planes(&options, &mut planes).expect("a sound request");
        let found = [0, 1, 2].map(|plane| planes[plane * 24 + 6 + 2]);
        assert_eq!(found, [row[3], row[4], row[5]].map(number));

        let [xx, xy, yy] = gaussian.conic();
        let (dx, dy) = (2.5 - gaussian.center[0], 1.5 - gaussian.center[1]);
        let q = xx * dx * dx + 2.0 * xy * dx * dy + yy * dy * dy;
        assert!((number(row[1]) - q).abs() < 1e-5 * q, "q is {q}");
        let weight = (1.0 - q / 8.0).max(0.0).powi(4);
        assert!((number(row[2]) - weight).abs() < 1e-5, "the weight is {weight}");
    }
}
