//! The schedule of a training run: when Gaussians are added, culled and quantized.

use super::training::Training;
use crate::encode::options::Precision;

// Constants: docs/tuning.md, "Growth".
/// Iterations between two culls of the surplus.
const CULL_INTERVAL: u32 = 10;

/// The schedule of a training run. Growth comes first, then the culling of the surplus that it
/// added beyond the budget, then quantization.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TrainingSchedule {
    growth_end: u32,
    growth_interval: u32,
    cull_end: u32,
    /// The first iteration with quantized values; `u32::MAX` for none.
    pub(crate) quantized_from: u32,
}

impl TrainingSchedule {
    pub(crate) fn new(training: &Training, precision: Precision) -> Self {
        let Training { iterations, densification, quantization, .. } = training;
        let share = |share: f32| (share * *iterations as f32).round() as u32;
        let growth_end = share(densification.end).min(iterations - 1);
        let cull_end = share(densification.culled).clamp(growth_end, iterations - 1);
        Self {
            growth_end,
            growth_interval: (growth_end / densification.steps.max(1)).max(1),
            cull_end,
            quantized_from: match precision {
                Precision::Float | Precision::Entropy => u32::MAX,
                // Growth works on float values, and the quantizers are initialized from the
                // Gaussians that remain.
                Precision::Packed => share(quantization.warm_up).clamp(cull_end, iterations - 1),
            },
        }
    }

    /// If Gaussians are added after `done` iterations: the number of growth steps that follow.
    pub(crate) fn growths_left(&self, done: u32) -> Option<u32> {
        let due = done.is_multiple_of(self.growth_interval) && done <= self.growth_end;
        due.then(|| (self.growth_end - done) / self.growth_interval)
    }

    /// If a part of the surplus is culled after `done` iterations: the number of culls that follow.
    pub(crate) fn culls_left(&self, done: u32) -> Option<u32> {
        let left = self.cull_end.checked_sub(done)?;
        let due = left.is_multiple_of(CULL_INTERVAL) && done >= self.growth_end;
        due.then_some(left / CULL_INTERVAL)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The iterations after which `left` gives something, and what it gives.
    fn events(iterations: u32, left: impl Fn(u32) -> Option<u32>) -> Vec<(u32, u32)> {
        (1..=iterations).filter_map(|done| Some((done, left(done)?))).collect()
    }

    fn growths(schedule: &TrainingSchedule, iterations: u32) -> Vec<(u32, u32)> {
        events(iterations, |done| schedule.growths_left(done))
    }

    fn culls(schedule: &TrainingSchedule, iterations: u32) -> Vec<(u32, u32)> {
        events(iterations, |done| schedule.culls_left(done))
    }

    fn paper(iterations: u32) -> Training {
        Training { iterations, ..Training::paper() }
    }

    #[test]
    fn growth_ends_before_culling_and_culling_before_quantization() {
        for iterations in [1, 2, 3, 10, 75, 600, 50_000] {
            for training in [Training::fast(iterations), paper(iterations)] {
                let schedule = TrainingSchedule::new(&training, Precision::Packed);
                let growths = growths(&schedule, iterations);
                let culls = culls(&schedule, iterations);
                // A single iteration leaves no time for either.
                assert_eq!(growths.is_empty(), iterations == 1, "{training:?}");
                assert_eq!(culls.is_empty(), iterations == 1, "{training:?}");
                // Each counts down to 0, so that nothing is left to do after the last.
                for events in [&growths, &culls] {
                    let left = events.iter().map(|&(_, left)| left);
                    assert!(left.eq((0..events.len() as u32).rev()), "{training:?}: {events:?}");
                }
                let last_growth = growths.last().map_or(0, |&(done, _)| done);
                assert!(culls.iter().all(|&(done, _)| done >= last_growth), "{training:?}");
                let last_cull = culls.last().map_or(0, |&(done, _)| done);
                assert!(last_cull <= schedule.quantized_from, "{training:?}");
                assert!(schedule.quantized_from < iterations, "{training:?}");
            }
        }
    }

    #[test]
    fn the_paper_grows_every_5000_iterations() {
        let schedule = TrainingSchedule::new(&paper(50_000), Precision::Packed);
        let expected: Vec<_> = (1..=9).map(|growth| (5_000 * growth, 9 - growth)).collect();
        assert_eq!(growths(&schedule, 50_000), expected);
        assert_eq!(culls(&schedule, 50_000), [(45_000, 0)]);
        assert_eq!(schedule.quantized_from, 45_000);
    }

    #[test]
    fn only_the_packed_precision_is_trained_with_quantization() {
        let training = Training::fast(600).with_quantization();
        let quantized_from = |precision| TrainingSchedule::new(&training, precision).quantized_from;
        assert_eq!(quantized_from(Precision::Packed), 360);
        assert_eq!(quantized_from(Precision::Float), u32::MAX);
        assert_eq!(quantized_from(Precision::Entropy), u32::MAX);
    }

    #[test]
    fn growth_steps_are_at_equal_intervals() {
        let schedule = TrainingSchedule::new(&Training::fast(600), Precision::Entropy);
        let expected: Vec<_> = (1..=60).map(|growth| (6 * growth, 60 - growth)).collect();
        assert_eq!(growths(&schedule, 600), expected);
        let expected: Vec<_> = (0..=6).map(|cull| (360 + 10 * cull, 6 - cull)).collect();
        assert_eq!(culls(&schedule, 600), expected);
    }
}
