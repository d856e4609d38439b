//! What each part of the method is worth: components, bit depths, intervals, seeds.

use anyhow::Result;
use image_gip::training::Training;
use image_gip::{Chart, Encoder, Precision, Target};

use super::methods::{self, CHARTS};
use crate::bench::Bench;
use crate::curve::{Curve, bd_rate};
use crate::gip;
use crate::pictures::Picture;
use crate::store::Store;
use crate::table::{Table, mean, percent};

/// Gaussians where the table names no others.
const GAUSSIANS: u32 = 5_000;
const QUICK_GAUSSIANS: u32 = 2_500;
/// Gaussians for the curves of bit depths.
const CURVE: [u32; 4] = [1_500, 2_500, 4_000, 6_500];
const QUICK_CURVE: [u32; 2] = [1_500, 3_500];
/// Iterations of ours for bit depths and seeds.
const OWN_ITERATIONS: u32 = 600;
const QUICK_OWN_ITERATIONS: u32 = 150;
const PICTURES: usize = 8;
const QUICK_PICTURES: usize = 1;
/// Bits of position, shape and colour; the first are the paper's choice.
const DEPTHS: [[u8; 3]; 8] = [
    [12, 10, 6],
    [12, 10, 8],
    [12, 8, 6],
    [12, 8, 8],
    [16, 10, 6],
    [16, 10, 8],
    [16, 8, 6],
    [16, 8, 8],
];
/// The paper's intervals of pruning and numbers of growths: every 5,000 or every 10,000 of 50,000
/// iterations, none after 90 %.
const PRUNING: [u32; 3] = [100, 500, 1_000];
const GROWTHS: [u32; 2] = [9, 4];
const SEEDS: u64 = 5;

/// Everything that the measurements share.
#[derive(Debug)]
struct Ablation<'a> {
    store: Store<4, 4>,
    product: &'a str,
    pictures: &'a [Picture],
    gaussians: u32,
    iterations: u32,
    own_iterations: u32,
}

/// Means over the pictures.
#[derive(Clone, Copy, Debug)]
struct Outcome {
    rate: f64,
    psnr: f64,
    ms_ssim: f64,
    seconds: f64,
}

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    let choose = |quick: u32, full: u32| if bench.quick { quick } else { full };
    let pictures = if bench.quick { QUICK_PICTURES } else { PICTURES };
    let mut ablation = Ablation {
        store: bench.store(
            "ablation.csv",
            ["variant", "iterations", "gaussians", "image"],
            ["bpp", "psnr", "msssim", "seconds"],
        )?,
        product: &bench.product,
        pictures: &bench.pictures[..pictures.min(bench.pictures.len())],
        gaussians: choose(QUICK_GAUSSIANS, GAUSSIANS),
        iterations: bench.iterations,
        own_iterations: choose(QUICK_OWN_ITERATIONS, OWN_ITERATIONS),
    };
    let curve: &[u32] = if bench.quick { &QUICK_CURVE } else { &CURVE };
    let mut text = format!(
        "Compared with: variants of GaussianImage++ (components, intervals) and of our own encoder \
         (bit depths, seeds). {} Means; pictures: {}.\n",
        methods::description(ablation.iterations),
        ablation.pictures.len(),
    );
    text.push_str(&ablation.components()?);
    text.push_str(&ablation.intervals()?);
    text.push_str(&ablation.depths(curve)?);
    text.push_str(&ablation.seeds()?);
    Ok(text)
}

