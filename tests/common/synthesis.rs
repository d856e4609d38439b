//! The texture of every pixel (section 9.7), written from `spec/gip.md` alone: point by point.

use core::ops::Range;

use super::oracle::{Request, sums};
use super::texture::{map_sides, read};
use super::{File, Ghdr, RGBA};

/// The texture of a file at the size of a request.
pub(crate) struct Synthesis {
    /// Of the map.
    sides: [u32; 2],
    /// The nine gains of each node, by octave and pattern.
    gains: Vec<[[f32; 3]; 3]>,
}

impl Synthesis {
    /// Of a file that has texture; `output` is the size of the whole output.
    pub(crate) fn new(file: &File, output: (u32, u32)) -> Option<Self> {
        let (_, payload) = file.extra.iter().find(|(kind, _)| kind == b"tXTR")?;
        let stored = file.header.sides();
        let sums = map_sums(stored, payload);
        let scale = (output.0 as f32 / stored[0] as f32).min(output.1 as f32 / stored[1] as f32);
        let fade = (8.0 * scale - 1.0).clamp(0.0, 1.0);
        let gains = |node| Node::new([0, 1, 2, 3].map(|m| sums[m][node]), fade).gains();
        let gains = (0..sums[0].len()).map(gains).collect();
        Some(Self { sides: map_sides(stored), gains })
    }

    /// What a node has, or the nearest that there is.
    fn at(&self, column: i64, row: i64, octave: usize, pattern: usize) -> f32 {
        let column = column.clamp(0, i64::from(self.sides[0]) - 1);
        let row = row.clamp(0, i64::from(self.sides[1]) - 1);
        self.gains[(row * i64::from(self.sides[0]) + column) as usize][octave][pattern]
    }

    /// What a point of a lattice has.
    pub(crate) fn gain(&self, x: i64, y: i64, octave: usize, pattern: usize) -> f32 {
        let n = 8 >> octave;
        let (column, row) = (x.div_euclid(n), y.div_euclid(n));
        let part = |at: i64| (at.rem_euclid(n) as f32 + 0.5) / n as f32;
        let of_row = |row: i64| {
            let [left, right] = [0, 1].map(|next| self.at(column + next, row, octave, pattern));
            left + (right - left) * part(x)
        };
        let (upper, lower) = (of_row(row), of_row(row + 1));
        upper + (lower - upper) * part(y)
    }
}

/// m0 to m3, of all nodes.
pub(crate) fn map_sums(stored: [u32; 2], payload: &[u8]) -> Vec<Vec<f32>> {
    let [width, height] = map_sides(stored);
    let base = [0, 0, 0, 32768];
    let header = Ghdr { color: RGBA, width, height, base, ..Ghdr::default() };
    let file = File::of_floats(header, &read(stored, payload).expect("a sound texture"));
    sums(&file, &Request::whole(&file), None)
}

/// What the sums of a node say.
pub(crate) struct Node {
    /// The deviation of each octave.
    pub(crate) amplitudes: [f32; 3],
    pub(crate) horizontal: f32,
    pub(crate) vertical: f32,
    pub(crate) isotropic: f32,
}

impl Node {
    pub(crate) fn new(sums: [f32; 4], fade: f32) -> Self {
        let unit = |x: f32| x.clamp(0.0, 1.0);
        let amplitude = |o: usize| unit((sums[o] - 1.0 / 128.0) * 0.5) * fade;
        let d = sums[3] * 4.0 - 2.0;
        let (h, v) = (unit(d - 0.125), unit(-0.125 - d));
        let isotropic = (1.0 - (h + v) * (h + v)).sqrt();
        Self { amplitudes: [0, 1, 2].map(amplitude), horizontal: h, vertical: v, isotropic }
    }

