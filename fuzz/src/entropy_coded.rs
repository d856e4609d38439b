//! Files of the entropy coding, by the coder that the tests have from the specification alone.

use arbitrary::Arbitrary;
use image_gip::{DecodeError, StreamDecoder};

use crate::entropy::{self, Code, Grid};
use crate::number;
use crate::rans;
use crate::steps;
use crate::texture::{self, map_sides};

/// What an entropy-coded file has instead of quantizers and packed codes.
#[derive(Arbitrary, Debug)]
pub struct EntropyCoded {
    /// Of the first colour axis.
    step: Step,
    /// Of the steps of the other colour axes to it, in the code of section 5.3.
    ratios: [u8; 3],
    /// Of position, size, ratio and slant, if they are not the usual ones.
    geometry: Option<[Step; 4]>,
    layers: Vec<Layer>,
}

/// In the code of section 5.3, in which the upper ones are over 2^10.
#[derive(Arbitrary, Debug)]
struct Step(u16);

/// What `tXTR` holds, whose Gaussians are coded as those of a layer of the entropy coding.
#[derive(Arbitrary, Debug)]
pub struct Map {
    step: Step,
    layer: Layer,
}

#[derive(Arbitrary, Debug)]
enum Layer {
    Gaussians(Vec<Gaussian>),
    /// One Gaussian more than the number says, in any bytes.
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
    /// Whether the header says the steps of geometry.
    pub fn has_geometry(&self) -> bool {
        self.geometry.is_some()
    }

    /// The steps in the header.
    pub fn fields(&self, channels: usize) -> Vec<u8> {
        let mut fields = self.step.bytes().to_vec();
        fields.extend(&self.ratios[..channels - 1]);
        fields.extend(self.geometry.iter().flatten().flat_map(Step::bytes));
        fields
    }

    /// The number of Gaussians in each layer, and the bytes in which they are coded.
    pub fn layers(&self, sides: [u32; 2], channels: usize) -> Vec<(u32, Vec<u8>)> {
        let steps = self.steps(channels);
        let filled = |layer: &&Layer| !matches!(layer, Layer::Gaussians(all) if all.is_empty());
        let layers = self.layers.iter().filter(filled);
        layers.map(|layer| layer.coded(sides, &steps, channels)).collect()
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
        let (steps, layers) = (self.steps(channels), self.layers(sides, channels));
        let range = steps::step(steps::LEAST)..=steps::step(steps::MOST);
        if !layers.is_empty() && !steps.iter().all(|step| range.contains(step)) {
            assert!(error.is_some(), "a step that is out of range was not noticed");
            return;
        }
        let (mut values, mut flaw) = (Vec::new(), None);
        for (count, bytes) in layers {
            match entropy::read(sides, &steps, count, &bytes) {
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

    /// All steps, of which some may be out of range.
    fn steps(&self, channels: usize) -> Vec<f32> {
        let first = self.step.value();
        let geometry = match &self.geometry {
            Some(steps) => steps.each_ref().map(Step::value),
            None => steps::usual_geometry(),
        };
        let related = self.ratios[..channels - 1].iter().map(|&code| first * steps::ratio(code));
        geometry.into_iter().chain([first]).chain(related).collect()
    }
}

impl Layer {
    /// Its number of Gaussians, and the bytes in which they are coded.
    fn coded(&self, sides: [u32; 2], steps: &[f32], channels: usize) -> (u32, Vec<u8>) {
        match self {
            Self::Bytes(count, bytes) => (u32::from(*count) + 1, bytes.clone()),
            Self::Gaussians(gaussians) => {
                let code = |gaussian: &Gaussian| gaussian.code(sides, channels);
                let mut codes: Vec<Code> = gaussians.iter().map(code).collect();
                let ops = entropy::write(sides, steps, &mut codes);
                (codes.len() as u32, rans::encode(&ops))
            }
        }
    }
}

impl Map {
    /// The payload of `tXTR` in a picture with these sides.
    pub fn payload(&self, sides: [u32; 2]) -> Vec<u8> {
        let steps = texture::steps(self.step.value());
        let (count, bytes) = self.layer.coded(map_sides(sides), &steps, 3);
        [&self.step.bytes()[..], &number(count), &bytes].concat()
    }

    /// Whether the tests' coder reads it.
    pub fn is_sound(&self, sides: [u32; 2]) -> bool {
        texture::read(sides, &self.payload(sides)).is_ok()
    }
}

impl Step {
    fn bytes(&self) -> [u8; 2] {
        self.0.to_le_bytes()
    }

    fn value(&self) -> f32 {
        steps::step(self.0)
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