impl Ablation<'_> {
    /// D3 and CAF, for each parameterization.
    fn components(&mut self) -> Result<String> {
        let mut table =
            Table::new(&["parameterization", "neither", "CAF alone", "D3 alone", "D3 and CAF"]);
        for (name, chart) in CHARTS {
            let mut cells = vec![name.to_owned()];
            for (d3, caf) in [(false, false), (false, true), (true, false), (true, true)] {
                let training = methods::paper(self.iterations, chart, d3, caf);
                let variant = format!("{name}, D3 {d3}, CAF {caf}");
                let outcome = self.float(&variant, training)?;
                cells.push(format!("{:.2} dB, {:.4}", outcome.psnr, outcome.ms_ssim));
            }
            table.row(&cells);
        }
        Ok(format!(
            "\n### Components\n\nPSNR and MS-SSIM of {} Gaussians as floats.\n{}",
            self.gaussians,
            table.finish()
        ))
    }

    /// How often to prune and to grow.
    fn intervals(&mut self) -> Result<String> {
        let mut table =
            Table::new(&["pruned every", "grown", "PSNR in dB", "MS-SSIM", "training s"]);
        for growths in GROWTHS {
            for interval in PRUNING {
                let mut training = methods::paper(self.iterations, Chart::Covariance, true, true);
                training.densification.prune_interval = interval;
                training.densification.steps = growths;
                let variant = format!("pruned every {interval}, grown {growths} times");
                let outcome = self.float(&variant, training)?;
                table.row(&[
                    format!("{interval} iterations"),
                    format!("{growths} times"),
                    format!("{:.2}", outcome.psnr),
                    format!("{:.4}", outcome.ms_ssim),
                    format!("{:.1}", outcome.seconds),
                ]);
            }
        }
        Ok(format!(
            "\n### Intervals of pruning and growing\n\nGaussianImage++ with {} Gaussians as floats, \
             grown as often as with the paper's intervals of 5,000 and 10,000 of 50,000 \
             iterations.\n{}",
            self.gaussians,
            table.finish()
        ))
    }

    /// How many bits each attribute gets.
    fn depths(&mut self, counts: &[u32]) -> Result<String> {
        let mut rows = Vec::new();
        for depths in DEPTHS {
            let [position, shape, color] = depths;
            let mut training = Training::fast(self.own_iterations);
            training.quantization.position_bits = position;
            training.quantization.shape_bits = shape;
            training.quantization.color_bits = color;
            let variant = format!("{position}/{shape}/{color} bits");
            let mut outcomes = Vec::new();
            for &count in counts {
                let encoder = Encoder::new().with_seed(gip::SEED).with_training(training.clone());
                outcomes.push(self.outcome(&variant, self.own_iterations, count, &encoder)?);
            }
            rows.push((variant, outcomes));
        }
        let curve = |outcomes: &[Outcome]| Curve::new(outcomes.iter().map(|o| (o.rate, o.psnr)));
        let anchor = curve(&rows[0].1);
        let mut columns = vec!["position/shape/colour".to_owned()];
        columns.extend(counts.iter().map(|count| format!("{count} Gaussians")));
        columns.push(format!("BD-rate against {}", rows[0].0));
        let mut table = Table::new(&columns);
        for (variant, outcomes) in rows {
            let mut cells = vec![variant];
            let figures = outcomes.iter().map(|o| format!("{:.2} dB, {:.3} bpp", o.psnr, o.rate));
            cells.extend(figures);
            cells.push(percent(bd_rate(&anchor, &curve(&outcomes), (1e-3, 1e3))));
            table.row(&cells);
        }
        Ok(format!(
            "\n### Bit depths\n\nOur encoder at {} iterations, quantized.\n{}",
            self.own_iterations,
            table.finish()
        ))
    }

    /// What the seed changes.
    fn seeds(&mut self) -> Result<String> {
        let mut outcomes = Vec::new();
        for seed in 0..SEEDS {
            let training = Training::fast(self.own_iterations);
            let encoder = Encoder::new().with_seed(seed).with_training(training);
            let variant = format!("seed {seed}");
            outcomes.push(self.outcome(&variant, self.own_iterations, self.gaussians, &encoder)?);
        }
        let mut table = Table::new(&["", "bpp", "PSNR in dB", "MS-SSIM"]);
        let figures: [fn(&Outcome) -> f64; 3] = [|o| o.rate, |o| o.psnr, |o| o.ms_ssim];
        let columns = figures.map(|figure| outcomes.iter().map(figure).collect::<Vec<f64>>());
        for (name, figure) in [("mean", average as fn(&[f64]) -> f64), ("deviation", deviation)] {
            let mut cells = vec![name.to_owned()];
            cells.extend(columns.iter().map(|column| format!("{:.5}", figure(column))));
            table.row(&cells);
        }
        Ok(format!(
            "\n### Seeds\n\nOur encoder at {} iterations, quantized, {} Gaussians, {SEEDS} seeds: of \
             the means over the pictures, the mean and the standard deviation.\n{}",
            self.own_iterations,
            self.gaussians,
            table.finish()
        ))
    }

    /// A published method without quantization.
    fn float(&mut self, variant: &str, training: Training) -> Result<Outcome> {
        let iterations = training.iterations;
        let encoder = Encoder::new().with_seed(gip::SEED).with_training(training);
        let encoder = encoder.with_precision(Precision::Float);
        self.outcome(variant, iterations, self.gaussians, &encoder)
    }

    fn outcome(
        &mut self,
        variant: &str,
        iterations: u32,
        gaussians: u32,
        encoder: &Encoder,
    ) -> Result<Outcome> {
        let mut rows = Vec::new();
        for picture in self.pictures {
            let (rounds, count) = (iterations.to_string(), gaussians.to_string());
            let key = [variant, &rounds, &count, &picture.name];
            rows.push(self.store.get(self.product, key, || {
                let encoder = encoder.clone().with_target(Target::Gaussians(gaussians));
                let coded = gip::code(encoder, picture, None)?;
                let (report, ms_ssim) = (&coded.report, coded.distortion.ms_ssim);
                Ok([picture.rate(coded.bytes), report.psnr_float, ms_ssim, report.seconds])
            })?);
        }
        let of = |column: usize| mean(rows.iter().map(|row| row[column])).unwrap_or(f64::NAN);
        Ok(Outcome { rate: of(0), psnr: of(1), ms_ssim: of(2), seconds: of(3) })
    }
}

fn average(values: &[f64]) -> f64 {
    mean(values.iter().copied()).unwrap_or(f64::NAN)
}

/// The standard deviation of a sample.
fn deviation(values: &[f64]) -> f64 {
    let mean = average(values);
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (squares / (values.len() as f64 - 1.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deviations() {
        assert_eq!(average(&[1.0, 2.0, 6.0]), 3.0);
        assert_eq!(deviation(&[1.0, 2.0, 6.0]), 7.0_f64.sqrt());
        assert_eq!(deviation(&[5.0; 5]), 0.0);
    }
}
