//! A layer of the entropy coding: the number of its Gaussians, then the Gaussians in the order of a
//! k-d tree of cells (spec, section 7.4).

use core::ops::Range;

#[cfg(feature = "encode")]
use alloc::vec::Vec;

#[cfg(all(feature = "std", any(target_arch = "x86", target_arch = "x86_64")))]
use fearless_simd::{Level, Simd};

use super::attributes;
use super::cells::{Cell, CenterGrid};
use super::numbers::plain;
use super::quantization::{Code, Quantization, Shape};
use super::rans::{Attribute, RansDecoder, SymbolCoder};
#[cfg(feature = "encode")]
use super::rans::{CostCounter, Model, RansEncoder, SymbolCosts};
use super::statistics::AttributeBits;
#[cfg(feature = "std")]
use super::statistics::CountingDecoder;
#[cfg(all(feature = "std", any(target_arch = "x86", target_arch = "x86_64")))]
use super::symbol::Avx2Search;
use super::symbol::SymbolSearch;
use super::tables;
use super::tree_walk::{self, TreeGaussians};
use crate::chunk::ChunkType;
use crate::color::ColorModel;
use crate::error::DecodeError;
use crate::gaussian::Gaussian;

/// Most Gaussians per byte. A layer that declares more is refused before time is spent on it.
const MAX_PER_BYTE: usize = 4;

/// An encoded layer.
#[cfg(feature = "encode")]
#[derive(Debug)]
pub(crate) struct EncodedLayer {
    /// The coded Gaussians.
    pub(crate) bytes: Vec<u8>,
    /// For each Gaussian, the level of its cell.
    pub(crate) levels: Vec<u32>,
    /// The costs of symbols with the models as they are after the last Gaussian.
    pub(crate) costs: SymbolCosts,
}

#[cfg(feature = "encode")]
impl EncodedLayer {
    /// The number of its Gaussians.
    pub(crate) fn count(&self) -> usize {
        self.levels.len()
    }
}

/// Reads and writes layers, and computes the cost of Gaussians in them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LayerCoder<'a> {
    pub(crate) quantization: &'a Quantization,
    pub(crate) grid: CenterGrid,
    pub(crate) channels: usize,
}

impl<'a> LayerCoder<'a> {
    /// For the layers of a picture of this width, height and colour model.
    pub(crate) fn new(
        quantization: &'a Quantization,
        [width, height]: [u32; 2],
        color: ColorModel,
    ) -> Self {
        let grid = CenterGrid::new(width, height);
        Self { quantization, grid, channels: color.channels() }
    }

    /// Checks that a layer may have `count` Gaussians in these bytes.
    pub(crate) fn check_count(count: u32, bytes: &[u8]) -> Result<(), DecodeError> {
        if count as usize > bytes.len().saturating_mul(MAX_PER_BYTE) {
            return Err(DecodeError::malformed(
                ChunkType::LAYER,
                "too short for its number of Gaussians",
            ));
        }
        Ok(())
    }

    /// Reads as many Gaussians as `out` has elements, of a picture with this colour model. They are to be dropped if
    /// the result is an error: see [`LayerCoder::read`], of which this is the one use in a decoder, so that there
    /// is no second copy of its code.
    pub(crate) fn read_gaussians(
        &self,
        bytes: &[u8],
        statistics: Option<&mut AttributeBits>,
        model: ColorModel,
        out: &mut [Gaussian],
    ) -> Result<(), DecodeError> {
        let count = out.len();
        let mut out = out.iter_mut();
        self.read(count, bytes, statistics, |code, shape| {
            if let Some(gaussian) = out.next() {
                *gaussian = self.quantization.gaussian(&code, shape, &self.grid, model);
            }
        })
    }

