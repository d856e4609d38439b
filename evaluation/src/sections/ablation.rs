//! What each part of the method contributes: components, intervals, bit depths, seeds.

use anyhow::Result;
use image_gip::training::Training;
use image_gip::{Encoder, Parameterization, Precision, Target, Threads};

use super::methods::{self, PARAMETERIZATIONS};
use super::quantizers;
use crate::bench::Bench;
use crate::comparison::{Better, NamedFigures, better_than, list_or_none};
use crate::curve::{Curve, bd_rate};
use crate::gip;
use crate::parallel;
use crate::pictures::TestPicture;
use crate::store::Store;
use crate::table::{Table, mean, percent};

/// Number of Gaussians, except for the curves of bit depths.
const GAUSSIANS: u32 = 5_000;
const QUICK_GAUSSIANS: u32 = 1_500;
/// Numbers of Gaussians for the curves of bit depths.
const CURVE: [u32; 4] = [1_500, 2_500, 4_000, 6_500];
const QUICK_CURVE: [u32; 2] = [1_000, 2_000];
/// Iterations of our encoder for bit depths and seeds.
const OWN_ITERATIONS: u32 = 320;
const QUICK_OWN_ITERATIONS: u32 = 50;
/// How many pictures: for components and seeds, and for the tables with more settings.
const PICTURES: usize = 4;
const FEWER_PICTURES: usize = 2;
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
/// The paper's intervals of pruning in iterations, and how often Gaussians grow in number: every
/// 5,000 or every 10,000 of 50,000 iterations up to 90 % of them.
const PRUNING: [u32; 3] = [100, 500, 1_000];
const GROWTHS: [u32; 2] = [9, 4];
const SEEDS: u64 = 5;

/// What components and intervals are compared by.
const CRITERIA: [(&str, Better); 2] = [("PSNR", Better::Higher), ("MS-SSIM", Better::Higher)];

/// What all tables share.
#[derive(Debug)]
struct Ablation<'a> {
    store: Store<4, 3>,
    bench: &'a Bench,
    pictures: Vec<TestPicture>,
    gaussians: u32,
    iterations: u32,
    own_iterations: u32,
}

/// Means over the pictures.
#[derive(Clone, Copy, Debug)]
struct VariantMeans {
    rate: f64,
    psnr: f64,
    ms_ssim: f64,
}

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    let bench: &Bench = bench;
    let choose = |quick: u32, full: u32| if bench.quick { quick } else { full };
    let pictures = |full: usize| bench.sample(if bench.quick { QUICK_PICTURES } else { full });
    let mut ablation = Ablation {
        store: bench.store(
            "ablation.csv",
            ["variant", "iterations", "gaussians", "image"],
            ["bpp", "psnr", "msssim"],
        )?,
        bench,
        pictures: pictures(PICTURES),
        gaussians: choose(QUICK_GAUSSIANS, GAUSSIANS),
        iterations: bench.iterations,
        own_iterations: choose(QUICK_OWN_ITERATIONS, OWN_ITERATIONS),
    };
    let counts: &[u32] = if bench.quick { &QUICK_CURVE } else { &CURVE };
    let mut text = format!(
        "Compared with: variants of GaussianImage++ (components, intervals) and of our own encoder \
         (placement, quantizers, bit depths, seeds), tuned for PSNR. {} All figures are means over the pictures that each \
         table names; PSNR is that of the float rendering.\n",
        methods::description(ablation.iterations),
    );
    text.push_str(&ablation.components()?);
    text.push_str(&ablation.seeds()?);
    ablation.pictures = pictures(FEWER_PICTURES);
    text.push_str(&ablation.intervals()?);
    text.push_str(&ablation.placements()?);
    text.push_str(&ablation.depths(counts)?);
    let iterations = ablation.own_iterations;
    text.push_str(&quantizers::measure(bench, &ablation.pictures, counts, iterations)?);
    Ok(text)
}

