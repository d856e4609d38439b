//! How time and memory grow with pixels and with Gaussians.

use anyhow::Result;
use image_gip::{Encoded, Target, Threads};

use crate::bench::Bench;
use crate::comparison::list_or_none;
use crate::plot::{Corner, Plot, Scale, Series};
use crate::table::Table;
use crate::{gip, memory};

/// Sizes in megapixels, and how many Gaussians each megapixel gets.
const MEGAPIXELS: [f64; 8] = [0.1, 0.2, 0.5, 1.0, 2.0, 4.0, 8.0, 24.0];
const QUICK_MEGAPIXELS: [f64; 2] = [0.1, 0.5];
const DENSITY: f64 = 12_500.0;
/// Numbers of Gaussians on one megapixel.
const GAUSSIANS: [u32; 8] = [1_000, 2_000, 5_000, 10_000, 20_000, 50_000, 100_000, 200_000];
const QUICK_GAUSSIANS: [u32; 2] = [1_000, 5_000];
/// The effort with which growth is measured: it only scales the number of iterations.
const GROWTH_EFFORT: u8 = 1;

/// What a picture of some size with some number of Gaussians costs.
#[derive(Clone, Copy, Debug)]
struct Cost {
    megapixels: f64,
    gaussians: f64,
    psnr: f64,
    /// Kernel evaluations of training, per pixel and iteration.
    evaluations: f64,
    /// Encoding time divided by the evaluations.
    nanoseconds: f64,
    encode: f64,
    encode_memory: f64,
    decode: [f64; 2],
    decode_memory: f64,
}

