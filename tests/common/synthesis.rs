//! The texture of every pixel (section 9.7), written from `spec/gip.md` alone: point by point.

use core::ops::Range;

use super::oracle::{Request, sums};
use super::texture::{map_sides, read};
use super::{File, Header, RGB};

/// The texture of a file at the size of a request.
pub(crate) struct Synthesis {
    /// Of the map.
    sides: [u32; 2],
    /// The six gains of each node, by octave and pattern.
    gains: Vec<[[f32; 3]; 2]>,
}

impl Synthesis {
    /// Of a file that has texture; `output` is the size of the whole output.
    pub(crate) fn new(file: &File, output: (u32, u32)) -> Option<Self> {
        let (_, payload) = file.extra.iter().find(|(kind, _)| kind == b"tXTR")?;
        let stored = file.header.sides();
        let sums = map_sums(stored, payload);
        let scale = (output.0 as f32 / stored[0] as f32).min(output.1 as f32 / stored[1] as f32);
        let fade = (8.0 * scale - 1.0).clamp(0.0, 1.0);
        let gains = |node| Node::new([0, 1, 2].map(|m| sums[m][node]), fade).gains();
        let gains = (0..sums[0].len()).map(gains).collect();
        Some(Self { sides: map_sides(stored), gains })
    }

    /// What a node has, or the nearest that there is.
    fn at(&self, column: i64, row: i64, octave: usize, pattern: usize) -> f32 {
        let column = column.clamp(0, i64::from(self.sides[0]) - 1);
        let row = row.clamp(0, i64::from(self.sides[1]) - 1);
        self.gains[(row * i64::from(self.sides[0]) + column) as usize][octave][pattern]
    }

    /// What a block has.
    pub(crate) fn gain(&self, octave: usize, pattern: usize, x: i64, y: i64) -> f32 {
        let n = blocks_between_nodes(octave, pattern);
        let [e, f] = place_in_block(pattern);
        let (column, row) = (x.div_euclid(n), y.div_euclid(n));
        let part = |at: i64, place: f32| (at.rem_euclid(n) as f32 + place) / n as f32;
        let of_row = |row: i64| {
            let [left, right] = [0, 1].map(|next| self.at(column + next, row, octave, pattern));
            left + (right - left) * part(x, e)
        };
        let (upper, lower) = (of_row(row), of_row(row + 1));
        upper + (lower - upper) * part(y, f)
    }

    /// V0 to V3 of a block.
    pub(crate) fn values(&self, octave: usize, pattern: usize, x: i64, y: i64) -> [f32; 4] {
        let gain = self.gain(octave, pattern, x, y);
        let numbers = Block::new(octave, pattern, x, y).numbers;
        let [a, b, c] = numbers.map(|number| number as f32 * gain);
        [a + (b + c), a - (b + c), (b - c) - a, -((b - c) + a)]
    }

    /// N at a point of a lattice.
    pub(crate) fn noise(&self, octave: usize, pattern: usize, x: i64, y: i64) -> f32 {
        let Place { block: [column, row], value, next, part } = Place::new(pattern, x, y);
        let this = self.values(octave, pattern, column, row)[value];
        let Some([column, row]) = next else { return this };
        let next = self.values(octave, pattern, column, row)[value];
        this + (next - this) * part
    }
}

/// How many blocks there are in a row from one node to the next.
pub(crate) fn blocks_between_nodes(octave: usize, pattern: usize) -> i64 {
    [4, 2, 2][pattern] >> octave
}

/// The place in a block, as parts of its sides, to which its gain belongs.
pub(crate) fn place_in_block(pattern: usize) -> [f32; 2] {
    [[0.5, 0.5], [0.0, 0.5], [0.5, 0.0]][pattern]
}

/// From what a point of a lattice has its value.
pub(crate) struct Place {
    pub(crate) block: [i64; 2],
    /// Which of its four values.
    pub(crate) value: usize,
    /// The next block along streaks, and at which part of the way there the point is.
    pub(crate) next: Option<[i64; 2]>,
    pub(crate) part: f32,
}

