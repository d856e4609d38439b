//! The last stage of coder 1: whole codes chosen by what they do to the picture and what they
//! cost, one Gaussian after the other (rate-distortion optimisation by coordinate descent on the
//! lattice).

use rayon::prelude::*;

use super::quadratic_model::GeometryChange;
use super::residuals::Residuals;
use super::window::{ErrorChange, Slopes, Window};
use crate::coding::entropy::{Code, LayerCoder, MAX_CLASS, SymbolCosts};
use crate::color::ColorModel;
use crate::encode::error::EncodeError;
use crate::encode::progress::Observer;
use crate::gaussian::Gaussian;
use crate::kernel::QUARTIC_RADIUS;

/// Side of the blocks by which Gaussians that do not touch are told apart, in pixels.
const BLOCK: usize = 16;
/// Gaussians between two polls.
const POLL_INTERVAL: usize = 256;

/// How far the best way along the slopes is followed.
const REACH: f32 = 0.5;
/// Most candidates that are tried.
const MOST_TRIED: usize = 3;

/// What codes are chosen by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CoordinateDescent<'a> {
    pub(crate) coder: LayerCoder<'a>,
    pub(crate) model: ColorModel,
    /// Bits of the tree of cells for each Gaussian.
    pub(crate) tree: f32,
    /// Bits that a tile of the decoder is worth, for the time that it takes.
    pub(crate) tile: f32,
    /// Squared error that a bit is worth.
    pub(crate) lambda: f32,
}

/// Where in a file a code stands, as far as that decides what it costs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CodeContext<'a> {
    /// Of the code's cell.
    pub(crate) level: u32,
    /// Of the symbols in the code's layer.
    pub(crate) costs: &'a SymbolCosts,
}

/// A Gaussian's best code, and the change of error and rate against leaving it out.
#[derive(Clone, Copy, Debug)]
struct Choice {
    code: Code,
    value: f32,
}

