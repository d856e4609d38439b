//! A layer of the entropy coding: its Gaussians as a set, in the order of a tree of cells (spec,
//! section 7.4).

use core::ops::Range;

use alloc::vec::Vec;

#[cfg(all(feature = "std", any(target_arch = "x86", target_arch = "x86_64")))]
use fearless_simd::{Level, Simd};

use super::cells::{Cell, CenterGrid, Split};
use super::contexts::{self, CLASSES, FEW_COUNT, LEVELS, MAGNITUDES, RATIOS};
use super::lattice::{self, Code, Lattice, MAX_CLASS, Shape};
use super::rans::{Attribute, MAX_BITS, Model, RansDecoder, SymbolCoder};
#[cfg(feature = "encode")]
use super::rans::{CostCounter, RansEncoder, SymbolCosts};
use super::statistics::AttributeBits;
#[cfg(feature = "std")]
use super::statistics::CountingDecoder;
#[cfg(all(feature = "std", any(target_arch = "x86", target_arch = "x86_64")))]
use super::symbol::Avx2Search;
use super::symbol::{SYMBOLS, SymbolSearch};
use super::tables;
use crate::chunk::ChunkType;
use crate::container::Header;
use crate::error::DecodeError;

/// Bytes of payload before the coded Gaussians: how many they are.
pub(crate) const LAYER_PREFIX: usize = 4;
/// No coded Gaussian is shorter than this on average, in Gaussians per byte: more are refused
/// before time is spent on them.
const MOST_PER_BYTE: usize = 4;

/// Colours are modelled as precisely as class 3 has them.
const COLOR_LEVEL: u32 = 3;
/// The symbol that says that a value is beyond all others.
const BEYOND: u32 = SYMBOLS as u32 - 1;
/// Signed symbols stand for -7 to 7.
const SIGNED: i32 = 7;
/// Parts that may wait: every split, of which each halves a side of 2^32 at most, leaves one more.
const MOST_WAITING: usize = 2 * 32 + 2;
/// The size that a Gaussian is expected to have, from the level of the cell that it has for
/// itself: logarithm for a pixel, and what every doubling of the area adds.
const EXPECTED_SIZE: [f32; 2] = [0.1, 0.19];

/// The models of all contexts, learning within a layer.
#[derive(Clone, Debug)]
pub(crate) struct Models(Vec<Model>);

/// A layer that was coded.
#[cfg(feature = "encode")]
#[derive(Debug)]
pub(crate) struct EncodedLayer {
    pub(crate) payload: Vec<u8>,
    /// Of the cell of each Gaussian.
    pub(crate) levels: Vec<u32>,
    /// What symbols cost by what was learnt.
    pub(crate) costs: SymbolCosts,
}

#[cfg(all(fuzzing, feature = "encode"))]
impl Models {
    pub(super) fn all(&mut self) -> &mut [Model] {
        &mut self.0
    }
}

impl Default for Models {
    fn default() -> Self {
        Self(tables::STARTS.iter().map(|&starts| Model::new(starts)).collect())
    }
}

/// Where the Gaussians of a layer come from or go to.
trait LayerGaussians {
    /// Sorts some by whether they lie before `middle` along an axis; how many do.
    fn partition(&mut self, range: Range<usize>, axis: usize, middle: u32) -> usize;
    /// What is known of one.
    fn get(&self, index: usize) -> Code;
    /// What was coded of one; they come in order.
    fn set(&mut self, index: usize, code: Code, shape: &Shape, cell: &Cell);
}

/// What a layer is coded with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LayerCoder<'a> {
    pub(crate) lattice: &'a Lattice,
    pub(crate) grid: CenterGrid,
    pub(crate) channels: usize,
}

impl<'a> LayerCoder<'a> {
    /// For the pictures of a header.
    pub(crate) fn new(lattice: &'a Lattice, header: &Header) -> Self {
        let grid = CenterGrid::new(header.width, header.height);
        Self { lattice, grid, channels: header.color.channels() }
    }