impl Place {
    pub(crate) fn new(pattern: usize, x: i64, y: i64) -> Self {
        let side = if pattern == 0 { 2 } else { 4 };
        let block @ [column, row] = [x, y].map(|at| at.div_euclid(side));
        let [r, q] = [x, y].map(|at| at.rem_euclid(side));
        let (value, next, along) = match pattern {
            0 => (2 * q + r, None, 0),
            1 => (q, Some([column + 1, row]), r),
            _ => (r, Some([column, row + 1]), q),
        };
        Self { block, value: value as usize, next, part: (along as f32 + 0.5) / 4.0 }
    }
}

/// m0 to m2, of all nodes.
pub(crate) fn map_sums(stored: [u32; 2], payload: &[u8]) -> Vec<Vec<f32>> {
    let [width, height] = map_sides(stored);
    let base = [0, 0, 32768, 0];
    let header = Header { color: RGB, width, height, base, ..Header::default() };
    let file = File::of_floats(header, &read(stored, payload).expect("a sound texture"));
    sums(&file, &Request::whole(&file), None)
}

/// What the sums of a node say.
pub(crate) struct Node {
    /// The deviation of each octave.
    pub(crate) amplitudes: [f32; 2],
    pub(crate) horizontal: f32,
    pub(crate) vertical: f32,
    pub(crate) isotropic: f32,
}

impl Node {
    pub(crate) fn new(sums: [f32; 3], fade: f32) -> Self {
        let unit = |x: f32| x.clamp(0.0, 1.0);
        let amplitude = |o: usize| unit((sums[o] - 1.0 / 128.0) * 0.5) * fade;
        let d = sums[2] * 4.0 - 2.0;
        let (h, v) = (unit(d - 0.375), unit(-0.375 - d));
        let isotropic = (1.0 - (h + v) * (h + v)).sqrt();
        Self { amplitudes: [0, 1].map(amplitude), horizontal: h, vertical: v, isotropic }
    }

    /// By octave and pattern.
    pub(crate) fn gains(&self) -> [[f32; 3]; 2] {
        [0, 1].map(|o| {
            let a = self.amplitudes[o];
            let s = [2_f32.powi(-10), 1.82 * 2_f32.powi(-14)][o];
            let t = [1.23 * 2_f32.powi(-10), 1.72 * 2_f32.powi(-14)][o];
            [(a * self.isotropic) * s, (a * self.horizontal) * t, (a * self.vertical) * t]
        })
    }
}

/// From what the values of a block are made.
pub(crate) struct Block {
    pub(crate) k: u32,
    /// S and R after their last steps.
    pub(crate) s: u32,
    pub(crate) r: u32,
    /// A, B and C.
    pub(crate) numbers: [i32; 3],
}

impl Block {
    pub(crate) fn new(octave: usize, pattern: usize, x: i64, y: i64) -> Self {
        let k = 3 * octave as u32 + pattern as u32 + 1;
        let mut s = ((8 * y) as u32).wrapping_add(k);
        s = (s ^ (s >> 16)).wrapping_mul(0x21F0_AAAD);
        s = (s ^ (s >> 15)).wrapping_mul(0x735A_2D97);
        s ^= s >> 15;
        let mut r = (x as u32).wrapping_mul(0x9E37_79B1).wrapping_add(s);
        r = (r ^ (r >> 15)).wrapping_mul(0x2C1B_3C6D);
        let number = |first: u32| {
            let bits = ((r >> first) % 2048) as i32;
            if bits < 1024 { bits } else { bits - 2048 }
        };
        Self { k, s, r, numbers: [21, 10, 0].map(number) }
    }
}

/// A part of a lattice.
pub(crate) struct Lattice {
    columns: Range<i64>,
    rows: Range<i64>,
    values: Vec<f32>,
}

impl Lattice {
    fn new(columns: Range<i64>, rows: Range<i64>, value: impl Fn(i64, i64) -> f32) -> Self {
        let points = rows.clone().flat_map(|y| columns.clone().map(move |x| (x, y)));
        let values = points.map(|(x, y)| value(x, y)).collect();
        Self { columns, rows, values }
    }

    pub(crate) fn at(&self, x: i64, y: i64) -> f32 {
        assert!(self.columns.contains(&x) && self.rows.contains(&y));
        let width = self.columns.end - self.columns.start;
        self.values[((y - self.rows.start) * width + x - self.columns.start) as usize]
    }