impl CoordinateDescent<'_> {
    /// Looks at every Gaussian once, by `residuals`, and improves or removes it. The `contexts` are
    /// those of the codes. How many were changed.
    ///
    /// Gaussians that do not touch are looked at side by side; the outcome is that of one after
    /// the other.
    pub(crate) fn pass(
        &self,
        residuals: &mut Residuals,
        codes: &mut Vec<Code>,
        contexts: &[CodeContext<'_>],
        observer: &mut Observer<'_>,
    ) -> Result<usize, EncodeError> {
        let mut kept = vec![true; codes.len()];
        let mut changed = 0;
        observer.poll()?;
        for round in self.rounds(residuals, codes) {
            for part in round.chunks(POLL_INTERVAL) {
                observer.poll()?;
                let shared = &*residuals;
                let chosen: Vec<Option<Code>> = part
                    .par_iter()
                    .map_init(Window::default, |window, &index| {
                        self.choose(shared, window, codes[index], contexts[index])
                    })
                    .collect();
                let mut changes = Vec::new();
                for (&index, choice) in part.iter().zip(chosen) {
                    if choice == Some(codes[index]) {
                        continue;
                    }
                    changed += 1;
                    changes.push((self.gaussian(&codes[index]), -1.0));
                    match choice {
                        Some(code) => {
                            changes.push((self.gaussian(&code), 1.0));
                            codes[index] = code;
                        }
                        None => kept[index] = false,
                    }
                }
                residuals.add(&changes);
            }
        }
        let mut kept = kept.into_iter();
        codes.retain(|_| kept.next().expect("one for each"));
        Ok(changed)
    }

    fn gaussian(&self, code: &Code) -> Gaussian {
        let LayerCoder { lattice, grid, .. } = &self.coder;
        lattice.gaussian(code, &lattice.shape(code), grid, self.model)
    }

    /// Indices in rounds: within one, no two windows touch.
    ///
    /// Large ones, which touch many, come first. Neighbours in the order of the codes are mostly
    /// neighbours in the picture, so the others are taken far from each other.
    fn rounds(&self, residuals: &Residuals, codes: &[Code]) -> Vec<Vec<usize>> {
        let columns = residuals.width().div_ceil(BLOCK);
        let mut windows: Vec<_> = (codes.iter().enumerate())
            .map(|(index, code)| {
                let blocks = residuals
                    .bounds(&self.gaussian(code))
                    .map(|sides| sides.map(|side| side.start / BLOCK..side.end.div_ceil(BLOCK)));
                // Those that are not seen at all go into the first round, to be removed.
                let [x, y] = blocks.unwrap_or_default();
                let area = (x.len() * y.len()) as u32;
                (core::cmp::Reverse(area.checked_ilog2()), (index as u32).reverse_bits(), x, y)
            })
            .collect();
        windows.sort_unstable_by_key(|(area, order, ..)| (*area, *order));
        let mut next = vec![0; columns * residuals.height().div_ceil(BLOCK)];
        let mut rounds: Vec<Vec<usize>> = Vec::new();
        for (_, order, x, y) in windows {
            let blocks = y.flat_map(|row| x.clone().map(move |column| row * columns + column));
            let round = blocks.clone().map(|block| next[block]).max().unwrap_or(0);
            blocks.for_each(|block| next[block] = round + 1);
            if round == rounds.len() {
                rounds.push(Vec::new());
            }
            rounds[round].push(order.reverse_bits() as usize);
        }
        rounds
    }

    /// The best of a code and its neighbours; `None` if the picture is better off without.
    fn choose(
        &self,
        residuals: &Residuals,
        window: &mut Window,
        code: Code,
        context: CodeContext<'_>,
    ) -> Option<Code> {
        let here = self.gaussian(&code);
        window.load(residuals, &here).then_some(())?;
        let slopes = window.slopes(&here, self.model);
        let present = slopes.change.error + self.lambda * self.bits(code, context);
        let promising = self.promising(&slopes, code, &here, context, present);
        if promising.is_empty() && present < 0.0 {
            return Some(code);
        }
        window.remove(&here);
        let mut best = self.judged(window, code, context);
        for candidate in promising {
            if let Some(other) = self.recolored(window, candidate, context)
                && other.value < best.value
            {
                best = other;
            }
        }
        (best.value < 0.0).then_some(best.code)
    }

    /// The neighbours that may well be better than the code as it is, by what its slopes say.
    fn promising(
        &self,
        slopes: &Slopes,
        code: Code,
        here: &Gaussian,
        context: CodeContext<'_>,
        present: f32,
    ) -> Vec<Code> {
        let (lattice, model) = (self.coder.lattice, self.model);
        let [_, l21, l22] = here.cholesky;
        let slant = l21 / l22;
        let amplitudes = code.color.iter().zip(&lattice.color);
        let strength: f32 = amplitudes.map(|(&code, step)| (code as f32 * step).powi(2)).sum();
        let recolored = self.with_best_colors(&slopes.change, code, context.costs);
        let error = slopes.change.with(recolored.color, lattice.color_units(&recolored));
        let mut found = Vec::new();
        if recolored != code {
            found.push((error + self.lambda * self.bits(recolored, context), recolored));
        }
        if strength > 0.0 {
            let best = slopes.by_geometry.best(slant, strength, REACH);
            let target = best.applied(&self.gaussian(&recolored));
            let classes = code.class.saturating_sub(1)..=(code.class + 1).min(MAX_CLASS);
            let targeted =
                classes.map(|class| lattice.code(&target, class, &self.coder.grid, model));
            for candidate in self.steps(recolored).chain(targeted) {
                let way = GeometryChange::between(here, &self.gaussian(&candidate));
                let change = slopes.by_geometry.change(&way, slant, strength);
                found.push((
                    error + change + self.lambda * self.bits(candidate, context),
                    candidate,
                ));
            }
        }
        found.retain(|(value, _)| *value < present);
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.truncate(MOST_TRIED);
        found.into_iter().map(|(_, code)| code).collect()
    }

    /// What a code is worth as it is.
    fn judged(&self, window: &Window, code: Code, context: CodeContext<'_>) -> Choice {
        let change = window.change(&self.gaussian(&code), self.model);
        Choice { code, value: change.error + self.lambda * self.bits(code, context) }
    }

    /// What a code is worth with the best colours for its geometry.
    fn recolored(&self, window: &Window, code: Code, context: CodeContext<'_>) -> Option<Choice> {
        let change = window.change(&self.gaussian(&code), self.model);
        if change.weight <= 0.0 {
            return None;
        }
        let code = self.with_best_colors(&change, code, context.costs);
        if window.is_clamped() {
            return Some(self.judged(window, code, context));
        }
        let error = change.with(code.color, self.coder.lattice.color_units(&code));
        Some(Choice { code, value: error + self.lambda * self.bits(code, context) })
    }

    /// A code with the best colours for its geometry, one axis after the other.
    fn with_best_colors(&self, change: &ErrorChange, mut code: Code, costs: &SymbolCosts) -> Code {
        let units = self.coder.lattice.color_units(&code);
        for (axis, &unit) in units.iter().enumerate().take(self.coder.channels) {
            // By what the error grows for a unit beside the best value.
            let growth = change.weight * unit * unit;
            if growth <= 0.0 {
                continue;
            }
            let present = code.color[axis];
            let best = present as f32 - change.by_axis[axis] * unit / growth;
            let best = best.clamp(-30_000.0, 30_000.0);
            let rounded = best.round() as i32;
            let nearer = rounded - rounded.signum();
            let candidates = [rounded, nearer, rounded + 1, rounded - 1, present, 0];
            let values = candidates.map(|value| {
                code.color[axis] = value;
                let off = value as f32 - best;
                growth * off * off + self.lambda * self.coder.color_cost(&code, costs)
            });
            let least = (0..values.len()).min_by(|&a, &b| values[a].total_cmp(&values[b]));
            code.color[axis] = candidates[least.expect("there are some")];
        }
        code
    }

    fn bits(&self, code: Code, context: CodeContext<'_>) -> f32 {
        let shape = self.coder.lattice.shape(&code);
        let own = self.coder.cost(code, &shape, context.level, context.costs);
        self.tree + own + self.tile * tiles(shape.cholesky)
    }

    /// A step up and down in each component of the geometry.
    fn steps(&self, code: Code) -> impl Iterator<Item = Code> {
        let (lattice, grid) = (self.coder.lattice, self.coder.grid);
        let center = grid.center(code.center);
        let shapes = [-1, 1].into_iter().flat_map(move |step| {
            (0..3).map(move |component| {
                let mut code = code;
                match component {
                    0 => code.size += step,
                    1 => code.ratio += step,
                    _ => code.slant += step,
                }
                code.center = lattice.placed(&code, center, &grid);
                code
            })
        });
        let moves = [(0, false), (0, true), (1, false), (1, true)];
        let moves = moves
            .into_iter()
            .filter_map(move |(axis, forward)| lattice.moved(&code, axis, forward, &grid));
        shapes.chain(moves)
    }
}

/// About how many tiles of 8 x 8 pixels a Gaussian touches, those of its bounding box: a model of the
/// time that decoders take, which count work in such tiles (spec, section 10).
pub(super) fn tiles([l11, l21, l22]: [f32; 3]) -> f32 {
    const SIDE: f32 = 8.0;
    let along = |sigma: f32| 2.0 * QUARTIC_RADIUS * sigma / SIDE + 1.0;
    along(l11) * along((l21 * l21 + l22 * l22).sqrt())
}