    /// Reads `count` Gaussians and passes the code and shape of each on, in the order of the file.
    /// They are to be dropped if the result is an error: that the bytes are malformed is known at
    /// the end only. Adds to `statistics` if they are given.
    #[cfg_attr(not(feature = "std"), expect(clippy::needless_pass_by_value))]
    fn read(
        &self,
        count: usize,
        bytes: &[u8],
        statistics: Option<&mut AttributeBits>,
        receive: impl FnMut(Code, &Shape),
    ) -> Result<(), DecodeError> {
        let mut models = tables::initial_models();
        #[cfg(feature = "std")]
        if let Some(statistics) = statistics {
            let decoder = RansDecoder::new(bytes, &mut models);
            let mut counting = CountingDecoder::new(decoder, statistics);
            self.read_with(&mut counting, count, receive);
            return check_complete(&counting.into_decoder());
        }
        #[cfg(not(feature = "std"))]
        let _ = statistics;
        #[cfg(all(feature = "std", any(target_arch = "x86", target_arch = "x86_64")))]
        if let Some(avx2) = Level::new().as_avx2() {
            return avx2.vectorize(
                #[inline(always)]
                || {
                    let mut decoder =
                        RansDecoder::with_search(bytes, &mut models, Avx2Search(avx2));
                    self.read_with(&mut decoder, count, receive);
                    check_complete(&decoder)
                },
            );
        }
        let mut decoder = RansDecoder::new(bytes, &mut models);
        self.read_with(&mut decoder, count, receive);
        check_complete(&decoder)
    }

    /// Reads `count` Gaussians from a decoder, and passes the code and shape of each on.
    #[inline(always)]
    pub(super) fn read_with(
        &self,
        decoder: &mut impl SymbolCoder,
        count: usize,
        receive: impl FnMut(Code, &Shape),
    ) {
        tree_walk::walk(decoder, &self.grid, count, &mut UnknownGaussians { layer: self, receive });
    }

    /// Encodes a layer. Sorts the codes into the order of the file, and moves their centres to the
    /// middles of their position intervals, as a decoder reads them.
    #[cfg(feature = "encode")]
    pub(crate) fn write(&self, codes: &mut [Code]) -> EncodedLayer {
        let (mut models, mut levels) = (tables::initial_models(), Vec::with_capacity(codes.len()));
        let mut encoder = RansEncoder::new(&mut models);
        let count = codes.len();
        let (levels_of, scratch) = (&mut levels, Vec::new());
        let mut gaussians = KnownGaussians { layer: self, codes, levels: levels_of, scratch };
        tree_walk::walk(&mut encoder, &self.grid, count, &mut gaussians);
        let bytes = encoder.finish();
        let costs = models.iter().map(Model::costs).collect();
        EncodedLayer { bytes, levels, costs }
    }

    /// Moves the `first` codes in the order of the tree to the front, in any order.
    #[cfg(feature = "encode")]
    pub(crate) fn cut(&self, codes: &mut [Code], first: usize) {
        let (mut range, mut scratch) = (0..codes.len(), Vec::new());
        // Down the tree to the cell that the cut goes through.
        let mut narrow = |axis, middle| {
            let middle =
                range.start + partition(&mut codes[range.clone()], axis, middle, &mut scratch);
            let second = usize::from(middle <= first);
            range = if middle <= first { middle..range.end } else { range.start..middle };
            (second, range.start == first)
        };
        let mut roots = self.grid.whole();
        let mut cell = loop {
            match self.grid.split(&roots) {
                Ok(split) => {
                    let (part, done) = narrow(split.axis, split.middle);
                    if done {
                        return;
                    }
                    roots = split.parts[part];
                }
                Err(root) => break root,
            }
        };
        while let Some(split) = cell.split() {
            let (part, done) = narrow(split.axis, split.middle);
            if done {
                return;
            }
            cell = split.parts[part];
        }
    }

    /// The cost in bits of a code with this shape in a cell of a level, without its amplitudes, which
    /// [`LayerCoder::color_cost`] tells, and without the counts of the tree.
    #[cfg(feature = "encode")]
    pub(crate) fn geometry_cost(
        &self,
        code: &Code,
        shape: &Shape,
        level: u32,
        costs: &SymbolCosts,
    ) -> f32 {
        let mut cost = CostCounter { costs, bits: 0.0 };
        attributes::precision(&mut cost, code.exponent);
        let values = [code.size, code.ratio, code.slant];
        attributes::shape(&mut cost, self.quantization, level, code.exponent, values);
        let fraction_bits = self.quantization.fraction_bits(code.exponent, shape);
        // Cells are square, or twice as high as wide.
        let sides = [level / 2, level.div_ceil(2)].map(|side| side as i32);
        let bits = sides.iter().zip(fraction_bits).map(|(&side, bits)| (side + bits).max(0));
        cost.bits + bits.sum::<i32>() as f32
    }