    /// Enlarged along x, in a row.
    pub(crate) fn enlarged_along_x(&self, x: i64, row: i64) -> f32 {
        let [old, beside] = columns_or_rows(x);
        3.0 * self.at(old, row) + self.at(beside, row)
    }

    /// E, at a point of the finer lattice.
    pub(crate) fn enlarged(&self, x: i64, y: i64) -> f32 {
        let [old, beside] = columns_or_rows(y).map(|row| self.enlarged_along_x(x, row));
        3.0 * old + beside
    }
}

/// In whose place one of the finer lattice is, and which is beside it.
fn columns_or_rows(at: i64) -> [i64; 2] {
    let old = at.div_euclid(2);
    [old, if at.rem_euclid(2) == 0 { old - 1 } else { old + 1 }]
}

impl Synthesis {
    /// T of an octave.
    pub(crate) fn lattice(&self, octave: usize, columns: Range<i64>, rows: Range<i64>) -> Lattice {
        if octave == 1 {
            return Lattice::new(columns, rows, |x, y| {
                let [first, second, third] = [0, 1, 2].map(|p| self.noise(1, p, x, y));
                (first + second) + third
            });
        }
        let halved =
            |range: &Range<i64>| (range.start - 1).div_euclid(2)..range.end.div_euclid(2) + 1;
        let coarser = self.lattice(1, halved(&columns), halved(&rows));
        Lattice::new(columns, rows, |x, y| {
            let [first, second, third] = [0, 1, 2].map(|p| self.noise(0, p, x, y));
            ((coarser.enlarged(x, y) + first) + second) + third
        })
    }

    /// The texture of a region of a grid.
    pub(crate) fn render(
        &self,
        stored: [u32; 2],
        grid: (u32, u32),
        (left, top, width, height): (u32, u32, u32, u32),
    ) -> Vec<f32> {
        let columns = Axis::new(stored[0], grid.0, left, width);
        let rows = Axis::new(stored[1], grid.1, top, height);
        let texture = self.lattice(0, columns.range(), rows.range());
        let pixel = |column: &Position, row: &Position| column.of(|x| row.of(|y| texture.at(x, y)));
        let pixels =
            rows.0.iter().flat_map(|row| columns.0.iter().map(move |column| (column, row)));
        pixels.map(|(column, row)| pixel(column, row)).collect()
    }
}

/// Where the pixels of a grid stand among the stored ones along an axis.
struct Axis(Vec<Position>);

enum Position {
    /// On one of them.
    On(i64),
    /// At this part of the way from one to the next.
    Between(i64, f32),
}

impl Axis {
    fn new(stored: u32, grid: u32, start: u32, length: u32) -> Self {
        let position = |at: u32| {
            let [stored, grid, at] = [stored, grid, at].map(i64::from);
            if grid <= stored {
                return Position::On(at);
            }
            let place = (2 * at + 1) * stored - grid;
            let part = place.rem_euclid(2 * grid) as f32 / (2 * grid) as f32;
            Position::Between(place.div_euclid(2 * grid), part)
        };
        Self((start..start + length).map(position).collect())
    }

    /// The stored pixels that are asked for.
    fn range(&self) -> Range<i64> {
        let bounds = |position: &Position| match *position {
            Position::On(at) => [at, at],
            Position::Between(at, _) => [at - 1, at + 2],
        };
        let [first, last] =
            [self.0.first(), self.0.last()].map(|position| bounds(position.expect("pixels")));
        first[0]..last[1] + 1
    }
}

impl Position {
    fn of(&self, texture: impl Fn(i64) -> f32) -> f32 {
        match *self {
            Self::On(at) => texture(at),
            Self::Between(at, t) => {
                let u = [-1, 0, 1, 2].map(|beside| texture(at + beside));
                let c0 = ((1.0 - 0.5 * t) * t - 0.5) * t;
                let c1 = ((1.5 * t - 2.5) * t) * t + 1.0;
                let c2 = ((2.0 - 1.5 * t) * t + 0.5) * t;
                let c3 = ((0.5 * t - 0.5) * t) * t;
                ((u[0] * c0 + u[1] * c1) + u[2] * c2) + u[3] * c3
            }
        }
    }
}
