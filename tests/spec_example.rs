//! The worked examples of the specification: their own hex, decoded, gives the values and the
//! pixels that they print.

mod common;

use common::rans::Op;
use common::{decode_valid, entropy};
use image_gip::{Gaussian, Picture, RenderOptions};

const SPECIFICATION: &str = include_str!("../spec/gip.md");

/// One worked example.
#[derive(Clone, Copy)]
struct Example(&'static str);

/// Of the packed coding.
fn packed() -> Example {
    let (_, text) = SPECIFICATION.split_once("\n### 14.1 ").expect("section 14.1");
    Example(text.split_once("\n### ").expect("another section").0)
}

/// Of the entropy coding.
fn entropy_coded() -> Example {
    Example(SPECIFICATION.split_once("\n### 14.2 ").expect("section 14.2").1)
}

impl Example {
    /// The contents of the fenced blocks of this kind.
    fn blocks(self, kind: &str) -> Vec<&'static str> {
        let fence = format!("```{kind}\n");
        let after = self.0.split(&fence[..]).skip(1);
        after.map(|text| text.split_once("```").expect("the block ends").0).collect()
    }

    /// The rows of the table whose heading begins like this, cell by cell.
    fn table(self, heading: &str) -> Vec<Vec<&'static str>> {
        let start = self.0.find(heading).expect("the table");
        let rows = self.0[start..].lines().skip(2).take_while(|line| line.starts_with('|'));
        rows.map(|row| row.trim_matches('|').split('|').map(str::trim).collect()).collect()
    }

    fn file(self) -> Vec<u8> {
        let hex = self.blocks("hex").concat();
        let bytes = hex
            .lines()
            .flat_map(|line| line.split(';').next().unwrap_or_default().split_ascii_whitespace());
        bytes.map(|byte| u8::from_str_radix(byte, 16).expect("a byte in hex")).collect()
    }

    /// Checks that these are the Gaussians whose values are printed.
    fn check_values(self, gaussians: &[Gaussian]) {
        let values = self.table("| x | y |");
        assert_eq!(values.len(), gaussians.len());
        for (row, gaussian) in values.iter().zip(gaussians) {
            let found = gaussian.center.iter().chain(&gaussian.cholesky);
            let found = found.chain(&gaussian.color[..3]);
            let printed: Vec<f32> = row.iter().map(|cell| number(cell)).collect();
            assert!(found.eq(&printed), "{gaussian:?} is not {printed:?}");
        }
    }
}