    /// The cost in bits of the amplitudes of a code.
    #[cfg(feature = "encode")]
    pub(crate) fn color_cost(&self, code: &Code, costs: &SymbolCosts) -> f32 {
        let mut cost = CostCounter { costs, bits: 0.0 };
        attributes::color(&mut cost, self.channels, code.exponent as usize, code.color);
        cost.bits
    }

    /// Codes a Gaussian that lies in a cell.
    #[inline(always)]
    fn gaussian(&self, coder: &mut impl SymbolCoder, cell: &Cell, known: Code) -> (Code, Shape) {
        let mut code = self.attributes(coder, cell.level, known);
        let shape = self.quantization.shape(&code);
        let fraction_bits = self.quantization.fraction_bits(code.exponent, &shape);
        coder.begin(Attribute::Position);
        let bits = cell.position_bits(fraction_bits);
        code.center = core::array::from_fn(|axis| {
            let part = cell.part(axis, bits[axis], known.center[axis]);
            let part = plain(coder, bits[axis], part);
            cell.middle(axis, bits[axis], part)
        });
        (code, shape)
    }

    #[inline(always)]
    fn attributes(&self, coder: &mut impl SymbolCoder, level: u32, known: Code) -> Code {
        attributes::attributes(coder, self.quantization, self.channels, level, known)
    }
}

/// An error if a decoder has read malformed bytes, or has not come to their end.
#[inline(always)]
fn check_complete<S: SymbolSearch>(decoder: &RansDecoder<'_, S>) -> Result<(), DecodeError> {
    if decoder.is_complete() {
        return Ok(());
    }
    Err(DecodeError::malformed(ChunkType::LAYER, "invalid entropy-coded data"))
}

/// The Gaussians that a decoder is about to read.
struct UnknownGaussians<'a, F> {
    layer: &'a LayerCoder<'a>,
    receive: F,
}

impl<F: FnMut(Code, &Shape)> TreeGaussians for UnknownGaussians<'_, F> {
    fn partition(&mut self, _: Range<usize>, _: usize, _: u32) -> usize {
        0
    }

    #[inline(always)]
    fn code(&mut self, coder: &mut impl SymbolCoder, _: usize, cell: &Cell) {
        let (code, shape) = self.layer.gaussian(coder, cell, Code::default());
        (self.receive)(code, &shape);
    }
}

/// The Gaussians that an encoder writes.
#[cfg(feature = "encode")]
struct KnownGaussians<'a> {
    layer: &'a LayerCoder<'a>,
    codes: &'a mut [Code],
    /// The level of the cell of each Gaussian that was written.
    levels: &'a mut Vec<u32>,
    /// Memory for [`partition`].
    scratch: Vec<Code>,
}

#[cfg(feature = "encode")]
impl TreeGaussians for KnownGaussians<'_> {
    fn partition(&mut self, range: Range<usize>, axis: usize, middle: u32) -> usize {
        partition(&mut self.codes[range], axis, middle, &mut self.scratch)
    }

    #[inline(always)]
    fn code(&mut self, coder: &mut impl SymbolCoder, index: usize, cell: &Cell) {
        (self.codes[index], _) = self.layer.gaussian(coder, cell, self.codes[index]);
        self.levels.push(cell.level);
    }
}

/// Moves the codes whose centre lies before `middle` along an axis to the front, without another
/// change of the order. Returns how many they are. `scratch` is memory that calls share.
#[cfg(feature = "encode")]
fn partition(codes: &mut [Code], axis: usize, middle: u32, scratch: &mut Vec<Code>) -> usize {
    scratch.clear();
    let mut first = 0;
    for index in 0..codes.len() {
        let code = codes[index];
        if code.center[axis] < middle {
            codes[first] = code;
            first += 1;
        } else {
            scratch.push(code);
        }
    }
    codes[first..].copy_from_slice(scratch);
    first
}

#[cfg(all(test, feature = "encode"))]
mod tests {
    use super::*;
    use crate::coding::entropy::quantization::MAX_EXPONENT;
    use crate::testing::config;
    use proptest::prelude::*;