    /// How many Gaussians a layer has, at most `allowed`, and the bytes that have them.
    pub(crate) fn counted(payload: &[u8], allowed: u32) -> Result<(usize, &[u8]), DecodeError> {
        let malformed = |reason| Err(DecodeError::malformed(ChunkType::GAUS, reason));
        let Some((prefix, bytes)) = payload.split_first_chunk::<LAYER_PREFIX>() else {
            return malformed("too short for a number of Gaussians");
        };
        let count = u32::from_le_bytes(*prefix);
        if count == 0 {
            return malformed("no Gaussians");
        }
        if count > allowed {
            return malformed("more Gaussians than the header declares");
        }
        if count as usize > bytes.len().saturating_mul(MOST_PER_BYTE) {
            return malformed("too short for its number of Gaussians");
        }
        Ok((count as usize, bytes))
    }

    /// Reads so many Gaussians and hands over their codes in order. Adds to an account, if there is
    /// one.
    #[cfg_attr(not(feature = "std"), expect(clippy::needless_pass_by_value))]
    pub(crate) fn read(
        &self,
        count: usize,
        bytes: &[u8],
        account: Option<&mut AttributeBits>,
        receive: impl FnMut(Code, &Shape),
    ) -> Result<(), DecodeError> {
        let mut models = Models::default();
        let mut members = Arriving(receive);
        #[cfg(feature = "std")]
        if let Some(account) = account {
            let decoder = RansDecoder::new(bytes, &mut models.0);
            let mut accounting = CountingDecoder::new(decoder, account);
            self.walk(&mut accounting, count, &mut members);
            return checked(&accounting.into_decoder());
        }
        #[cfg(not(feature = "std"))]
        let _ = account;
        #[cfg(all(feature = "std", any(target_arch = "x86", target_arch = "x86_64")))]
        if let Some(avx2) = Level::new().as_avx2() {
            return avx2.vectorize(
                #[inline(always)]
                || {
                    let mut decoder =
                        RansDecoder::with_search(bytes, &mut models.0, Avx2Search(avx2));
                    self.walk(&mut decoder, count, &mut members);
                    checked(&decoder)
                },
            );
        }
        let mut decoder = RansDecoder::new(bytes, &mut models.0);
        self.walk(&mut decoder, count, &mut members);
        checked(&decoder)
    }

    /// Codes a layer: sorts `codes` as the file has them, and rounds their centres to what it
    /// tells.
    #[cfg(feature = "encode")]
    pub(crate) fn write(&self, codes: &mut [Code]) -> EncodedLayer {
        let (mut models, mut levels) = (Models::default(), Vec::with_capacity(codes.len()));
        let mut payload = (codes.len() as u32).to_le_bytes().to_vec();
        let mut encoder = RansEncoder::new(&mut models.0);
        self.walk(&mut encoder, codes.len(), &mut Given { codes, levels: &mut levels });
        payload.extend(encoder.finish());
        let costs = models.0.iter().map(Model::costs).collect();
        EncodedLayer { payload, levels, costs }
    }