    /// By octave and pattern.
    pub(crate) fn gains(&self) -> [[f32; 3]; 3] {
        let scale = 1.0 / 1024.0;
        [0, 1, 2].map(|o| {
            let a = self.amplitudes[o];
            let s = [1.0, 1.82, 2.1][o];
            let t = [1.23, 1.72, 1.86][o];
            [
                (a * self.isotropic) * (s * scale),
                (a * self.horizontal) * (t * scale),
                (a * self.vertical) * (t * scale),
            ]
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
        let k = 4 * pattern as u32 + octave as u32 + 1;
        let mut s = ((16 * y) as u32).wrapping_add(k);
        s = (s ^ (s >> 16)).wrapping_mul(0x21F0_AAAD);
        s = (s ^ (s >> 15)).wrapping_mul(0x735A_2D97);
        s ^= s >> 15;
        let mut r = (x as u32).wrapping_mul(0x9E37_79B1).wrapping_add(s);
        r = (r ^ (r >> 15)).wrapping_mul(0x2C1B_3C6D);
        let number = |bits: u32| 2 * (bits % 1024) as i32 - 1023;
        Self { k, s, r, numbers: [number(r >> 2), number(r >> 12), number(r >> 22)] }
    }

    /// V0 to V3.
    fn values(&self) -> [f32; 4] {
        let [a, b, c] = self.numbers;
        [a + b + c, a - b - c, -a + b - c, -a - b + c].map(|v| v as f32)
    }
}

/// N at a point of a lattice.
pub(crate) fn noise(octave: usize, pattern: usize, x: i64, y: i64) -> f32 {
    if pattern == 0 {
        let (right, below) = (x.rem_euclid(2), y.rem_euclid(2));
        let block = Block::new(octave, 0, x.div_euclid(2), y.div_euclid(2));
        return block.values()[(2 * below + right) as usize];
    }
    let (column, row) = (x.div_euclid(4), y.div_euclid(4));
    let (r, q) = (x.rem_euclid(4), y.rem_euclid(4));
    let (along, across, next) =
        if pattern == 1 { (r, q, [column + 1, row]) } else { (q, r, [column, row + 1]) };
    let [this, next] = [[column, row], next]
        .map(|[x, y]| Block::new(octave, pattern, x, y).values()[across as usize]);
    this + (next - this) * (along as f32 + 0.5) / 4.0
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

    /// E, at a point of the finer lattice.
    pub(crate) fn enlarged(&self, x: i64, y: i64) -> f32 {
        let beside = |at: i64| at.div_euclid(2) + if at.rem_euclid(2) == 0 { -1 } else { 1 };
        let of_column = |x: i64| 0.75 * self.at(x, y.div_euclid(2)) + 0.25 * self.at(x, beside(y));
        0.75 * of_column(x.div_euclid(2)) + 0.25 * of_column(beside(x))
    }
}

impl Synthesis {
    /// T of an octave.
    pub(crate) fn lattice(&self, octave: usize, columns: Range<i64>, rows: Range<i64>) -> Lattice {
        let halved =
            |range: &Range<i64>| (range.start - 1).div_euclid(2)..range.end.div_euclid(2) + 1;
        let coarser =
            (octave < 2).then(|| self.lattice(octave + 1, halved(&columns), halved(&rows)));
        Lattice::new(columns, rows, |x, y| {
            let start = coarser.as_ref().map_or(0.0, |coarser| coarser.enlarged(x, y));
            (0..3).fold(start, |sum, pattern| {
                sum + self.gain(x, y, octave, pattern) * noise(octave, pattern, x, y)
            })
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
        let pixel = |column: &Place, row: &Place| column.of(|x| row.of(|y| texture.at(x, y)));
        let pixels =
            rows.0.iter().flat_map(|row| columns.0.iter().map(move |column| (column, row)));
        pixels.map(|(column, row)| pixel(column, row)).collect()
    }
}

/// Where the pixels of a grid stand among the stored ones along an axis.
struct Axis(Vec<Place>);

enum Place {
    /// On one of them.
    On(i64),
    /// At this part of the way from one to the next.
    Between(i64, f32),
}

impl Axis {
    fn new(stored: u32, grid: u32, start: u32, length: u32) -> Self {
        let place = |at: u32| {
            let [stored, grid, at] = [stored, grid, at].map(i64::from);
            if grid <= stored {
                return Place::On(at);
            }
            let place = (2 * at + 1) * stored - grid;
            let part = place.rem_euclid(2 * grid) as f32 / (2 * grid) as f32;
            Place::Between(place.div_euclid(2 * grid), part)
        };
        Self((start..start + length).map(place).collect())
    }

    /// The stored pixels that are asked for.
    fn range(&self) -> Range<i64> {
        let bounds = |place: &Place| match *place {
            Place::On(at) => [at, at],
            Place::Between(at, _) => [at - 1, at + 2],
        };
        let [first, last] =
            [self.0.first(), self.0.last()].map(|place| bounds(place.expect("pixels")));
        first[0]..last[1] + 1
    }
}

impl Place {
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
