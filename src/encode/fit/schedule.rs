//! When what happens in a training run.

use super::training::Training;
use crate::encode::options::Precision;

/// Iterations between two culls of the surplus.
const CULL_INTERVAL: u32 = 10;

/// The iterations after which Gaussians come, go and get quantized. Growth comes first, then the
/// culling of what it grew beyond the budget, then quantization.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TrainingSchedule {
    growth_end: u32,
    growth_interval: u32,
    cull_end: u32,
    /// The first iteration with quantized values.
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
                // Growth needs the float values; quantizers are fitted to all Gaussians.
                Precision::Packed => share(quantization.warm_up).clamp(cull_end, iterations - 1),
            },
        }
    }

    /// Whether an iteration's Gaussians may be those of the file: none are to come or go any more.
    pub(crate) fn is_settled(&self, iteration: u32) -> bool {
        iteration >= self.cull_end
    }

    /// If Gaussians are added after `done` iterations: how many times again later.
    pub(crate) fn growths_left(&self, done: u32) -> Option<u32> {
        let due = done.is_multiple_of(self.growth_interval) && done <= self.growth_end;
        due.then(|| (self.growth_end - done) / self.growth_interval)
    }

    /// If a part of the surplus goes after `done` iterations: how many times again later.
    pub(crate) fn culls_left(&self, done: u32) -> Option<u32> {
        let left = self.cull_end.checked_sub(done)?;
        let due = left.is_multiple_of(CULL_INTERVAL) && done >= self.growth_end;
        due.then_some(left / CULL_INTERVAL)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growth_ends_before_culling_and_culling_before_quantization() {
        for iterations in [1, 2, 3, 10, 75, 600, 50_000] {
            for training in [Training::fast(iterations), {
                let mut paper = Training::paper();
                paper.iterations = iterations;
                paper
            }] {
                let plan = TrainingSchedule::new(&training, Precision::Packed);
                let dones = 1..=iterations;
                let growths: Vec<u32> =
                    dones.clone().filter(|&done| plan.growths_left(done).is_some()).collect();
                let culls: Vec<u32> =
                    dones.filter(|&done| plan.culls_left(done).is_some()).collect();
                assert!(growths.iter().all(|done| culls.iter().all(|cull| done <= cull)));
                assert!(culls.iter().all(|&cull| cull <= plan.quantized_from));
                assert!(plan.quantized_from < iterations);
                // The last of each finishes the job.
                if let Some(&last) = growths.last() {
                    assert_eq!(plan.growths_left(last), Some(0));
                }
                if let Some(&last) = culls.last() {
                    assert_eq!(plan.culls_left(last), Some(0));
                }
            }
        }
    }
}