    /// Puts the `first` codes in front that come first in the order of the tree.
    #[cfg(feature = "encode")]
    pub(crate) fn cut(&self, codes: &mut [Code], first: usize) {
        let mut range = 0..codes.len();
        let mut levels = Vec::new();
        let mut known = Given { codes, levels: &mut levels };
        // Down the tree to where the cut is.
        let mut narrow = |axis, middle| {
            let middle = range.start + known.partition(range.clone(), axis, middle);
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

    /// The bits that a code, which stands for a shape, takes in a cell of a level, without its share
    /// of the tree.
    #[cfg(feature = "encode")]
    pub(crate) fn cost(&self, code: Code, shape: &Shape, level: u32, costs: &SymbolCosts) -> f32 {
        let mut cost = CostCounter { costs, bits: 0.0 };
        self.attributes(&mut cost, level, code);
        let fineness = self.lattice.fineness_of_position(code.class, shape);
        // Cells are square, or twice as high as wide.
        let pixels = [level / 2, level.div_ceil(2)].map(|pixels| pixels as i32);
        let bits = pixels.iter().zip(fineness).map(|(&pixels, fine)| (pixels + fine).max(0));
        cost.bits + bits.sum::<i32>() as f32
    }

    /// The bits that the colours of a code take.
    #[cfg(feature = "encode")]
    pub(crate) fn color_cost(&self, code: &Code, costs: &SymbolCosts) -> f32 {
        let mut cost = CostCounter { costs, bits: 0.0 };
        self.color(&mut cost, code.class as usize, code.color);
        cost.bits
    }

    /// Walks through the tree, first parts first: to every root that has Gaussians, and through its
    /// cells.
    #[inline(always)]
    fn walk(&self, coder: &mut impl SymbolCoder, count: usize, members: &mut impl LayerGaussians) {
        coder.begin(Attribute::Position);
        // With how many Gaussians each has. Those that wait have none of those that are done.
        let mut waiting = [(self.grid.whole(), count as u32); MOST_WAITING];
        let (mut length, mut done) = (1, 0);
        while length > 0 {
            length -= 1;
            let (roots, count) = waiting[length];
            match self.grid.split(&roots) {
                Ok(split) => {
                    let counts = counts_of(coder, members, &split, done, count);
                    // The last one comes first.
                    for part in [1, 0] {
                        waiting[length] = (split.parts[part], counts[part]);
                        length += usize::from(counts[part] > 0);
                    }
                }
                Err(root) => done = self.walk_root(coder, root, count, done, members),
            }
        }
    }

    /// Walks through the cells of a root, and codes every Gaussian in the one that it has for
    /// itself. `done` Gaussians came before; returns how many did in the end.
    #[inline(always)]
    fn walk_root(
        &self,
        coder: &mut impl SymbolCoder,
        root: Cell,
        count: u32,
        mut done: usize,
        members: &mut impl LayerGaussians,
    ) -> usize {
        let mut waiting = [(root, 0); MOST_WAITING];
        let mut length = 0;
        let (mut cell, mut count) = (root, count);
        loop {
            while count > 1
                && let Some(split) = cell.split()
            {
                let counts = counts_of(coder, members, &split, done, count);
                // Whether a part is empty is as good as random, so there is no branch to be
                // foreseen.
                let next = usize::from(counts[0] == 0);
                waiting[length] = (split.parts[1], counts[1]);
                length += usize::from(counts[0] > 0 && counts[1] > 0);
                (cell, count) = (split.parts[next], counts[next]);
            }
            for _ in 0..count {
                let (code, shape) = self.gaussian(coder, &cell, members.get(done));
                members.set(done, code, &shape, &cell);
                done += 1;
            }
            if length == 0 {
                return done;
            }
            length -= 1;
            (cell, count) = waiting[length];
        }
    }

    /// Codes a Gaussian within a cell.
    #[inline(always)]
    fn gaussian(&self, coder: &mut impl SymbolCoder, cell: &Cell, known: Code) -> (Code, Shape) {
        let mut code = self.attributes(coder, cell.level, known);
        let shape = self.lattice.shape(&code);
        let fineness = self.lattice.fineness_of_position(code.class, &shape);
        coder.begin(Attribute::Position);
        let bits = cell.bits(fineness);
        code.center = core::array::from_fn(|axis| {
            let part = cell.part(axis, bits[axis], known.center[axis]);
            let part = plain(coder, bits[axis], part);
            cell.middle(axis, bits[axis], part)
        });
        (code, shape)
    }

    /// Codes all but the centre.
    #[inline(always)]
    fn attributes(&self, coder: &mut impl SymbolCoder, level: u32, known: Code) -> Code {
        coder.begin(Attribute::Precision);
        let mut class = coder.symbol(contexts::CLASS, known.class);
        if class > MAX_CLASS {
            coder.refuse();
            class = MAX_CLASS;
        }
        coder.begin(Attribute::Color);
        let color = self.color(coder, class as usize, known.color);
        coder.begin(Attribute::Shape);

        let shift = class.saturating_sub(LEVELS as u32 - 1);
        let rank = (class as usize).min(LEVELS - 1);
        let step = self.lattice.size.step() * lattice::fineness(class);
        let expected = EXPECTED_SIZE[0] + EXPECTED_SIZE[1] * level as f32;
        let expected = (expected / step) as i32;
        let size = known.size.wrapping_sub(expected);
        let size = signed(coder, contexts::SIZE + rank, shift, size).wrapping_add(expected);
        let ratio = signed(coder, contexts::RATIO + rank, shift, known.ratio);
        // In steps of class 2, whatever the class.
        let coarse = if class < 2 { ratio << (2 - class) } else { ratio >> shift };
        let kind = (coarse.div_euclid(3) + RATIOS as i32 / 2).clamp(0, RATIOS as i32 - 1);
        let context = contexts::SLANT + rank * RATIOS + kind as usize;
        let slant = signed(coder, context, shift, known.slant);
        Code { class, color, size, ratio, slant, center: known.center }
    }

    /// Codes the colour axes: the first by its magnitude and sign, the others relative to that sign.
    #[inline(always)]
    fn color(&self, coder: &mut impl SymbolCoder, class: usize, known: [i32; 4]) -> [i32; 4] {
        let shift = (class as u32).saturating_sub(COLOR_LEVEL);
        let mut color = [0; 4];
        let first = known[0].unsigned_abs();
        let symbol = coder.symbol(contexts::FIRST_AXIS + class, (first >> shift).min(BEYOND));
        let mut high = symbol;
        if symbol == BEYOND {
            high += excess(coder, (first >> shift).wrapping_sub(BEYOND));
        }
        let magnitude = (high << shift | plain(coder, shift, first & ((1 << shift) - 1))) as i32;
        let negative = magnitude != 0 && coder.bits(1, u32::from(known[0] < 0)) == 1;
        let sign = if negative { -1 } else { 1 };
        color[0] = sign * magnitude;
        for axis in 1..self.channels {
            let before = kind_of_magnitude(color[axis - 1]);
            let context =
                contexts::OTHER_AXES + ((axis - 1) * CLASSES + class) * MAGNITUDES + before;
            color[axis] = sign * signed(coder, context, shift, sign * known[axis]);
        }
        color
    }
}

/// Refuses what a decoder refused, or did not read to its end.
#[inline(always)]
fn checked<S: SymbolSearch>(decoder: &RansDecoder<'_, S>) -> Result<(), DecodeError> {
    if decoder.is_complete() {
        return Ok(());
    }
    Err(DecodeError::malformed(ChunkType::GAUS, "the coded Gaussians do not add up"))
}

/// Codes how many of `count` Gaussians are in each of two parts, after `done` others.
#[inline(always)]
fn counts_of<T>(
    coder: &mut impl SymbolCoder,
    members: &mut impl LayerGaussians,
    split: &Split<T>,
    done: usize,
    count: u32,
) -> [u32; 2] {
    let first = members.partition(done..done + count as usize, split.axis, split.middle);
    let first = first_of(coder, count, first as u32);
    [first, count - first]
}

/// Codes how many of `count` Gaussians are in the first of two parts.
#[inline(always)]
fn first_of(coder: &mut impl SymbolCoder, count: u32, first: u32) -> u32 {
    const SHARES: u64 = SYMBOLS as u64;
    if count < FEW_COUNT as u32 {
        let coded = coder.symbol(contexts::FEW + count as usize, first);
        if coded > count {
            coder.refuse();
            return 0;
        }
        return coded;
    }
    let choices = u64::from(count) + 1;
    let share = (u64::from(first) * SHARES / choices) as u32;
    let share = coder.symbol(contexts::MANY + count.ilog2() as usize, share).into();
    // The counts that make this share.
    let least_of = |share: u64| (share * choices).div_ceil(SHARES) as u32;
    let (least, most) = (least_of(share), least_of(share + 1) - 1);
    let rest =
        plain(coder, (most - least + 1).next_power_of_two().ilog2(), first.wrapping_sub(least));
    if rest > most - least {
        coder.refuse();
        return least;
    }
    least + rest
}

/// Codes a signed value, its low `shift` bits plainly.
#[inline(always)]
fn signed(coder: &mut impl SymbolCoder, context: usize, shift: u32, value: i32) -> i32 {
    let high = value >> shift;
    let is_beyond = high.unsigned_abs() > SIGNED as u32;
    let symbol = if is_beyond { BEYOND } else { (high + SIGNED) as u32 };
    let mut decoded = coder.symbol(context, symbol) as i32 - SIGNED;
    if decoded > SIGNED {
        let negative = coder.bits(1, u32::from(high < 0)) == 1;
        let rest = excess(coder, high.unsigned_abs().wrapping_sub(SIGNED as u32 + 1)) as i32;
        let magnitude = rest + SIGNED + 1;
        decoded = if negative { -magnitude } else { magnitude };
    }
    decoded << shift | plain(coder, shift, value as u32 & ((1 << shift) - 1)) as i32
}

/// Codes a number by its length (Elias, 1975). Rare, but what a function that stands apart has a
/// reference to cannot stay in registers.
#[inline(always)]
fn excess(coder: &mut impl SymbolCoder, value: u32) -> u32 {
    let length = coder.symbol(contexts::EXCESS, value.saturating_add(1).ilog2().min(BEYOND));
    let low = plain(coder, length, value.wrapping_add(1) & ((1 << length) - 1));
    (1 << length | low) - 1
}

/// Codes the low `count` bits of a value without a model, however many.
#[inline(always)]
fn plain(coder: &mut impl SymbolCoder, count: u32, value: u32) -> u32 {
    if count == 0 {
        return 0;
    }
    let low = count.min(MAX_BITS);
    let value = value & ((1_u64 << count) - 1) as u32;
    let bits = coder.bits(low, value & ((1 << low) - 1));
    if count > low { bits | coder.bits(count - low, value >> low) << low } else { bits }
}

/// 0, 1, 2 to 3, 4 to 7, more.
fn kind_of_magnitude(value: i32) -> usize {
    value
        .checked_abs()
        .map_or(MAGNITUDES - 1, |value| ((32 - value.leading_zeros()) as usize).min(MAGNITUDES - 1))
}

/// LayerGaussians that are not known yet, handed over as they come.
struct Arriving<F>(F);

impl<F: FnMut(Code, &Shape)> LayerGaussians for Arriving<F> {
    fn partition(&mut self, _: Range<usize>, _: usize, _: u32) -> usize {
        0
    }

    fn get(&self, _: usize) -> Code {
        Code::default()
    }

    fn set(&mut self, _: usize, code: Code, shape: &Shape, _: &Cell) {
        (self.0)(code, shape);
    }
}

/// LayerGaussians that the encoder knows.
#[cfg(feature = "encode")]
struct Given<'a> {
    codes: &'a mut [Code],
    levels: &'a mut Vec<u32>,
}

#[cfg(feature = "encode")]
impl LayerGaussians for Given<'_> {
    fn partition(&mut self, range: Range<usize>, axis: usize, middle: u32) -> usize {
        let codes = &mut self.codes[range];
        codes.sort_by_key(|code| code.center[axis] >= middle);
        codes.partition_point(|code| code.center[axis] < middle)
    }

