//! Coordinate descent on the quantization grid: for one Gaussian after the other, the code with the least
//! Lagrangian cost D + lambda R is chosen, where D is the squared error of the picture and R the
//! rate in bits.

use core::ops::Range;

use rayon::prelude::*;

use super::residuals::{Band, Residuals, window};
use super::rounds::{BandEntries, Entry, Round};
use super::window::{ErrorChange, ErrorGradient, Window};
use crate::coding::entropy::{Code, LayerCoder, MAX_EXPONENT, MOST_CODE, SymbolCosts};
use crate::color::ColorModel;
use crate::encode::error::Result;
use crate::encode::fit::MOST_COLOR;
use crate::encode::loss::ColorCurvature;
use crate::encode::own_frame::{self, GeometryChange};
use crate::encode::progress::Observer;
use crate::gaussian::Gaussian;
use crate::kernel::QUARTIC_RADIUS;

// Constants: docs/tuning.md, "Search for a target".
/// The trust region of the quadratic model: the largest change of each component of the geometry in
/// a step to the model's minimum.
const TRUST_REGION: f32 = 0.5;
/// Most candidates whose error is computed exactly.
const MAX_CANDIDATES: usize = 3;

/// What the cost of a code depends on, besides its error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CoordinateDescent<'a> {
    pub(crate) coder: LayerCoder<'a>,
    pub(crate) model: ColorModel,
    /// Bits that the k-d tree of cells takes per Gaussian.
    pub(crate) tree_bits: f32,
    /// The penalty in bits for each tile of the decoder that a Gaussian touches.
    pub(crate) tile_bits: f32,
    /// The Lagrange multiplier: squared error per bit.
    pub(crate) lambda: f32,
    /// The work of the pass, for the progress that is reported.
    pub(crate) work: f64,
}

/// The context of a code in its file, which determines its rate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CodeContext<'a> {
    /// The level of the code's cell (spec, section 7.4).
    pub(crate) level: u32,
    /// The costs of the symbols in the code's layer.
    pub(crate) costs: &'a SymbolCosts,
}

/// A code for a Gaussian, compared with removing the Gaussian.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    code: Code,
    /// The change of the error.
    error: f32,
    /// The rate, with the penalty for the tiles that the Gaussian touches.
    bits: f32,
}

impl Candidate {
    /// By how much the Gaussian lowers the error for each of its bits.
    fn use_of_bits(&self) -> f32 {
        -self.error / self.bits
    }
}

/// A code, with [`Candidate::use_of_bits`] and the index of its Gaussian.
type Ranked = (f32, u32, Code);

/// The result of optimizing the Gaussians of a band.
#[derive(Debug, Default)]
struct PassedBand {
    /// The Gaussians that remain.
    found: Vec<Ranked>,
    /// Those that were removed, although they lower the error.
    spare: Vec<Ranked>,
    /// Gaussians that reach beyond the band, with the factor that they are added to the rendering with, and
    /// the rows of the band, where that is done.
    beyond: Vec<(Gaussian, f32, Range<usize>)>,
}

/// The cheapest codes out of those that cost less than a given one, cheapest first.
#[derive(Debug)]
struct Cheapest {
    costs: [f32; MAX_CANDIDATES],
    codes: [Code; MAX_CANDIDATES],
    count: usize,
    limit: f32,
}

impl Cheapest {
    /// None yet of those that cost less than `limit`.
    fn below(limit: f32) -> Self {
        let codes = [Code::default(); MAX_CANDIDATES];
        Self { costs: [0.0; MAX_CANDIDATES], codes, count: 0, limit }
    }

    fn add(&mut self, cost: f32, code: Code) {
        let later = self.costs[..self.count].iter().position(|&other| cost < other);
        let place = later.unwrap_or(self.count);
        if !(cost < self.limit) || place == MAX_CANDIDATES {
            return;
        }
        self.count = (self.count + 1).min(MAX_CANDIDATES);
        self.costs[place..self.count].rotate_right(1);
        self.codes[place..self.count].rotate_right(1);
        (self.costs[place], self.codes[place]) = (cost, code);
    }

    fn codes(&self) -> impl Iterator<Item = Code> {
        self.codes[..self.count].iter().copied()
    }
}

