//! Layers of the entropy coding (sections 7.4 and 7.5), written from `spec/gip.md` alone: a writer
//! that turns codes into symbols and plain bits, and a reader that gives the codes and their values.

use super::exp::exp;
use super::rans::{Decoder, Encoder, Flaw, Op};

/// The steps of section 7.5: position, size, ratio, slant, then the colour axes.
pub(crate) type Steps = [f32];

/// One Gaussian as it is coded.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Code {
    /// The step exponent.
    pub(crate) exponent: u32,
    /// The colour axes, as many as channels.
    pub(crate) axes: Vec<i32>,
    /// By how much the size exceeds the one that is expected in its cell.
    pub(crate) size: i32,
    pub(crate) ratio: i32,
    pub(crate) slant: i32,
    /// In the units of the grid.
    pub(crate) center: [u32; 2],
}

/// The grid of section 7.4.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid {
    /// In pixels.
    pub(crate) root: u32,
    pub(crate) roots: [u32; 2],
}

impl Grid {
    /// For the width and the height of a picture.
    pub(crate) fn new(sides: [u32; 2]) -> Self {
        let longer = sides[0].max(sides[1]);
        let root = longer.div_ceil(16).max(8).next_power_of_two();
        Self { root, roots: sides.map(|side| side.div_ceil(root) + 2) }
    }

    /// A point of the picture in units.
    pub(crate) fn units(&self, point: [f32; 2]) -> [u32; 2] {
        point.map(|pixels| ((pixels + self.root as f32) * 128.0) as u32)
    }

    fn whole(&self) -> Cell {
        Cell { corner: [0, 0], sides: self.roots.map(|roots| roots * self.root) }
    }
}

/// A rectangle of the grid, in pixels.
#[derive(Clone, Copy, Debug)]
struct Cell {
    corner: [u32; 2],
    sides: [u32; 2],
}

impl Cell {
    fn is_split(&self, grid: &Grid, count: u32) -> bool {
        let large = self.sides.iter().any(|&side| side > grid.root);
        (count > 1 || large) && self.sides != [1, 1]
    }

    /// The left or upper part, and the other.
    fn parts(&self, grid: &Grid) -> [Self; 2] {
        let axis = usize::from(self.sides[1] > self.sides[0]);
        let side = self.sides[axis];
        let half =
            if side > grid.root { (side / grid.root).div_ceil(2) * grid.root } else { side / 2 };
        let (mut first, mut second) = (*self, *self);
        first.sides[axis] = half;
        second.corner[axis] += half;
        second.sides[axis] -= half;
        [first, second]
    }

    fn holds(&self, center: [u32; 2]) -> bool {
        let inside = |axis: usize| {
            let start = self.corner[axis] * 128;
            (start..start + self.sides[axis] * 128).contains(&center[axis])
        };
        inside(0) && inside(1)
    }

    fn level(&self) -> u32 {
        (self.sides[0].ilog2()) + (self.sides[1].ilog2())
    }
}

/// The numbers of Gaussians that a symbol stands for, from low to high, of as many in a cell.
fn count_range(symbol: u32, count: u32) -> [u64; 2] {
    let low = |s: u32| (u64::from(s) * (u64::from(count) + 1)).div_ceil(16);
    [low(symbol), low(symbol + 1) - 1]
}

/// How many plain bits tell these numbers apart.
fn range_bits([low, high]: [u64; 2]) -> u32 {
    (high - low + 1).next_power_of_two().ilog2()
}

/// The context of a colour axis after the first.
fn axis_context(axis: usize, exponent: u32, before: i32) -> u32 {
    let m = match before.unsigned_abs() {
        0 => 0,
        1 => 1,
        2..4 => 2,
        4..8 => 3,
        _ => 4,
    };
    9 + 40 * (axis as u32 - 1) + 5 * exponent + m
}

fn slant_context(exponent: u32, ratio: i32) -> u32 {
    let q = if exponent <= 2 { ratio << (2 - exponent) } else { ratio >> (exponent - 2) };
    let j = (q.div_euclid(3) + 3).clamp(0, 6);
    135 + 7 * exponent.min(2) + j as u32
}

fn fine(exponent: u32) -> f32 {
    1.0 / (1 << exponent) as f32
}

/// How large a Gaussian is expected to be in a cell.
fn expected_size(steps: &Steps, exponent: u32, level: u32) -> i32 {
    ((0.1 + 0.19 * level as f32) / (steps[1] * fine(exponent))) as i32
}

/// Section 7.5, without what depends on the position.
struct Shape {
    size: f32,
    cholesky: [f32; 3],
}