    fn get(&self, index: usize) -> Code {
        self.codes[index]
    }

    fn set(&mut self, index: usize, code: Code, _: &Shape, cell: &Cell) {
        self.codes[index] = code;
        self.levels.push(cell.level);
    }
}

#[cfg(all(test, feature = "encode"))]
mod tests {
    use std::fmt::Write;

    use super::*;
    use crate::testing::config;
    use proptest::prelude::*;

    /// Counts symbols on their way to another coder.
    struct Counting<C> {
        coder: C,
        counts: Vec<[f64; SYMBOLS]>,
    }

    impl<C: SymbolCoder> SymbolCoder for Counting<C> {
        fn symbol(&mut self, context: usize, symbol: u32) -> u32 {
            let symbol = self.coder.symbol(context, symbol);
            self.counts[context][symbol as usize] += 1.0;
            symbol
        }

        fn bits(&mut self, count: u32, value: u32) -> u32 {
            self.coder.bits(count, value)
        }

        fn refuse(&mut self) {
            self.coder.refuse();
        }
    }

    /// Prints the tables that files with the entropy coding in the folder `GIP_TABLES` suggest, every file
    /// counting the same:
    ///
    ///     GIP_TABLES=DIR cargo test --release fit_the_tables -- --ignored --nocapture
    #[test]
    #[ignore = "makes src/coding/tables.rs"]
    fn fit_the_tables() {
        let folder = std::env::var("GIP_TABLES").expect("a folder in GIP_TABLES");
        let mut totals = vec![[0.0; SYMBOLS]; contexts::COUNT];
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let bytes = std::fs::read(entry.expect("an entry").path()).expect("a file");
            for (total, counts) in totals.iter_mut().zip(counts(&bytes)) {
                for (total, count) in total.iter_mut().zip(counts) {
                    *total += count;
                }
            }
        }
        let mut text = String::new();
        for (total, before) in totals.iter().zip(&tables::STARTS) {
            writeln!(text, "    {:?},", starts(total, before)).expect("a string");
        }
        println!("{text}");
    }

    /// How often each symbol of each context comes in a file, for a thousand Gaussians.
    fn counts(file: &[u8]) -> Vec<[f64; SYMBOLS]> {
        let mut rest = &file[8..];
        let mut chunks = Vec::new();
        while let Some((length, after)) = rest.split_first_chunk::<4>() {
            let (kind, after) = after.split_at(4);
            let (payload, after) = after.split_at(u32::from_le_bytes(*length) as usize);
            chunks.push((kind, payload));
            rest = &after[4..];
        }
        let of = |wanted: &'static [u8]| chunks.iter().filter(move |(kind, _)| *kind == wanted);
        let header = Header::parse(of(b"GHDR").next().expect("a header").1).expect("sound");
        let channels = header.color.channels();
        let steps = of(b"QNTZ").next().expect("steps").1;
        let lattice = Lattice::parse(steps, channels).expect("sound");
        let coding = LayerCoder::new(&lattice, &header);
        let mut counts = vec![[0.0; SYMBOLS]; contexts::COUNT];
        for (_, payload) in of(b"GAUS") {
            let mut models = Models::default();
            let count = u32::from_le_bytes(payload[..4].try_into().expect("four bytes"));
            let decoder = RansDecoder::new(&payload[4..], &mut models.0);
            let mut coder = Counting { coder: decoder, counts };
            coding.walk(&mut coder, count as usize, &mut Arriving(|_, _: &Shape| ()));
            assert!(coder.coder.is_complete());
            counts = coder.counts;
        }
        let factor = 1000.0 / f64::from(header.gaussians);
        counts.iter().map(|counts| counts.map(|count| factor * count)).collect()
    }

    /// A table for counts, which mean little where they are few: those before stand in.
    fn starts(counts: &[f64; SYMBOLS], before: &[i16; SYMBOLS]) -> [i16; SYMBOLS] {
        const LEAST: f64 = 8.0;
        const PRIOR: f64 = 100.0;
        let model = Model::new(*before);
        let shares = model.costs().map(|bits| PRIOR * (-f64::from(bits)).exp2());
        let weights: Vec<f64> = counts.iter().zip(shares).map(|(a, b)| a + b).collect();
        let total: f64 = weights.iter().sum();
        let mut sum = 0.0;
        core::array::from_fn(|symbol| {
            let start = LEAST * symbol as f64 + (32768.0 - LEAST * SYMBOLS as f64) * sum / total;
            sum += weights[symbol];
            start.round() as i16
        })
    }

    /// `BLESS=1 cargo test the_specification_has_the_models` writes the file anew.
    #[test]
    fn the_specification_has_the_models() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/spec/entropy-models.tsv");
        let lines = tables::STARTS.iter().enumerate().map(|(context, starts)| {
            let starts = starts.map(|start| start.to_string()).join("\t");
            format!("{context}\t{starts}\n")
        });
        let text: String = lines.collect();
        if std::env::var_os("BLESS").is_some() {
            std::fs::write(path, &text).expect("the folder can be written");
        }
        assert_eq!(std::fs::read_to_string(path).expect("a text"), text);
    }

    fn codes(channels: usize) -> impl Strategy<Value = Vec<Code>> {
        let value = prop_oneof![-3_i32..3, -40_i32..40, -60_000_i32..60_000];
        let geometry = [value.clone(), value.clone(), value.clone()];
        let center = [0_u32..98_304, 0_u32..65_536];
        let code = (0..=MAX_CLASS, prop::collection::vec(value, channels), geometry, center);
        let code = code.prop_map(|(class, axes, [size, ratio, slant], center)| {
            let mut color = [0; 4];
            color[..axes.len()].copy_from_slice(&axes);
            Code { class, color, size, ratio, slant, center }
        });
        prop::collection::vec(code, 1..80)
    }

    fn lattice(channels: usize) -> Lattice {
        let color = vec![0.1; channels];
        Lattice::new([1.25, 0.66, 0.9, 1.9], color)
    }

    proptest! {
        #![proptest_config(config(200))]

        #[test]
        fn what_is_written_is_read(
            (channels, mut codes) in (1_usize..=4).prop_flat_map(|n| (Just(n), codes(n))),
        ) {
            let lattice = lattice(channels);
            let coding = LayerCoder { lattice: &lattice, grid: CenterGrid::new(700, 400), channels };
            let sent = codes.clone();
            let EncodedLayer { payload, levels, .. } = coding.write(&mut codes);
            prop_assert_eq!(levels.len(), codes.len());
            // Centres move within their cells, all else stays.
            let sorted = |codes: &[Code]| {
                let key = |c: &Code| (c.class, c.color, c.size, c.ratio, c.slant);
                let mut keys: Vec<_> = codes.iter().map(key).collect();
                keys.sort_unstable();
                keys
            };
            prop_assert_eq!(sorted(&sent), sorted(&codes));
            let mut read = Vec::new();
            let (count, bytes) =
                LayerCoder::counted(&payload, codes.len() as u32).expect("the count is right");
            coding.read(count, bytes, None, |code, _| read.push(code)).expect("sound");
            prop_assert_eq!(&read, &codes);
            // Written again, nothing moves any more.
            prop_assert_eq!(coding.write(&mut codes).payload, payload);
        }

        #[test]
        fn what_is_cut_off_comes_first(mut codes in codes(3), share in 0.0..=1.0) {
            let lattice = lattice(3);
            let coding = LayerCoder { lattice: &lattice, grid: CenterGrid::new(700, 400), channels: 3 };
            coding.write(&mut codes);
            let first = (share * codes.len() as f64) as usize;
            // Those in one pixel have no order.
            let pixels = |codes: &[Code]| {
                let mut pixels: Vec<_> =
                    codes.iter().map(|code| code.center.map(|unit| unit / 128)).collect();
                pixels.sort_unstable();
                pixels
            };
            let (front, back) = (pixels(&codes[..first]), pixels(&codes[first..]));
            codes.reverse();
            coding.cut(&mut codes, first);
            prop_assert_eq!(pixels(&codes[..first]), front);
            prop_assert_eq!(pixels(&codes[first..]), back);
        }

        #[test]
        fn bytes_of_any_kind_are_read_or_refused(
            bytes in prop::collection::vec(any::<u8>(), 0..400), count in 0_u32..2000,
        ) {
            let lattice = lattice(3);
            let coding = LayerCoder { lattice: &lattice, grid: CenterGrid::new(700, 400), channels: 3 };
            let payload = [&count.to_le_bytes(), &bytes[..]].concat();
            let mut received = 0;
            if let Ok((count, bytes)) = LayerCoder::counted(&payload, 1000) {
                let _ = coding.read(count, bytes, None, |_, _| received += 1);
            }
            prop_assert!(received <= 1000);
        }
    }
}