impl CoordinateDescent<'_> {
    /// One pass: improves or removes every Gaussian. `contexts` has the context of each code. `residuals`
    /// are those of the rendering of `codes`, and in the end those of the new codes. Returns the new codes, and
    /// those of removed Gaussians that lower the error, both sorted by how much each lowers it per bit, the
    /// most first.
    ///
    /// Bands of the picture are processed in parallel; the result does not depend on the threads.
    pub(crate) fn pass(
        &self,
        residuals: &mut Residuals,
        codes: &[Code],
        contexts: &[CodeContext<'_>],
        observer: &mut Observer<'_>,
    ) -> Result<[Vec<Code>; 2]> {
        // Gaussians outside the picture are not among them, and thereby removed.
        let size = residuals.size();
        let entries = observer.map(codes.iter().enumerate(), |(index, code)| {
            let window = window(&self.gaussian(code), size)?;
            Some(Entry::new(index, window, size[1]))
        })?;
        let mut entries: Vec<Entry> = entries.into_iter().flatten().collect();
        let rounds = Round::all(&mut entries);
        let work = self.work / rounds.iter().map(Round::work).sum::<f64>();
        let mut passed = [Vec::with_capacity(codes.len()), Vec::new()];
        for round in &rounds {
            let round_work = work * round.work();
            let tasks = bands_of(residuals, round);
            let passed_bands =
                observer.map_with(tasks.into_iter(), |window, (band, of_band)| {
                    self.optimize(window, band, of_band.entries, codes, contexts)
                })?;
            observer.advance(round_work)?;
            let mut whole = residuals.whole();
            for PassedBand { found, spare, beyond } in passed_bands {
                passed[0].extend(found);
                passed[1].extend(spare);
                for (gaussian, factor, rows) in beyond {
                    whole.add(&gaussian, factor, 0..rows.start);
                    whole.add(&gaussian, factor, rows.end..usize::MAX);
                }
            }
        }
        Ok(passed.map(|mut ranked| {
            ranked.par_sort_unstable_by(|(use_of_a, a, _), (use_of_b, b, _)| {
                use_of_b.total_cmp(use_of_a).then(a.cmp(b))
            });
            ranked.into_iter().map(|(.., code)| code).collect()
        }))
    }

    /// Improves or removes Gaussians whose windows are inside of a band.
    fn optimize(
        &self,
        window: &mut Window,
        mut band: Band<'_>,
        entries: &[Entry],
        codes: &[Code],
        contexts: &[CodeContext<'_>],
    ) -> PassedBand {
        let mut of_band = PassedBand::default();
        let rows = band.rows();
        for &Entry { index, .. } in entries {
            let (code, context) = (codes[index as usize], contexts[index as usize]);
            let Some(best) = self.choose(window, &band, code, context) else { continue };
            let is_kept = self.cost(&best) < 0.0;
            let chosen = is_kept.then_some(best.code);
            if chosen != Some(code) {
                for (code, factor) in [(Some(code), -1.0), (chosen, 1.0)] {
                    let Some(gaussian) = code.map(|code| self.gaussian(&code)) else { continue };
                    band.add(&gaussian, factor, rows.clone());
                    let is_inside = band.window(&gaussian).is_none_or(|[_, window]| {
                        rows.start <= window.start && window.end <= rows.end
                    });
                    if !is_inside {
                        of_band.beyond.push((gaussian, factor, rows.clone()));
                    }
                }
            }
            let ranked = (best.use_of_bits(), index, best.code);
            if is_kept {
                of_band.found.push(ranked);
            } else if best.error < 0.0 {
                of_band.spare.push(ranked);
            }
        }
        of_band
    }

    fn gaussian(&self, code: &Code) -> Gaussian {
        let LayerCoder { quantization, grid, .. } = &self.coder;
        quantization.gaussian(code, &quantization.shape(code), grid, self.model)
    }

    /// The code of least cost among a code and its candidates; `None` if the Gaussian is outside the picture.
    fn choose(
        &self,
        window: &mut Window,
        band: &Band<'_>,
        code: Code,
        context: CodeContext<'_>,
    ) -> Option<Candidate> {
        let gaussian = self.gaussian(&code);
        let gradient = window.without(band, &gaussian, self.model)?;
        let mut best =
            Candidate { code, error: gradient.change.error, bits: self.bits(&code, context) };
        let present_cost = self.cost(&best);
        let curvature = band.curvature();
        let candidates =
            self.candidates(&gradient, curvature, code, &gaussian, context, present_cost);
        for candidate in candidates.codes() {
            if let Some(other) = self.evaluated(window, band, candidate, context)
                && self.cost(&other) < self.cost(&best)
            {
                best = other;
            }
        }
        Some(best)
    }

    /// The Lagrangian cost of a code, relative to that of removing the Gaussian.
    fn cost(&self, candidate: &Candidate) -> f32 {
        candidate.error + self.lambda * candidate.bits
    }

    /// Codes that cost less than the present one by the quadratic model of the error, cheapest
    /// first.
    fn candidates(
        &self,
        gradient: &ErrorGradient,
        curvature: &ColorCurvature,
        code: Code,
        gaussian: &Gaussian,
        context: CodeContext<'_>,
        present_cost: f32,
    ) -> Cheapest {
        let (quantization, model) = (self.coder.quantization, self.model);
        let slant = gaussian.cholesky[1] / gaussian.cholesky[2];
        let mut amplitudes = [0.0; 4];
        for ((amplitude, code), step) in
            amplitudes.iter_mut().zip(code.color).zip(&quantization.color)
        {
            *amplitude = code as f32 * step;
        }
        let energy = curvature.of(amplitudes) * gradient.perceptual_weight;
        let change = &gradient.change;
        let recolored = self.with_best_colors(change, curvature, code, context.costs);
        let units = quantization.color_units(&recolored);
        let error = change.with_color(recolored.color, units, curvature);
        let mut found = Cheapest::below(present_cost);
        let color_bits = self.coder.color_cost(&recolored, context.costs);
        if recolored != code {
            let bits = self.geometry_bits(&recolored, context) + color_bits;
            found.add(error + self.lambda * bits, recolored);
        }
        if energy > 0.0 {
            let mut add = |candidate: Code, color_bits: f32| {
                let step = self.change(gaussian, &code, &candidate);
                let change = gradient.by_geometry.error_change(&step, slant, energy);
                let bits = self.geometry_bits(&candidate, context) + color_bits;
                found.add(error + change + self.lambda * bits, candidate);
            };
            for candidate in self.neighbours(recolored) {
                add(candidate, color_bits);
            }
            let step = gradient.by_geometry.minimizer(slant, energy, TRUST_REGION);
            let target = step.applied(&self.gaussian(&recolored));
            for exponent in code.exponent.saturating_sub(1)..=(code.exponent + 1).min(MAX_EXPONENT)
            {
                let candidate = quantization.code(&target, exponent, &self.coder.grid, model);
                add(candidate, self.coder.color_cost(&candidate, context.costs));
            }
        }
        found
    }

    /// The change of geometry from a Gaussian with its code to another code.
    fn change(&self, gaussian: &Gaussian, from: &Code, to: &Code) -> GeometryChange {
        let center = self.coder.grid.center(to.center);
        let [before, after] = [from, to].map(|code| self.coder.quantization.shape_values(code));
        GeometryChange {
            center: own_frame::coordinates(gaussian, center),
            size: after[0] - before[0],
            ratio: after[1] - before[1],
            slant: after[2] - before[2],
        }
    }

    /// A code, with the best colours for its geometry, and its exact cost. The Gaussian is not part of the
    /// window's rendering. `None` if it has no weight in the picture.
    fn evaluated(
        &self,
        window: &Window,
        band: &Band<'_>,
        code: Code,
        context: CodeContext<'_>,
    ) -> Option<Candidate> {
        let change = window.change(band, &self.gaussian(&code), self.model);
        if change.squared_weights <= 0.0 {
            return None;
        }
        let curvature = band.curvature();
        let code = self.with_best_colors(&change, curvature, code, context.costs);
        let units = self.coder.quantization.color_units(&code);
        let error = change.with_color(code.color, units, curvature);
        Some(Candidate { code, error, bits: self.bits(&code, context) })
    }

    /// A code with the colours of least cost for its geometry, chosen for one colour axis after the
    /// other.
    fn with_best_colors(
        &self,
        change: &ErrorChange,
        curvature: &ColorCurvature,
        mut code: Code,
        costs: &SymbolCosts,
    ) -> Code {
        let units = self.coder.quantization.color_units(&code);
        // Half of the derivatives of the error by each amplitude.
        let mut by_axis = change.by_axis;
        for (axis, &unit) in units.iter().enumerate().take(self.coder.channels) {
            // The increase of the error when the code is 1 away from its minimum.
            let by_others = curvature.by_axis()[axis].map(|entry| entry * change.squared_weights);
            let by_itself = by_others[axis] * unit * unit;
            if by_itself <= 0.0 {
                continue;
            }
            let present = code.color[axis];
            let best = present as f32 - by_axis[axis] * unit / by_itself;
            let most = (MOST_COLOR / unit).min(MOST_CODE);
            let best = best.clamp(-most, most);
            let rounded = best.round() as i32;
            let towards_zero = rounded - rounded.signum();
            let candidates = [rounded, towards_zero, rounded + 1, rounded - 1, present, 0];
            let (mut least, mut cheapest) = (f32::INFINITY, present);
            for (index, &candidate) in candidates.iter().enumerate() {
                if candidates[..index].contains(&candidate) {
                    continue;
                }
                code.color[axis] = candidate;
                let distance = candidate as f32 - best;
                let bits = self.coder.color_cost(&code, costs);
                let cost = by_itself * distance * distance + self.lambda * bits;
                if cost < least {
                    (least, cheapest) = (cost, candidate);
                }
            }
            code.color[axis] = cheapest;
            let added = (cheapest - present) as f32 * unit;
            for (derivative, entry) in by_axis.iter_mut().zip(by_others) {
                *derivative += entry * added;
            }
        }
        code
    }

    /// The rate of a code in bits, with the penalty for the tiles that it touches.
    fn bits(&self, code: &Code, context: CodeContext<'_>) -> f32 {
        self.geometry_bits(code, context) + self.coder.color_cost(code, context.costs)
    }

    /// The part of the rate that does not depend on the amplitudes.
    fn geometry_bits(&self, code: &Code, context: CodeContext<'_>) -> f32 {
        let shape = self.coder.quantization.shape(code);
        let bits = self.coder.geometry_cost(code, &shape, context.level, context.costs);
        self.tree_bits + bits + self.tile_bits * touched_tiles(shape.cholesky)
    }

    /// The codes that are one step up or down in one component of the geometry.
    fn neighbours(&self, code: Code) -> impl Iterator<Item = Code> {
        let (quantization, grid) = (self.coder.quantization, self.coder.grid);
        let center = grid.center(code.center);
        let shapes = [-1, 1].into_iter().flat_map(move |step| {
            (0..3).map(move |component| {
                let mut code = code;
                match component {
                    0 => code.size += step,
                    1 => code.ratio += step,
                    _ => code.slant += step,
                }
                code.center = quantization.placed(&code, center, &grid);
                code
            })
        });
        let moves = [(0, false), (0, true), (1, false), (1, true)];
        let moves = moves
            .into_iter()
            .filter_map(move |(axis, forward)| quantization.moved(&code, axis, forward, &grid));
        shapes.chain(moves)
    }
}

/// The bands of a round with their Gaussians; those with most work first, so that all threads are done
/// at about the same time.
fn bands_of<'a, 'b>(
    residuals: &'a mut Residuals,
    round: &Round<'b>,
) -> Vec<(Band<'a>, BandEntries<'b>)> {
    let [first, height] = round.heights;
    let mut bands = residuals.bands(first, height).enumerate();
    let with_entries = round.bands.iter().map(|&of_band| {
        let band = bands.find(|&(number, _)| number == of_band.band);
        (band.expect("the picture has all bands").1, of_band)
    });
    let mut bands: Vec<_> = with_entries.collect();
    bands.sort_by(|(_, a), (_, b)| b.work.total_cmp(&a.work));
    bands
}

/// About how many tiles of 8 x 8 pixels the bounding box of a Gaussian touches: a model of the time
/// that a decoder takes, whose work the spec counts in such tiles (section 10).
pub(super) fn touched_tiles([l11, l21, l22]: [f32; 3]) -> f32 {
    const SIDE: f32 = 8.0;
    let along = |sigma: f32| 2.0 * QUARTIC_RADIUS * sigma / SIDE + 1.0;
    along(l11) * along((l21 * l21 + l22 * l22).sqrt())
}