impl Shape {
    /// With the whole size of `code`.
    fn new(steps: &Steps, code: &Code, size: i32) -> Self {
        let fine = fine(code.exponent);
        let e = |x: f32| exp(x.clamp(-20.0, 20.0));
        let s = e(size as f32 * (steps[1] * fine));
        let t = e(code.ratio as f32 * (steps[2] * fine));
        let (l11, l22) = (s * t, s / t);
        let l21 = code.slant as f32 * (steps[3] * fine) * l22;
        Self { size: s, cholesky: [l11, l21, l22] }
    }

    /// How many plain bits the position in this cell has along each axis.
    fn position_bits(&self, steps: &Steps, exponent: u32, cell: &Cell) -> [u32; 2] {
        [0, 1].map(|axis| {
            let l = self.cholesky[2 * axis];
            let d = ((steps[0] * fine(exponent)) * l) * core::f32::consts::SQRT_2;
            let exponent = (d.to_bits() >> 23) as i32 - 127;
            // The position interval is 2^-f pixels.
            let f = (-exponent).min(6);
            (f + cell.sides[axis].ilog2() as i32).max(0) as u32
        })
    }
}

/// The units between the middles of the parts of a cell, of which there are 2^bits.
fn part(cell: &Cell, axis: usize, bits: u32) -> u32 {
    (cell.sides[axis] * 128) >> bits
}

/// The symbols and plain bits of a layer; brings `layer` into the order of the tree, and its centres to
/// where a decoder finds them.
pub(crate) fn write(sides: [u32; 2], steps: &Steps, layer: &mut Vec<Code>) -> Vec<Op> {
    let grid = Grid::new(sides);
    let (mut encoder, mut done) = (Encoder::default(), Vec::new());
    write_cell(&mut encoder, &grid, steps, grid.whole(), core::mem::take(layer), &mut done);
    *layer = done;
    encoder.ops
}

fn write_cell(
    encoder: &mut Encoder,
    grid: &Grid,
    steps: &Steps,
    cell: Cell,
    codes: Vec<Code>,
    done: &mut Vec<Code>,
) {
    let count = codes.len() as u32;
    if cell.is_split(grid, count) {
        let parts = cell.parts(grid);
        let (first, second): (Vec<Code>, Vec<Code>) =
            codes.into_iter().partition(|code| parts[0].holds(code.center));
        write_count(encoder, count, first.len() as u32);
        for (part, codes) in parts.into_iter().zip([first, second]) {
            if !codes.is_empty() {
                write_cell(encoder, grid, steps, part, codes, done);
            }
        }
        return;
    }
    for mut code in codes {
        assert!(cell.holds(code.center), "{code:?} is outside the grid");
        write_code(encoder, steps, &cell, &mut code);
        done.push(code);
    }
}

fn write_count(encoder: &mut Encoder, count: u32, first: u32) {
    if count < 16 {
        encoder.symbol(157 + count, first);
        return;
    }
    let number = u64::from(first);
    let symbol = (0..16).find(|&s| number <= count_range(s, count)[1]).expect("at most `count`");
    let range = count_range(symbol, count);
    encoder.symbol(173 + count.ilog2(), symbol);
    encoder.bits(range_bits(range), (number - range[0]) as u32);
}

fn write_code(encoder: &mut Encoder, steps: &Steps, cell: &Cell, code: &mut Code) {
    let exponent = code.exponent;
    encoder.symbol(0, exponent);
    let shift = exponent.saturating_sub(3);
    let first = code.axes[0];
    let h = first.unsigned_abs() >> shift;
    encoder.symbol(1 + exponent, h.min(15));
    if h >= 15 {
        encoder.excess(h as i32 - 15);
    }
    encoder.bits(shift, first.unsigned_abs() & ((1 << shift) - 1));
    if first != 0 {
        encoder.bits(1, u32::from(first < 0));
    }
    for axis in 1..code.axes.len() {
        let context = axis_context(axis, exponent, code.axes[axis - 1]);
        let value = code.axes[axis];
        encoder.signed(context, shift, if first < 0 { -value } else { value });
    }
    let (r, shift) = (exponent.min(2), exponent.saturating_sub(2));
    encoder.signed(129 + r, shift, code.size);
    encoder.signed(132 + r, shift, code.ratio);
    encoder.signed(slant_context(exponent, code.ratio), shift, code.slant);

    let size = code.size.wrapping_add(expected_size(steps, exponent, cell.level()));
    let bits = Shape::new(steps, code, size).position_bits(steps, exponent, cell);
    for (axis, bits) in bits.into_iter().enumerate() {
        let part = part(cell, axis, bits);
        let corner = cell.corner[axis] * 128;
        let p = (code.center[axis] - corner) / part;
        encoder.bits(bits, p);
        code.center[axis] = corner + p * part + part / 2;
    }
}

/// What a reader finds in a layer.
#[derive(Clone, Debug, Default)]
pub(crate) struct Layer {
    pub(crate) ops: Vec<Op>,
    /// The state before each of them, and after the last.
    pub(crate) states: Vec<u32>,
    pub(crate) codes: Vec<Code>,
    /// x, y, l11, l21, l22 and the amplitudes of each Gaussian.
    pub(crate) values: Vec<Vec<f32>>,
}

