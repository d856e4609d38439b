//! The last stage of coding 1: whole codes chosen by what they do to the picture and what they
//! cost, one Gaussian after the other (rate-distortion optimisation by coordinate descent on the
//! lattice).

use rayon::prelude::*;

use super::error::EncodeError;
use super::patch::{Patch, Picture};
use super::progress::Observer;
use crate::coding::set::{Costs, SetCoding};
use crate::color::ColorModel;
use crate::lattice::{Code, MAX_CLASS};

/// Side of the blocks by which Gaussians that do not touch are told apart, in pixels.
const BLOCK: usize = 16;
/// Gaussians between two polls.
const POLL_INTERVAL: usize = 256;

/// What codes are chosen by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Descent<'a> {
    pub(crate) coding: SetCoding<'a>,
    pub(crate) model: ColorModel,
    pub(crate) costs: &'a Costs,
    /// Bits of the tree of cells for each Gaussian.
    pub(crate) tree: f32,
    /// Squared error that a bit is worth.
    pub(crate) lambda: f32,
}

/// A Gaussian's best code, and the change of error and rate against leaving it out.
#[derive(Clone, Copy, Debug)]
struct Choice {
    code: Code,
    value: f32,
}

impl Descent<'_> {
    /// Looks at every Gaussian once, in `picture`, and improves or removes it. The `levels` are
    /// those of the codes' cells. How many were changed.
    ///
    /// Gaussians that do not touch are looked at side by side; the outcome is that of one after
    /// the other.
    pub(crate) fn pass(
        &self,
        picture: &mut Picture,
        codes: &mut Vec<Code>,
        levels: &[u32],
        observer: &mut Observer<'_>,
    ) -> Result<usize, EncodeError> {
        let mut kept = vec![true; codes.len()];
        let mut changed = 0;
        for round in self.rounds(picture, codes) {
            for part in round.chunks(POLL_INTERVAL) {
                observer.poll()?;
                let shared = &*picture;
                let chosen: Vec<Option<Code>> = part
                    .par_iter()
                    .map_init(Patch::default, |patch, &index| {
                        self.choose(shared, patch, codes[index], levels[index])
                    })
                    .collect();
                for (&index, choice) in part.iter().zip(chosen) {
                    let before = codes[index];
                    if choice == Some(before) {
                        continue;
                    }
                    changed += 1;
                    picture.add(&self.gaussian(&before), -1.0);
                    match choice {
                        Some(code) => {
                            picture.add(&self.gaussian(&code), 1.0);
                            codes[index] = code;
                        }
                        None => kept[index] = false,
                    }
                }
            }
        }
        let mut kept = kept.into_iter();
        codes.retain(|_| kept.next().expect("one for each"));
        Ok(changed)
    }

    fn gaussian(&self, code: &Code) -> crate::gaussian::Gaussian {
        let SetCoding { lattice, grid, .. } = &self.coding;
        lattice.gaussian(code, &lattice.shape(code), grid, self.model)
    }

    /// Indices in rounds: within one, no two patches touch; of two that touch, the first in order
    /// is in the earlier round.
    fn rounds(&self, picture: &Picture, codes: &[Code]) -> Vec<Vec<usize>> {
        let columns = picture.width().div_ceil(BLOCK);
        let rows = picture.height().div_ceil(BLOCK);
        let mut next = vec![0; columns * rows];
        let mut rounds: Vec<Vec<usize>> = Vec::new();
        for (index, code) in codes.iter().enumerate() {
            let Some([x, y]) = picture.bounds(&self.gaussian(code)) else {
                // Not seen at all: any round will remove it.
                if rounds.is_empty() {
                    rounds.push(Vec::new());
                }
                rounds[0].push(index);
                continue;
            };
            let blocks = (y.start / BLOCK..y.end.div_ceil(BLOCK)).flat_map(|row| {
                (x.start / BLOCK..x.end.div_ceil(BLOCK)).map(move |c| row * columns + c)
            });
            let round = blocks.clone().map(|block| next[block]).max().unwrap_or(0);
            blocks.for_each(|block| next[block] = round + 1);
            if round == rounds.len() {
                rounds.push(Vec::new());
            }
            rounds[round].push(index);
        }
        rounds
    }

    /// The best of a code and its neighbours; `None` if the picture is better off without.
    fn choose(&self, picture: &Picture, patch: &mut Patch, code: Code, level: u32) -> Option<Code> {
        patch.load(picture, &self.gaussian(&code)).then_some(())?;
        let mut best = self.judged(patch, code, level);
        if let Some(better) = self.recolored(patch, code, level)
            && better.value < best.value
        {
            best = better;
        }
        for candidate in self.neighbours(best.code) {
            if let Some(other) = self.recolored(patch, candidate, level)
                && other.value < best.value
            {
                best = other;
            }
        }
        (best.value < 0.0).then_some(best.code)
    }

    /// What a code is worth as it is.
    fn judged(&self, patch: &mut Patch, code: Code, level: u32) -> Choice {
        let change = patch.change(&self.gaussian(&code), self.model);
        Choice { code, value: change.error + self.lambda * self.bits(code, level) }
    }

    /// What a code is worth with the best colours for its geometry.
    fn recolored(&self, patch: &mut Patch, mut code: Code, level: u32) -> Option<Choice> {
        let lattice = self.coding.lattice;
        let change = patch.change(&self.gaussian(&code), self.model);
        if change.weight <= 0.0 {
            return None;
        }
        let units = lattice.color_units(&code);
        for (axis, &unit) in units.iter().enumerate().take(self.coding.channels) {
            let best = code.color[axis] as f32 - change.by_axis[axis] / (change.weight * unit);
            let best = best.clamp(-30_000.0, 30_000.0);
            // By what the error grows for a unit beside the best value.
            let growth = change.weight * unit * unit;
            let rounded = best.round() as i32;
            let candidates = [
                rounded,
                rounded - rounded.signum(),
                rounded + 1,
                rounded - 1,
                code.color[axis],
                0,
            ];
            let cost = |value: i32| {
                let mut candidate = code;
                candidate.color[axis] = value;
                let off = value as f32 - best;
                growth * off * off + self.lambda * self.bits(candidate, level)
            };
            let costs = candidates.map(|value| (cost(value), value));
            let (_, value) = costs.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
            code.color[axis] = value;
        }
        if patch.is_clamped() {
            return Some(self.judged(patch, code, level));
        }
        let error = change.with(code.color, units, self.coding.channels);
        Some(Choice { code, value: error + self.lambda * self.bits(code, level) })
    }

    fn bits(&self, code: Code, level: u32) -> f32 {
        self.tree + self.coding.cost(code, level, self.costs)
    }

    /// A step in each component, and a class up and down.
    fn neighbours(&self, code: Code) -> impl Iterator<Item = Code> {
        let (lattice, grid) = (self.coding.lattice, self.coding.grid);
        let here = self.gaussian(&code);
        let shapes = [-1, 1].into_iter().flat_map(move |step| {
            (0..3).map(move |component| {
                let mut code = code;
                match component {
                    0 => code.size += step,
                    1 => code.ratio += step,
                    _ => code.slant += step,
                }
                code.center = lattice.placed(&code, here.center, &grid);
                code
            })
        });
        let moves = [(0, false), (0, true), (1, false), (1, true)];
        let moves = moves
            .into_iter()
            .filter_map(move |(axis, forward)| lattice.moved(&code, axis, forward, &grid));
        let model = self.model;
        let classes = [code.class.checked_sub(1), Some(code.class + 1)];
        let classes = classes.into_iter().flatten().filter(|&class| class <= MAX_CLASS);
        let classes = classes.map(move |class| lattice.code(&here, class, &grid, model));
        shapes.chain(moves).chain(classes)
    }
}