impl Ablation<'_> {
    /// The two components of GaussianImage++, D3 (densification) and CAF (filter), for each
    /// parameterization.
    fn components(&mut self) -> Result<String> {
        let mut table =
            Table::new(&["parameterization", "neither", "CAF alone", "D3 alone", "D3 and CAF"]);
        let mut comparisons = String::new();
        for (name, parameterization) in PARAMETERIZATIONS {
            let mut cells = vec![name.to_owned()];
            let mut compared: Vec<NamedFigures> = Vec::new();
            for (part, d3, caf) in [
                ("neither", false, false),
                ("CAF alone", false, true),
                ("D3 alone", true, false),
                ("both", true, true),
            ] {
                let training = methods::paper(self.iterations, parameterization, d3, caf);
                let variant = format!("{name}, D3 {d3}, CAF {caf}");
                let outcome = self.float(&variant, training)?;
                cells.push(format!("{:.2} dB, {:.4}", outcome.psnr, outcome.ms_ssim));
                compared.push((part.to_owned(), vec![outcome.psnr, outcome.ms_ssim]));
            }
            table.row(&cells);
            if let Some((_, both)) = compared.pop() {
                let subject = (format!("{name} with both components"), both);
                comparisons.push_str(&better_than(&CRITERIA, &subject, &compared));
            }
        }
        Ok(format!(
            "\n### Components\n\nCompared with each other: {} Gaussians as floats with and without \
             D3 and CAF; {}.\n{}{comparisons}",
            self.gaussians,
            self.bench.pictures_used(self.pictures.len()),
            table.finish()
        ))
    }

    /// How often to prune and to grow.
    fn intervals(&mut self) -> Result<String> {
        let mut table = Table::new(&["pruned every", "grown", "PSNR in dB", "MS-SSIM"]);
        let mut compared: Vec<NamedFigures> = Vec::new();
        for growths in GROWTHS {
            for interval in PRUNING {
                let mut training =
                    methods::paper(self.iterations, Parameterization::Covariance, true, true);
                training.densification.prune_interval = interval;
                training.densification.steps = growths;
                let variant = format!("pruned every {interval} and grown {growths} times");
                let outcome = self.float(&variant, training)?;
                table.row(&[
                    format!("{interval} iterations"),
                    format!("{growths} times"),
                    format!("{:.2}", outcome.psnr),
                    format!("{:.4}", outcome.ms_ssim),
                ]);
                compared.push((variant, vec![outcome.psnr, outcome.ms_ssim]));
            }
        }
        // The paper's choice comes first.
        Ok(format!(
            "\n### Intervals of pruning and growing\n\nCompared with each other: GaussianImage++ \
             with {} Gaussians as floats, grown as often as with the paper's intervals of 5,000 \
             and 10,000 of 50,000 iterations; {}.\n{}{}",
            self.gaussians,
            self.bench.pictures_used(self.pictures.len()),
            table.finish(),
            better_than(&CRITERIA, &compared[0], &compared[1..]),
        ))
    }

    /// Where new Gaussians go.
    fn placements(&mut self) -> Result<String> {
        let mut table = Table::new(&["placement", "PSNR in dB", "MS-SSIM"]);
        let mut compared: Vec<NamedFigures> = Vec::new();
        for (name, training) in methods::placements(self.own_iterations) {
            let outcome = self.float(&format!("placement {name}"), training)?;
            table.row(&[
                name.to_owned(),
                format!("{:.2}", outcome.psnr),
                format!("{:.4}", outcome.ms_ssim),
            ]);
            compared.push((name.to_owned(), vec![outcome.psnr, outcome.ms_ssim]));
        }
        // The encoder's choice comes first.
        Ok(format!(
            "\n### Placement\n\nCompared with each other: our encoder at {} iterations, {} Gaussians as floats; \
             {}.\n{}{}",
            self.own_iterations,
            self.gaussians,
            self.bench.pictures_used(self.pictures.len()),
            table.finish(),
            better_than(&CRITERIA, &compared[0], &compared[1..]),
        ))
    }

    /// Bit depths of position, shape and colour.
    fn depths(&mut self, counts: &[u32]) -> Result<String> {
        let mut rows = Vec::new();
        for depths in DEPTHS {
            let [position, shape, color] = depths;
            let training = methods::ours(self.own_iterations, depths);
            let variant = format!("{position}/{shape}/{color} bits");
            let mut outcomes = Vec::new();
            for &count in counts {
                let encoder = gip::psnr_encoder(gip::EFFORT).with_training(training.clone());
                let encoder = encoder.with_precision(Precision::Packed);
                outcomes.push(self.means(&variant, self.own_iterations, count, &encoder)?);
            }
            rows.push((variant, outcomes));
        }
        let curve =
            |outcomes: &[VariantMeans]| Curve::new(outcomes.iter().map(|o| (o.rate, o.psnr)));
        let anchor = curve(&rows[0].1);
        let mut columns = vec!["position/shape/colour".to_owned()];
        columns.extend(counts.iter().map(|count| format!("{count} Gaussians")));
        columns.push(format!("BD-rate against {}", rows[0].0));
        let mut table = Table::new(&columns);
        let mut better = Vec::new();
        for (variant, outcomes) in &rows {
            let mut cells = vec![variant.clone()];
            let figures = outcomes.iter().map(|o| format!("{:.2} dB, {:.3} bpp", o.psnr, o.rate));
            cells.extend(figures);
            let difference = bd_rate(&anchor, &curve(outcomes), (1e-3, 1e3));
            cells.push(percent(difference));
            table.row(&cells);
            if difference.is_some_and(|difference| difference < 0.0) {
                better.push(variant.as_str());
            }
        }
        Ok(format!(
            "\n### Bit depths\n\nCompared with: the paper's choice, the first row. Our encoder at \
             {} iterations, packed (bit-packed codes of LSQ+ quantizers); {}.\n{}\nBetter than the \
             paper's choice by BD-rate: {}.\n",
            self.own_iterations,
            self.bench.pictures_used(self.pictures.len()),
            table.finish(),
            list_or_none(better.into_iter()),
        ))
    }

    /// What the seed changes.
    fn seeds(&mut self) -> Result<String> {
        let mut outcomes = Vec::new();
        for seed in 0..SEEDS {
            let training = Training::fast(self.own_iterations);
            let encoder = gip::psnr_encoder(gip::EFFORT).with_seed(seed).with_training(training);
            let encoder = encoder.with_precision(Precision::Packed);
            let variant = format!("seed {seed}");
            outcomes.push(self.means(&variant, self.own_iterations, self.gaussians, &encoder)?);
        }
        let mut table = Table::new(&["", "bpp", "PSNR in dB", "MS-SSIM"]);
        let figures: [fn(&VariantMeans) -> f64; 3] = [|o| o.rate, |o| o.psnr, |o| o.ms_ssim];
        let columns = figures.map(|figure| outcomes.iter().map(figure).collect::<Vec<f64>>());
        for (name, figure) in
            [("mean", average as fn(&[f64]) -> f64), ("standard deviation", standard_deviation)]
        {
            let mut cells = vec![name.to_owned()];
            cells.extend(columns.iter().map(|column| format!("{:.5}", figure(column))));
            table.row(&cells);
        }
        let order = |a: &f64, b: &f64| a.total_cmp(b);
        let [_, psnrs, _] = &columns;
        let least = psnrs.iter().copied().min_by(order).unwrap_or(f64::NAN);
        let most = psnrs.iter().copied().max_by(order).unwrap_or(f64::NAN);
        Ok(format!(
            "\n### Seeds\n\nCompared with each other: {SEEDS} seeds of our encoder at {} \
             iterations, packed, {} Gaussians; {}. Each seed gives a mean over the pictures; the \
             rows are the mean and the standard deviation of these means.\n{}\nThe worst seed \
             is {:.3} dB below the mean, the best {:.3} dB above.\n",
            self.own_iterations,
            self.gaussians,
            self.bench.pictures_used(self.pictures.len()),
            table.finish(),
            average(psnrs) - least,
            most - average(psnrs),
        ))
    }

    /// A method without quantization.
    fn float(&mut self, variant: &str, training: Training) -> Result<VariantMeans> {
        let iterations = training.iterations;
        let encoder = gip::psnr_encoder(gip::EFFORT).with_training(training);
        let encoder = encoder.with_precision(Precision::Float);
        self.means(variant, iterations, self.gaussians, &encoder)
    }

    fn means(
        &mut self,
        variant: &str,
        iterations: u32,
        gaussians: u32,
        encoder: &Encoder,
    ) -> Result<VariantMeans> {
        let (rounds, count) = (iterations.to_string(), gaussians.to_string());
        let jobs = self.pictures.iter();
        let jobs = jobs.map(|picture| ([variant, &rounds, &count, &picture.name], picture));
        let jobs: Vec<_> = jobs.collect();
        let (version, threads) = (&self.bench.product, &mut parallel::threads());
        let rows = self.store.all(version, threads, &jobs, |(), picture| {
            let encoder = encoder.clone().with_target(Target::Gaussians(gaussians));
            let measured = gip::encode(encoder, picture, Threads::One)?;
            let (report, ms_ssim) = (&measured.report, measured.distortion.ms_ssim);
            Ok([picture.rate(measured.bytes), report.psnr_float, ms_ssim])
        })?;
        let of = |column: usize| mean(rows.iter().map(|row| row[column])).unwrap_or(f64::NAN);
        Ok(VariantMeans { rate: of(0), psnr: of(1), ms_ssim: of(2) })
    }
}

fn average(values: &[f64]) -> f64 {
    mean(values.iter().copied()).unwrap_or(f64::NAN)
}

/// The standard deviation, estimated from a sample.
fn standard_deviation(values: &[f64]) -> f64 {
    let mean = average(values);
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (squares / (values.len() as f64 - 1.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_and_standard_deviations() {
        assert_eq!(average(&[1.0, 2.0, 6.0]), 3.0);
        assert_eq!(standard_deviation(&[1.0, 2.0, 6.0]), 7.0_f64.sqrt());
        assert_eq!(standard_deviation(&[5.0; 5]), 0.0);
    }
}