/// Reads a layer of so many Gaussians.
pub(crate) fn read(
    sides: [u32; 2],
    steps: &Steps,
    count: u32,
    bytes: &[u8],
) -> Result<Layer, Flaw> {
    if u64::from(count) > 4 * bytes.len() as u64 {
        return Err("more than four Gaussians for each byte");
    }
    let mut decoder = Decoder::new(bytes)?;
    let grid = Grid::new(sides);
    let mut layer = Layer::default();
    read_cell(&mut decoder, &grid, steps, grid.whole(), count, &mut layer)?;
    decoder.end()?;
    (layer.ops, layer.states) = (decoder.ops, decoder.states);
    Ok(layer)
}

fn read_cell(
    decoder: &mut Decoder<'_>,
    grid: &Grid,
    steps: &Steps,
    cell: Cell,
    count: u32,
    layer: &mut Layer,
) -> Result<(), Flaw> {
    if cell.is_split(grid, count) {
        let first = read_count(decoder, count)?;
        for (part, count) in cell.parts(grid).into_iter().zip([first, count - first]) {
            if count > 0 {
                read_cell(decoder, grid, steps, part, count, layer)?;
            }
        }
        return Ok(());
    }
    for _ in 0..count {
        let (code, values) = read_code(decoder, grid, steps, &cell)?;
        layer.codes.push(code);
        layer.values.push(values);
    }
    Ok(())
}

fn read_count(decoder: &mut Decoder<'_>, count: u32) -> Result<u32, Flaw> {
    if count < 16 {
        let first = decoder.symbol(157 + count)?;
        return if first <= count { Ok(first) } else { Err("a part with more than the whole") };
    }
    let range = count_range(decoder.symbol(173 + count.ilog2())?, count);
    let number = range[0] + u64::from(decoder.bits(range_bits(range))?);
    if number <= range[1] { Ok(number as u32) } else { Err("a count beyond its range") }
}

fn read_code(
    decoder: &mut Decoder<'_>,
    grid: &Grid,
    steps: &Steps,
    cell: &Cell,
) -> Result<(Code, Vec<f32>), Flaw> {
    let exponent = decoder.symbol(0)?;
    if exponent > 7 {
        return Err("an exponent over 7");
    }
    let shift = exponent.saturating_sub(3);
    let mut first = decoder.symbol(1 + exponent)? as i32;
    if first == 15 {
        first += decoder.excess()?;
    }
    first = first.wrapping_mul(1 << shift).wrapping_add(decoder.bits(shift)? as i32);
    let negative = first != 0 && decoder.bits(1)? == 1;
    let signed = |value: i32| if negative { value.wrapping_neg() } else { value };
    let mut axes = vec![signed(first)];
    for axis in 1..steps.len() - 4 {
        let context = axis_context(axis, exponent, axes[axis - 1]);
        axes.push(signed(decoder.signed(context, shift)?));
    }
    let (r, shift) = (exponent.min(2), exponent.saturating_sub(2));
    let size = decoder.signed(129 + r, shift)?;
    let ratio = decoder.signed(132 + r, shift)?;
    let slant = decoder.signed(slant_context(exponent, ratio), shift)?;
    let mut code = Code { exponent, axes, size, ratio, slant, center: [0; 2] };

    let whole_size = size.wrapping_add(expected_size(steps, exponent, cell.level()));
    let shape = Shape::new(steps, &code, whole_size);
    let bits = shape.position_bits(steps, exponent, cell);
    for (axis, bits) in bits.into_iter().enumerate() {
        let part = part(cell, axis, bits);
        code.center[axis] = cell.corner[axis] * 128 + decoder.bits(bits)? * part + part / 2;
    }
    let values = values(grid, steps, &code, &shape);
    Ok((code, values))
}

/// Section 7.5.
fn values(grid: &Grid, steps: &Steps, code: &Code, shape: &Shape) -> Vec<f32> {
    let root = (grid.root * 128) as i32;
    let center = code.center.map(|units| (units as i32 - root) as f32 / 128.0);
    let mut axes = [0.0; 4];
    for ((axis, &code), &step) in axes.iter_mut().zip(&code.axes).zip(&steps[4..]) {
        *axis = code as f32 * (step / shape.size);
    }
    let channels = code.axes.len();
    if channels > 2 {
        let [a, b, c, d] = [0.577_350_26, 0.707_106_77, 0.408_248_3, -0.816_496_6];
        let [u, v, w, alpha] = axes;
        let red = a * u + b * v + c * w;
        let green = a * u + 0.0 * v + d * w;
        let blue = a * u - b * v + c * w;
        axes = [red, green, blue, alpha];
    }
    [&center[..], &shape.cholesky, &axes[..channels]].concat()
}
