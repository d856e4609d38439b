//! Files of the entropy coding, by the coder that the tests have from the specification alone.

use arbitrary::Arbitrary;
use image_gip::{DecodeError, StreamDecoder};

use crate::entropy::{self, Code, Grid};
use crate::rans;
use crate::texture::{self, map_sides};

/// What an entropy-coded file has instead of quantizers and packed codes.
#[derive(Arbitrary, Debug)]
pub struct EntropyCoded {
    steps: [Step; 8],
    layers: Vec<Layer>,
}

#[derive(Arbitrary, Debug)]
struct Step {
    exponent: u8,
    mantissa: u8,
}

/// What `tXTR` holds, whose layer is one of the entropy coding.
#[derive(Arbitrary, Debug)]
pub struct Map {
    step: Step,
    layer: Layer,
}

#[derive(Arbitrary, Debug)]
enum Layer {
    Gaussians(Vec<Gaussian>),
    /// What follows a count of one more.
    Bytes(u8, Vec<u8>),
}

/// Few bytes, so that many come together.
#[derive(Arbitrary, Debug)]
struct Gaussian {
    exponent: u8,
    axes: [Number; 4],
    size: Number,
    ratio: Number,
    slant: Number,
    /// In 2^-16 of the sides of the grid.
    center: [u16; 2],
}

/// Small or large.
#[derive(Arbitrary, Debug)]
struct Number(i8);

impl EntropyCoded {
    /// The payload of `QNTZ`.
    pub fn quantizers(&self, channels: usize) -> Vec<u8> {
        self.steps(channels).into_iter().flat_map(f32::to_le_bytes).collect()
    }

    /// The payloads of `GAUS`, each with its number of Gaussians.
    pub fn layers(&self, sides: [u32; 2], channels: usize) -> Vec<(u32, Vec<u8>)> {
        let steps = self.steps(channels);
        let filled = |layer: &&Layer| !matches!(layer, Layer::Gaussians(all) if all.is_empty());
        let layers = self.layers.iter().filter(filled);
        layers.map(|layer| layer.payload(sides, &steps, channels)).collect()
    }

    /// Checks that a decoder made of the layers what the tests' coder makes of them.
    pub fn check(
        &self,
        sides: [u32; 2],
        channels: usize,
        decoder: &StreamDecoder,
        error: Option<&DecodeError>,
    ) {
        if matches!(error, Some(DecodeError::Limit { .. })) {
            return;
        }
        let steps = self.steps(channels);
        let (mut values, mut flaw) = (Vec::new(), None);
        for (_, payload) in self.layers(sides, channels) {
            match entropy::read(sides, &steps, &payload) {
                Ok(layer) => values.extend(layer.values.concat()),
                Err(found) => {
                    flaw = Some(found);
                    break;
                }
            }
        }
        assert_eq!(error.is_some(), flaw.is_some(), "{error:?}; expected was {flaw:?}");
        let found = decoder.gaussians().iter().flat_map(|gaussian| {
            let shape = gaussian.center.iter().chain(&gaussian.cholesky);
            shape.chain(&gaussian.color[..channels])
        });
        let differs = found.map(|value| value.to_bits()).ne(values.iter().map(|v| v.to_bits()));
        assert!(!differs, "the Gaussians differ");
    }

    fn steps(&self, channels: usize) -> Vec<f32> {
        self.steps[..4 + channels].iter().map(Step::value).collect()
    }
}

impl Layer {
    /// Its number of Gaussians, and its payload.
    fn payload(&self, sides: [u32; 2], steps: &[f32], channels: usize) -> (u32, Vec<u8>) {
        let (count, bytes) = match self {
            Self::Bytes(count, bytes) => (u32::from(*count) + 1, bytes.clone()),
            Self::Gaussians(gaussians) => {
                let code = |gaussian: &Gaussian| gaussian.code(sides, channels);
                let mut codes: Vec<Code> = gaussians.iter().map(code).collect();
                let ops = entropy::write(sides, steps, &mut codes);
                (codes.len() as u32, rans::encode(&ops))
            }
        };
        (count, [&count.to_le_bytes()[..], &bytes].concat())
    }
}

impl Map {
    /// The payload of `tXTR` in a picture with these sides.
    pub fn payload(&self, sides: [u32; 2]) -> Vec<u8> {
        let step = self.step.value();
        let (_, layer) = self.layer.payload(map_sides(sides), &texture::steps(step), 3);
        [&step.to_le_bytes()[..], &layer].concat()
    }

    /// Whether the tests' coder reads it.
    pub fn is_sound(&self, sides: [u32; 2]) -> bool {
        texture::read(sides, &self.payload(sides)).is_ok()
    }
}

impl Step {
    /// From 2^-20 to 2^10.
    fn value(&self) -> f32 {
        let exponent = i32::from(self.exponent % 31) - 20;
        ((1.0 + f32::from(self.mantissa) / 256.0) * (exponent as f32).exp2()).min(1024.0)
    }
}

impl Gaussian {
    fn code(&self, sides: [u32; 2], channels: usize) -> Code {
        let grid = Grid::new(sides);
        let center = |axis: usize| {
            let side = u64::from(grid.roots[axis] * grid.root * 128);
            (side * u64::from(self.center[axis]) >> 16) as u32
        };
        Code {
            exponent: u32::from(self.exponent % 8),
            axes: self.axes[..channels].iter().map(Number::value).collect(),
            size: self.size.value(),
            ratio: self.ratio.value(),
            slant: self.slant.value(),
            center: [center(0), center(1)],
        }
    }
}

impl Number {
    /// Within the 65,542 that symbols and their excess can say with every exponent.
    fn value(&self) -> i32 {
        let value = i32::from(self.0);
        if value.abs() < 64 { value } else { value * value * value / 32 }
    }
}