/// A quantity of [`Cost`] with its name.
type Quantity = (&'static str, fn(&Cost) -> f64);

const MEBIBYTE: f64 = (1 << 20) as f64;

/// Times in seconds, then memory in MiB.
const COSTS: [Quantity; 5] = [
    ("encoding time", |cost| cost.encode),
    ("decoding time, one thread", |cost| cost.decode[0]),
    ("decoding time, all threads", |cost| cost.decode[1]),
    ("encoder's memory", |cost| cost.encode_memory / MEBIBYTE),
    ("decoder's memory", |cost| cost.decode_memory / MEBIBYTE),
];

pub(super) fn measure(bench: &Bench) -> Result<String> {
    let megapixels: &[f64] = if bench.quick { &QUICK_MEGAPIXELS } else { &MEGAPIXELS };
    let gaussians: &[u32] = if bench.quick { &QUICK_GAUSSIANS } else { &GAUSSIANS };
    let mut store = bench.store(
        "growth.csv",
        ["image", "megapixels", "gaussians", "effort"],
        [
            "psnr",
            "iterations",
            "evaluations",
            "encode_seconds",
            "encode_peak_memory",
            "decode_seconds_one",
            "decode_seconds_all",
            "decode_peak_memory",
        ],
    )?;
    let picture = &bench.pictures[0];
    let mut cost = |megapixels: f64, gaussians: u32| -> Result<Cost> {
        let key = [megapixels.to_string(), gaussians.to_string(), GROWTH_EFFORT.to_string()];
        let key = [&picture.name, &key[0], &key[1], &key[2]];
        let values = store.get(&bench.product, key.map(String::as_str), || {
            let width = (1.5e6 * megapixels).sqrt().round();
            let height = (1e6 * megapixels / width).round();
            let large = picture.mirrored(width as u32, height as u32);
            let encoder =
                gip::psnr_encoder(GROWTH_EFFORT).with_target(Target::Gaussians(gaussians));
            let (encoded, memory) = memory::peak(|| gip::file(encoder, &large, Threads::Pool));
            let Encoded { bytes: file, report, .. } = &encoded?;
            Ok([
                report.psnr,
                report.iterations.into(),
                report.evaluations as f64,
                report.seconds,
                memory,
                gip::decode_seconds(file, Threads::One)?,
                gip::decode_seconds(file, Threads::Pool)?,
                gip::decode_memory(file)?,
            ])
        })?;
        let [psnr, iterations, evaluations, encode, encode_memory, one, all, decode_memory] =
            values;
        Ok(Cost {
            megapixels,
            gaussians: f64::from(gaussians),
            psnr,
            evaluations: evaluations / iterations / (1e6 * megapixels),
            nanoseconds: 1e9 * encode / evaluations,
            encode,
            encode_memory,
            decode: [one, all],
            decode_memory,
        })
    };
    let by_size = megapixels
        .iter()
        .map(|&size| cost(size, (DENSITY * size).round() as u32))
        .collect::<Result<Vec<_>>>()?;
    let by_count = gaussians.iter().map(|&count| cost(1.0, count)).collect::<Result<Vec<_>>>()?;

    let mut text = format!(
        "\n### Growth\n\nCompared with each other: our codec at effort {GROWTH_EFFORT}, tuned for PSNR, with \
         growing numbers of pixels and Gaussians, on {}, cropped or continued in mirror images. \
         The encoding time of other efforts grows with their iterations. Evaluations are kernel \
         evaluations in training, each with its gradient, per pixel and iteration; the time of \
         each is the whole encoding time divided by their number. Memory is peak memory: of the \
         encoder without the source, of the decoder (with all threads) without the file, its \
         samples included.\n",
        picture.name
    );
    for (name, title, costs, x) in [
        (
            "growth-pixels",
            format!("{DENSITY} Gaussians per megapixel"),
            by_size,
            ("megapixels", (|cost: &Cost| cost.megapixels) as fn(&Cost) -> f64),
        ),
        (
            "growth-gaussians",
            "One megapixel".into(),
            by_count,
            ("Gaussians", |cost: &Cost| cost.gaussians),
        ),
    ] {
        text.push_str(&format!("\n{title}:\n{}{}", growth_table(&costs), steeper(&costs, x)));
        for (suffix, unit, curves) in
            [("", "seconds", &COSTS[..3]), ("-memory", "MiB", &COSTS[3..])]
        {
            let name = format!("{name}{suffix}.svg");
            plot_growth(bench, &name, &title, &costs, x, unit, curves)?;
            text.push_str(&format!("\n![{title}, {unit}]({name})\n"));
        }
    }
    Ok(text)
}

fn growth_table(costs: &[Cost]) -> String {
    let mut table = Table::new(&[
        "megapixels",
        "Gaussians",
        "PSNR in dB",
        "evaluations",
        "ns each",
        "encode s",
        "ms per megapixel",
        "bytes per pixel",
        "decode ms, one thread",
        "all",
        "memory MiB",
    ]);
    for cost in costs {
        table.row(&[
            cost.megapixels.to_string(),
            cost.gaussians.to_string(),
            format!("{:.2}", cost.psnr),
            format!("{:.1}", cost.evaluations),
            format!("{:.2}", cost.nanoseconds),
            format!("{:.2}", cost.encode),
            format!("{:.0}", 1000.0 * cost.encode / cost.megapixels),
            format!("{:.1}", cost.encode_memory / cost.megapixels * 1e-6),
            format!("{:.1}", 1000.0 * cost.decode[0]),
            format!("{:.1}", 1000.0 * cost.decode[1]),
            format!("{:.1}", cost.decode_memory / MEBIBYTE),
        ]);
    }
    table.finish()
}

/// Says by which factors the costs grow from the first to the last, and which grow faster than `x`.
fn steeper(costs: &[Cost], (label, x): Quantity) -> String {
    let [first, .., last] = costs else { return String::new() };
    let grown = |of: fn(&Cost) -> f64| of(last) / of(first);
    let base = grown(x);
    let factors = COSTS.iter().map(|(name, of)| format!("{name} by {:.1}", grown(*of)));
    let steep = COSTS.iter().filter(|(_, of)| grown(*of) > base).map(|(name, _)| *name);
    format!(
        "\n{base:.1} times the {label} multiply: {}. More than in proportion: {}.\n",
        factors.collect::<Vec<_>>().join(", "),
        list_or_none(steep),
    )
}

fn plot_growth(
    bench: &Bench,
    name: &str,
    title: &str,
    costs: &[Cost],
    (label, x): Quantity,
    unit: &str,
    curves: &[Quantity],
) -> Result<()> {
    let series: Vec<Series> = curves
        .iter()
        .map(|(name, y)| Series {
            name: (*name).to_owned(),
            points: costs.iter().map(|cost| (x(cost), y(cost))).collect(),
        })
        .collect();
    let plot = Plot {
        title,
        x: (label, Scale::Logarithmic),
        y: (unit, Scale::Logarithmic),
        legend: Corner::UpperLeft,
    };
    plot.write(&bench.path(name), &series)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_grows_more_than_in_proportion_is_named() {
        let cost = |megapixels: f64, encode: f64| Cost {
            megapixels,
            gaussians: 1.0,
            psnr: 30.0,
            evaluations: 20.0,
            nanoseconds: 0.5,
            encode,
            encode_memory: megapixels * MEBIBYTE,
            decode: [megapixels, 0.5 * megapixels],
            decode_memory: 7.0,
        };
        let costs = [cost(0.5, 1.0), cost(1.0, 2.0), cost(2.0, 5.0)];
        let text = steeper(&costs, ("megapixels", |cost| cost.megapixels));
        assert_eq!(
            text,
            "\n4.0 times the megapixels multiply: encoding time by 5.0, decoding time, one thread \
             by 4.0, decoding time, all threads by 4.0, encoder's memory by 4.0, decoder's memory \
             by 1.0. More than in proportion: encoding time.\n"
        );
        assert_eq!(steeper(&costs[..1], ("megapixels", |cost| cost.megapixels)), "");
    }
}
