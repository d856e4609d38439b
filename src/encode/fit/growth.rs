//! Birth and death of Gaussians: densification, culling and pruning, for a budget.

use rayon::prelude::*;

use super::components::Components;
use super::densify::{Densifier, MIN_COLOR};
use super::paper::decoded;
use super::pass::Scene;
use super::trained::Fit;
use super::training::Portion;
use crate::encode::error::Result;
use crate::encode::loss::{Distortion, RenderingError, SquaredError};
use crate::encode::progress::Observer;
use crate::encode::rate_model;
use crate::gaussian::Gaussian;

impl Fit<'_> {
    /// The number of Gaussians that the budget sets, if training changes the error by the factor
    /// `foreseen`.
    pub(super) fn wanted(&self, foreseen: f64) -> usize {
        let RenderingError { squared, distortion } = self.error;
        let component_bits = || self.component_bits(Distortion(distortion.0 * foreseen));
        // As many pixels of the picture as come to one of the copy.
        let factor = foreseen * 4_f64.powi(self.halvings as i32);
        let error = RenderingError {
            squared: SquaredError(squared.0 * factor),
            distortion: Distortion(distortion.0 * factor),
        };
        self.budget.wanted(self.len(), error, component_bits, self.most())
    }

    /// The bits of a component on average, if the picture has this distortion.
    fn component_bits(&self, distortion: Distortion) -> f64 {
        if self.len() == 0 {
            return rate_model::USUAL_COMPONENT_BITS;
        }
        let step = rate_model::color_step(rate_model::step_for(distortion, self.len()));
        let bits = |values: &Components| {
            rate_model::component_bits(&values.gaussian(self.bounds.parameterization), step)
        };
        self.parameters.values.iter().map(bits).sum::<f64>() / self.len() as f64
    }

    /// How many Gaussians this growth step adds. `kept` Gaussians remain when the surplus has been
    /// culled; `steps_left` growth steps follow this one.
    pub(super) fn portion(&self, kept: usize, steps_left: u32) -> usize {
        let densification = &self.training.densification;
        let grown = kept as f64 * (1.0 + f64::from(densification.surplus));
        let missing = (grown.round() as usize).saturating_sub(self.len());
        match densification.portion {
            _ if steps_left == 0 => missing,
            Portion::Even => missing.div_ceil(steps_left as usize + 1),
            Portion::Half => missing.div_ceil(2),
        }
    }

    /// Densification: adds up to `count` Gaussians where the error is large, and up to `replaced`
    /// more in place of the least important ones. Where there is no place for all, fewer are replaced.
    pub(super) fn grow(
        &mut self,
        count: usize,
        replaced: usize,
        observer: &mut Observer<'_>,
    ) -> Result<()> {
        if count + replaced == 0 {
            return Ok(());
        }
        let (kernel, base) = (self.training.kernel, self.base);
        let densifier = Densifier {
            options: &self.training.densification,
            filter: self.training.filter,
            pass: &self.pass,
            scene: Scene { tiled: self.tiled, splats: &self.splats, kernel, base },
            bounds: self.bounds,
            count: self.parameters.len() - replaced,
        };
        let new = densifier.new_gaussians(count + replaced, &mut self.rng, observer)?;
        observer.poll()?;
        self.cull(new.len() * replaced / (count + replaced), observer)?;
        self.free_bins();
        self.parameters.extend(&new);
        self.parameters.sort(observer)?;
        self.invalidate();
        Ok(())
    }

    /// Culling: removes the `count` Gaussians of least energy.
    pub(super) fn cull(&mut self, count: usize, observer: &mut Observer<'_>) -> Result<()> {
        let count = count.min(self.len());
        if count == 0 {
            return Ok(());
        }
        let mut keys = self.importances(observer)?;
        observer.poll()?;
        keys.select_nth_unstable(count - 1);
        let mut keep = vec![true; keys.len()];
        for key in &keys[..count] {
            // The cast leaves the index.
            keep[*key as u32 as usize] = false;
        }
        observer.poll()?;
        self.parameters.retain(|index| keep[index]);
        self.invalidate();
        observer.poll()
    }

    /// The trained values of all Gaussians, the most important first.
    pub(super) fn by_importance(&self, observer: &mut Observer<'_>) -> Result<Vec<Components>> {
        let mut keys = self.importances(observer)?;
        keys.par_sort_unstable();
        observer.poll()?;
        // The cast leaves the index.
        let value = |key: u64| self.parameters.values[key as u32 as usize];
        Ok(keys.into_iter().rev().map(value).collect())
    }

    /// Keys in the order of energy, and of equal ones in that of the Gaussians, with their indices.
    fn importances(&self, observer: &mut Observer<'_>) -> Result<Vec<u64>> {
        let parameterization = self.bounds.parameterization;
        let items = self.parameters.values.iter().enumerate();
        observer.map(items, |(index, values)| {
            let gaussian = values.gaussian(parameterization);
            let Gaussian { center, cholesky, .. } = gaussian;
            let perceptual_weight = self.tiled.loss.weight_under(center, cholesky);
            u64::from(ordered(gaussian.energy() * perceptual_weight)) << 32 | index as u64
        })
    }

    /// Pruning: removes Gaussians that are invalid, nearly without colour, or outside the picture.
    pub(super) fn prune(&mut self, observer: &mut Observer<'_>) -> Result<()> {
        let values = &self.parameters.values;
        let parameterization = self.bounds.parameterization;
        let quantizers = self.quantizers.as_ref();
        let keep = observer.map(values.iter().enumerate(), |(index, values)| {
            let gaussian = decoded(quantizers, values).gaussian(parameterization);
            let has_color = gaussian.color.iter().any(|color| color.abs() >= MIN_COLOR);
            let is_inside = self.pass.touches(index);
            gaussian.is_drawable() && has_color && is_inside
        })?;
        if keep.contains(&false) {
            self.parameters.retain(|index| keep[index]);
            self.invalidate();
        }
        observer.poll()
    }
}

/// A number that is larger for larger values, in the order of [`f32::total_cmp`].
fn ordered(value: f32) -> u32 {
    let bits = value.to_bits();
    if bits >> 31 == 0 { bits | 1 << 31 } else { !bits }
}

#[cfg(test)]
mod tests {
    use super::ordered;

    #[test]
    fn ordered_numbers_are_in_total_order() {
        let values =
            [-f32::NAN, f32::NEG_INFINITY, -2.0, -0.0, 0.0, 1e-40, 1.0, f32::INFINITY, f32::NAN];
        assert!(values.is_sorted_by(|a, b| a.total_cmp(b).is_lt()));
        assert!(values.is_sorted_by(|a, b| ordered(*a) < ordered(*b)));
    }
}
