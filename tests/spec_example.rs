//! The worked examples of the specification: their own hex, decoded, gives the values and the
//! pixels that they print.

mod common;

use common::oracle::{self, Request};
use common::rans::Op;
use common::synthesis::{Block, Node, Synthesis, map_sums};
use common::{File, Header, decode_valid, entropy, texture};
use image_gip::{Gaussian, Picture, RenderOptions};

const SPECIFICATION: &str = include_str!("../spec/gip.md");

/// One worked example.
#[derive(Clone, Copy)]
struct Example(&'static str);

fn section(number: &str) -> Example {
    let heading = format!("\n### {number} ");
    let (_, text) = SPECIFICATION.split_once(&heading[..]).expect("the section");
    Example(text.split("\n### ").next().unwrap_or_default())
}

/// Of the packed coding.
fn packed() -> Example {
    section("14.1")
}

/// Of the entropy coding.
fn entropy_coded() -> Example {
    section("14.2")
}

/// Of texture.
fn textured() -> Example {
    section("14.3")
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

    /// Checks that the text has these words, however its lines are broken.
    #[track_caller]
    fn says(self, words: &str) {
        let text = self.0.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(text.contains(words), "{words}");
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
    let mut out = vec![0; picture.output_len(options).expect("it fits")];
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
    // Before the end, the second layer, and the CRC of the first.
    let start = packed().file().len() - 6 - 24 - 4 - 9;
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
    // After the signature and the header.
    let layer = 8 + 26 + 2;
    let steps = [1.0, 0.5, 0.5, 0.5, 0.125, 0.125, 0.125];
    let layer = entropy::read([6, 4], &steps, 2, &file[layer..layer + 16]);
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

/// The sides of the picture with texture.
const SIDES: [u32; 2] = [6, 4];

/// The payload of `tXTR`.
fn payload() -> Vec<u8> {
    let file = textured().file();
    let start = 8 + 11 + 5;
    file[start..start + 11].to_vec()
}

/// The file for the oracle.
fn textured_file() -> File {
    let [width, height] = SIDES;
    let header = Header { width, height, base: [0x8080, 0, 0, 0], ..Header::default() };
    File::of_floats(header, &[]).with(b"tXTR", &payload())
}

/// Checks the rows of a table against what they should be.
#[track_caller]
fn check_rows(heading: &str, expected: impl IntoIterator<Item = Vec<String>>) {
    let printed = textured().table(heading);
    let expected: Vec<_> = expected.into_iter().collect();
    assert_eq!(printed, expected);
}

fn texts(numbers: &[f32]) -> Vec<String> {
    numbers.iter().map(f32::to_string).collect()
}

#[test]
fn the_hex_of_the_texture_decodes_to_what_is_printed() {
    let decoder = decode_valid(&textured().file());
    let picture = decoder.picture().expect("a complete file");
    let printed = pixels(textured().blocks("pixels")[0]);
    assert_eq!(render(&picture, &RenderOptions::new()), printed);
    assert_eq!(render(&picture, &RenderOptions::new().with_texture(false)), [128; 24]);
    let file = textured_file();
    let planes = oracle::render(&file, &Request::whole(&file));
    assert!(oracle::samples(&planes, 8).into_iter().eq(printed.iter().map(|&s| s.into())));
    let pixel = planes[0][6 + 3];
    textured().says(&format!("the pixel is {pixel}, and the sample {}", printed[9]));
}

#[test]
fn the_map_of_the_texture_is_what_is_printed() {
    // After a step and a number.
    let steps = texture::steps(0.125);
    let layer = entropy::read(texture::map_sides(SIDES), &steps, 1, &payload()[3..]);
    let layer = layer.expect("a sound layer");
    let code = &layer.codes[0];
    assert_eq!((code.exponent, &code.axes[..], code.size), (2, &[7, 0, 2][..], 0));
    assert_eq!((code.ratio, code.slant), (0, 1));
    textured().says(&format!("; state 0x{:08X}", layer.states[0]));
    textured().says(&format!("0.19 \\* 6) / ({} ", steps[1]));
    check_rows("| x | y |", [texts(&layer.values[0])]);

    let sums = map_sums(SIDES, &payload());
    let row = |node: usize| {
        let sums = [0, 1, 2].map(|m| sums[m][node]);
        let found = Node::new(sums, 1.0);
        assert_eq!(found.vertical, 0.0);
        let [a0, a1] = found.amplitudes;
        let numbers = [&sums[..], &[a0, a1, found.horizontal, found.isotropic]].concat();
        [vec![format!("{}, {}", node % 2, node / 2)], texts(&numbers)].concat()
    };
    check_rows("| node |", (0..4).map(row));
}

#[test]
fn the_trace_of_the_texture_is_what_is_printed() {
    let synthesis = Synthesis::new(&textured_file(), SIDES.into()).expect("texture");
    let block = |(octave, pattern, x): (usize, usize, i64)| {
        let Block { k, s, r, numbers: [a, b, c] } = Block::new(octave, pattern, x, 0);
        let cells = [format!("{x}, 0"), k.to_string(), format!("`{s:08X}`"), format!("`{r:08X}`")];
        let start = [octave, pattern].map(|n| n.to_string());
        let gain = synthesis.gain(octave, pattern, x, 0).to_string();
        [&start[..], &cells, &[a, b, c].map(|n| n.to_string()), &[gain]].concat()
    };
    let of_octave_1 = [(1, 0, 0), (1, 0, 1), (1, 1, 0), (1, 1, 1)];
    let of_octave_0 = [(0, 0, 1), (0, 1, 0), (0, 1, 1)];
    check_rows("| octave | p |", of_octave_1.into_iter().chain(of_octave_0).map(block));

    // The values of octave 0.
    let gain = synthesis.gain(0, 0, 1, 0);
    let [a, b, c] = Block::new(0, 0, 1, 0).numbers.map(|number| number as f32 * gain);
    let isotropic = synthesis.values(0, 0, 1, 0)[3];
    textured().says(&format!("a = {a}, b = {b} and c = {c}, so V3 = -((b - c) + a) = {isotropic}"));
    let [this, next] = [0, 1].map(|x| synthesis.values(0, 1, x, 0)[1]);
    let streaks = synthesis.noise(0, 1, 3, 1);
    textured().says(&format!("V1 = {this} of the one block and V1 = {next} of"));
    textured().says(&format!("that is {streaks}"));

    let [fine, coarse] = [0, 1].map(|octave| synthesis.lattice(octave, -2..8, -2..6));
    let point = |(octave, x, y): (usize, i64, i64)| {
        let [isotropic, streaks] = [0, 1].map(|pattern| synthesis.noise(octave, pattern, x, y));
        let (start, sum) = match octave {
            0 => (coarse.enlarged(x, y).to_string(), fine.at(x, y)),
            _ => ("-".into(), coarse.at(x, y)),
        };
        let place = [octave.to_string(), format!("{x}, {y}"), start];
        [&place[..], &texts(&[isotropic, streaks, sum])].concat()
    };
    let points = [(1, 1, 0), (1, 2, 0), (1, 1, 1), (1, 2, 1), (0, 3, 1)];
    check_rows("| octave | point |", points.map(point));
    let sum = |old: f32, beside: f32, sum: f32| {
        textured().says(&format!("3 \\* {old} + {beside} = {sum}").replace("+ -", "- "));
    };
    let rows = [0, 1].map(|row| coarse.enlarged_along_x(3, row));
    for row in [0, 1] {
        sum(coarse.at(1, row), coarse.at(2, row), rows[row as usize]);
    }
    sum(rows[0], rows[1], coarse.enlarged(3, 1));
}
