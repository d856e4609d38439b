//! The chunk `tXTR` (section 5.7), written from `spec/gip.md` alone.

use super::entropy::{self, Code, Grid};
use super::rans::{self, Flaw};
use super::{number, read_number, steps};

/// The Gaussians of a map.
#[derive(Clone, Debug)]
pub(crate) struct Texture {
    /// Of the three colour axes.
    pub(crate) step: f32,
    pub(crate) codes: Vec<Code>,
}

/// The sides of the map of a picture with these sides.
pub(crate) fn map_sides(sides: [u32; 2]) -> [u32; 2] {
    sides.map(|side| side.div_ceil(8) + 1)
}

/// All steps of the layer in `tXTR`.
pub(crate) fn steps(step: f32) -> Vec<f32> {
    [&steps::usual_geometry()[..], &[step; 3]].concat()
}

/// The colour axes of a Gaussian that adds this much to the sums: the columns of the matrix of section 7.5 are
/// orthonormal.
pub(crate) fn axes([m0, m1, m2]: [f32; 3]) -> [f32; 3] {
    let [a, b, c, d] = [0.577_350_26, 0.707_106_77, 0.408_248_3, -0.816_496_6_f32];
    [a * (m0 + m1 + m2), b * (m0 - m2), c * (m0 + m2) + d * m1]
}

impl Texture {
    /// A map with these sums at every node: one Gaussian so wide that it is flat.
    pub(crate) fn constant(sides: [u32; 2], [m0, m1, m2]: [f32; 3]) -> Self {
        let map = map_sides(sides);
        let center = Grid::new(map).units(map.map(|side| side as f32 / 2.0));
        let code = Code { exponent: 2, axes: vec![1, 0, 0], size: 60, center, ..Code::default() };
        let mut texture = Self { step: 64.0, codes: vec![code] };
        // What a step of an axis is worth depends on the size of the cell in which the Gaussian ends up.
        let values = read(sides, &texture.payload(sides)).expect("what was just written");
        let [unit, ..] = axes([5, 6, 7].map(|color| values[0][color]));
        let axes = axes([m0, m1, m2 - 0.5]).map(|axis| (axis / unit).round() as i32);
        texture.codes[0].axes = axes.to_vec();
        texture
    }

    /// The payload of `tXTR` in a picture with these sides.
    pub(crate) fn payload(&self, sides: [u32; 2]) -> Vec<u8> {
        let ops = entropy::write(map_sides(sides), &steps(self.step), &mut self.codes.clone());
        with_count(self.step, self.codes.len() as u32, &rans::encode(&ops))
    }
}

/// The payload of `tXTR` with this step, number of Gaussians, and bytes in which they are coded.
pub(crate) fn with_count(step: f32, count: u32, bytes: &[u8]) -> Vec<u8> {
    [&steps::code(step).to_le_bytes()[..], &number(count), bytes].concat()
}

/// The components of the map's Gaussians.
pub(crate) fn read(sides: [u32; 2], payload: &[u8]) -> Result<Vec<Vec<f32>>, Flaw> {
    let (code, rest) = payload.split_first_chunk().ok_or("no step")?;
    let code = u16::from_le_bytes(*code);
    if code > steps::MOST {
        return Err("a step out of range");
    }
    let (count, bytes) = read_number(rest).ok_or("no count")?;
    let sides = map_sides(sides);
    if count == 0 {
        return Err("no Gaussians");
    }
    if u64::from(count) > u64::from(sides[0]) * u64::from(sides[1]) {
        return Err("more Gaussians than nodes");
    }
    Ok(entropy::read(sides, &steps(steps::step(code)), count, bytes)?.values)
}