    fn codes(channels: usize) -> impl Strategy<Value = Vec<Code>> {
        let value = prop_oneof![-3_i32..3, -40_i32..40, -60_000_i32..60_000];
        let geometry = [value.clone(), value.clone(), value.clone()];
        let center = [0_u32..98_304, 0_u32..65_536];
        let code = (0..=MAX_EXPONENT, prop::collection::vec(value, channels), geometry, center);
        let code = code.prop_map(|(exponent, axes, [size, ratio, slant], center)| {
            let mut color = [0; 4];
            color[..axes.len()].copy_from_slice(&axes);
            Code { exponent, color, size, ratio, slant, center }
        });
        prop::collection::vec(code, 1..80)
    }

    fn quantization(channels: usize) -> Quantization {
        let color = vec![0.1; channels];
        Quantization::new([1.25, 0.66, 0.9, 1.9], color)
    }

    fn coder(quantization: &Quantization) -> LayerCoder<'_> {
        LayerCoder {
            quantization,
            grid: CenterGrid::new(700, 400),
            channels: quantization.color.len(),
        }
    }

    proptest! {
        #![proptest_config(config(200))]

        #[test]
        fn what_is_written_is_read(
            (channels, mut codes) in (1_usize..=4).prop_flat_map(|n| (Just(n), codes(n))),
        ) {
            let quantization = quantization(channels);
            let coder = coder(&quantization);
            let sent = codes.clone();
            let EncodedLayer { bytes, levels, .. } = coder.write(&mut codes);
            prop_assert_eq!(levels.len(), codes.len());
            // Centres move within their position intervals, all else stays.
            let sorted = |codes: &[Code]| {
                let key = |c: &Code| (c.exponent, c.color, c.size, c.ratio, c.slant);
                let mut keys: Vec<_> = codes.iter().map(key).collect();
                keys.sort_unstable();
                keys
            };
            prop_assert_eq!(sorted(&sent), sorted(&codes));
            let mut read = Vec::new();
            let count = codes.len();
            LayerCoder::check_count(count as u32, &bytes).expect("the count is right");
            coder.read(count, &bytes, None, |code, _| read.push(code)).expect("the layer is valid");
            prop_assert_eq!(&read, &codes);
            // The centres stay where they are when they are written again.
            prop_assert_eq!(coder.write(&mut codes).bytes, bytes);
        }

        #[test]
        fn a_cut_follows_the_order_of_the_file(mut codes in codes(3), share in 0.0..=1.0) {
            let quantization = quantization(3);
            let coder = coder(&quantization);
            coder.write(&mut codes);
            let first = (share * codes.len() as f64) as usize;
            // Gaussians in the same pixel have no order.
            let pixels = |codes: &[Code]| {
                let mut pixels: Vec<_> =
                    codes.iter().map(|code| code.center.map(|unit| unit / 128)).collect();
                pixels.sort_unstable();
                pixels
            };
            let (front, back) = (pixels(&codes[..first]), pixels(&codes[first..]));
            codes.reverse();
            coder.cut(&mut codes, first);
            prop_assert_eq!(pixels(&codes[..first]), front);
            prop_assert_eq!(pixels(&codes[first..]), back);
        }

        #[test]
        fn a_layer_has_the_declared_number_of_gaussians_whatever_its_bytes(
            bytes in prop::collection::vec(any::<u8>(), 0..400),
            count in 1_u32..2000,
        ) {
            let quantization = quantization(3);
            let coder = coder(&quantization);
            let is_allowed = count <= 1000 && count as usize <= 4 * bytes.len();
            if is_allowed {
                prop_assert!(LayerCoder::check_count(count, &bytes).is_ok());
                let (declared, rest) = (count as usize, &bytes[..]);
                let mut codes = Vec::new();
                let read = coder.read(declared, rest, None, |code, _| codes.push(code));
                // All arrive, also those of a malformed layer.
                prop_assert_eq!(codes.len(), declared);
                let sides = coder.grid.whole().sides;
                for code in &codes {
                    prop_assert!(code.exponent <= MAX_EXPONENT, "{:?}", code);
                    prop_assert!((0..2).all(|axis| code.center[axis] < sides[axis]), "{:?}", code);
                }
                // A state and whole words.
                prop_assert!(read.is_err() || bytes.len() >= 4 && bytes.len() % 2 == 0);
            }
        }
    }
}