fn number(text: &str) -> f32 {
    text.parse().expect("a number")
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
fn the_hex_of_the_packed_coding_decodes_to_what_is_printed() {
    let decoder = decode_valid(&packed().file());
    let picture = decoder.picture().expect("a complete file");
    assert_eq!((picture.header().width, picture.header().height), (6, 4));
    assert_eq!(decoder.metadata().texts[0].text, "Three blobs");

    packed().check_values(decoder.gaussians());
    // The codes of the first layer give the first row.
    let codes = packed().table("| bits | component |");
    assert_eq!(codes.len(), 8);
    let values = &packed().table("| x | y |")[0];
    assert!(codes.iter().map(|row| row[3]).eq(values.iter().copied()));

    let printed = packed().blocks("pixels");
    assert_eq!(render(&picture, &RenderOptions::new()), pixels(printed[0]));
    assert_eq!(render(&picture, &RenderOptions::new().with_prefix(1)), pixels(printed[1]));
}

#[test]
fn the_integer_holds_the_codes() {
    let (_, rest) = packed().0.split_once("little-endian integer, are 0x").expect("the integer");
    let integer: String = rest.chars().take_while(char::is_ascii_hexdigit).collect();
    let integer = u128::from_str_radix(&integer, 16).expect("hexadecimal");
    for row in packed().table("| bits | component |") {
        let (first, last) = row[0].split_once(" to ").expect("a range");
        let [first, last, code] =
            [first, last, row[2]].map(|n| n.parse::<u32>().expect("a number"));
        assert_eq!(integer >> first & ((1 << (last - first + 1)) - 1), code.into(), "{row:?}");
    }
    let start = packed().file().len() - 12 - (12 + 22) - 4 - 9;
    let bytes = integer.to_le_bytes();
    assert_eq!(packed().file()[start..start + 9], bytes[..9]);
}

#[test]
fn the_trace_of_one_pixel_is_what_prefixes_give() {
    let decoder = decode_valid(&packed().file());
    let picture = decoder.picture().expect("a complete file");
    let trace = packed().table("| Gaussian | q |");
    assert_eq!(trace.len(), 3);
    for (index, (row, gaussian)) in trace.iter().zip(decoder.gaussians()).enumerate() {
        let mut planes = [0.0; 6 * 4 * 3];
        let options = RenderOptions::new().with_prefix(index as u32 + 1);
        picture.render_planes(&options, &mut planes).expect("a sound request");
        let found = [0, 1, 2].map(|plane| planes[plane * 24 + 6 + 1]);
        assert_eq!(found, [row[3], row[4], row[5]].map(number));

        let [xx, xy, yy] = gaussian.conic();
        let (dx, dy) = (1.5 - gaussian.center[0], 1.5 - gaussian.center[1]);
        let q = xx * dx * dx + 2.0 * xy * dx * dy + yy * dy * dy;
        assert!((number(row[1]) - q).abs() < 1e-5 * q, "q is {q}");
        let weight = (1.0 - q / 4.0).max(0.0).powi(2);
        assert!((number(row[2]) - weight).abs() < 1e-5, "the weight is {weight}");
    }
}

#[test]
fn the_hex_of_the_entropy_coding_decodes_to_what_is_printed() {
    let decoder = decode_valid(&entropy_coded().file());
    entropy_coded().check_values(decoder.gaussians());
    let picture = decoder.picture().expect("a complete file");
    assert_eq!(
        render(&picture, &RenderOptions::new()),
        pixels(entropy_coded().blocks("pixels")[0])
    );
}

#[test]
fn the_symbols_of_the_entropy_coding_are_those_in_the_bytes() {
    let file = entropy_coded().file();
    let (quantizers, layer) = (8 + 48 + 8, 8 + 48 + 40 + 8);
    let steps = file[quantizers..quantizers + 28].as_chunks().0;
    let steps: Vec<f32> = steps.iter().map(|step| f32::from_le_bytes(*step)).collect();
    let layer = entropy::read([6, 4], &steps, &file[layer..layer + 20]);
    let layer = layer.expect("a sound layer");
    let found = layer.ops.iter().zip(&layer.states[1..]).filter_map(|(op, state)| {
        let (read, value) = match op {
            Op::Symbol { context, symbol } => (format!("context {context}"), symbol),
            Op::Bits { count: 0, .. } => return None,
            Op::Bits { count: 1, value } => ("1 bit".into(), value),
            Op::Bits { count, value } => (format!("{count} bits"), value),
        };
        Some([read, value.to_string(), format!("`{state:08X}`")])
    });
    let printed = entropy_coded().table("| read | value |");
    assert!(found.eq(printed.iter().map(|row| [0, 1, 2].map(|cell| row[cell].to_string()))));
    assert!(entropy_coded().0.contains(&format!("; state 0x{:08X}", layer.states[0])));
    // The values with which the first codes end.
    let first = &layer.codes[0];
    assert_eq!((first.exponent, &first.axes[..], first.ratio), (2, &[7, 1, -2][..], 1));
    let second = &layer.codes[1];
    assert_eq!((second.exponent, &second.axes[..], second.ratio), (4, &[-11, 3, 5][..], -3));
    assert_eq!((first.slant, second.slant), (0, 41));
    assert_eq!((first.size, second.size), (0, 31 - 33));
}
