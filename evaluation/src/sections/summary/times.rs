//! Times, as the section about speed has measured them.

use anyhow::Result;

use crate::baselines::BASELINES;
use crate::bench::{Bench, timing_version};
use crate::gip;
use crate::pictures::Distortion;
use crate::plot::{Corner, Plot, Scale, Series};
use crate::store::Store;
use crate::table::mean;

const PLOT: &str = "summary-times.svg";
/// As that section stores them.
const STORE: &str = "speed.csv";
const RATE: &str = "0.5 bpp";
const THREADS: &str = "one";

/// What the plot calls ours.
const EFFORTS: &str = "gip, by effort";

/// Mean seconds to encode and to decode with one thread.
type Times = [f64; 2];

/// Of one codec, ours at an effort.
struct Row {
    name: String,
    times: Times,
}

pub(super) fn claims(bench: &mut Bench) -> Result<String> {
    let rows = rows(bench)?;
    let ours = rows.iter().find(|row| row.name == of_effort(gip::EFFORT));
    let Some(ours) = ours else {
        return Ok(
            "\nTimes: the section about speed has not been measured with this version.\n".into()
        );
    };
    let (efforts, others): (Vec<&Row>, Vec<&Row>) =
        rows.iter().partition(|row| row.name.starts_with(gip::NAME));
    let point = |row: &&Row| (row.times[0], 1000.0 * row.times[1]);
    let mut series =
        vec![Series { name: EFFORTS.to_owned(), points: efforts.iter().map(point).collect() }];
    series.extend(
        others.iter().map(|row| Series { name: row.name.clone(), points: vec![point(row)] }),
    );
    let plot = Plot {
        title: &format!("Time for a picture of Kodak's at {RATE}, one thread"),
        x: ("seconds to encode", Scale::Logarithmic),
        y: ("milliseconds to decode", Scale::Logarithmic),
        legend: Corner::Beside,
    };
    plot.write(&bench.path(PLOT), &series)?;
    let encode = others
        .iter()
        .map(|row| format!("{} {}", row.name, two_digits(ours.times[0] / row.times[0])));
    let encode: Vec<String> = encode.collect();
    let figures = bench.written_figures()?;
    let decode = others.iter().filter_map(|row| {
        let figure = figures.get(&format!("decode/{}/{RATE}/ours to theirs", row.name))?;
        Some(format!("{} {}", row.name, two_digits(figure.value)))
    });
    let decode: Vec<String> = decode.collect();
    Ok(format!(
        "- **Time** at {RATE} with one thread, ours divided by the others', to encode at effort {} ({:.1} s for a picture \
         of Kodak's): {}; to decode (the section about decoding measures the codecs in turns): {}.\n\n\
         ![Encoding and decoding time]({PLOT})\n",
        gip::EFFORT,
        ours.times[0],
        encode.join(", "),
        decode.join(", "),
    ))
}

/// A ratio of times with the digits that mean something.
fn two_digits(ratio: f64) -> String {
    let place = ratio.log10().floor() as i32 - 1;
    let step = 10_f64.powi(place.max(0));
    let decimals = -place.min(0) as usize;
    format!("{:.decimals$}", if place > 0 { (ratio / step).round() * step } else { ratio })
}

fn of_effort(effort: u8) -> String {
    format!("{}, effort {effort}", gip::NAME)
}

/// What is known with this version: ours at some efforts, and then the others.
fn rows(bench: &mut Bench) -> Result<Vec<Row>> {
    let columns = Distortion::columns_of_file(&["encode_seconds", "decode_seconds"]);
    let keys = ["codec", "quality", "threads", "image"];
    let store: Store<4, 9> = bench.store(STORE, keys, columns)?;
    let product = bench.product.clone();
    let versions = bench.workers()?.1;
    let beside = timing_version(&product, &versions);
    let mean_of = |version: &str, codec: &str, settings: &[String]| {
        let known = bench.pictures.iter().filter_map(|picture| {
            settings
                .iter()
                .find_map(|setting| store.known(version, [codec, setting, THREADS, &picture.name]))
        });
        let known: Vec<[f64; 9]> = known.collect();
        let of = |index: usize| mean(known.iter().map(|values| values[index]));
        Some([of(7)?, of(8)?])
    };
    let ours = gip::EFFORTS.into_iter().filter_map(|effort| {
        let setting = format!("{RATE}, effort {effort}");
        let times = mean_of(&product, gip::NAME, &[setting])?;
        Some(Row { name: of_effort(effort), times })
    });
    let others = BASELINES.iter().filter_map(|baseline| {
        let settings: Vec<String> = baseline.settings.iter().map(|s| (*s).to_owned()).collect();
        Some(Row { name: baseline.name.into(), times: mean_of(&beside, baseline.id, &settings)? })
    });
    Ok(ours.chain(others).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_have_two_digits() {
        let shown = [347.26, 24.64, 5.95, 0.68, 0.0123].map(two_digits);
        assert_eq!(shown, ["350", "25", "6.0", "0.68", "0.012"]);
    }
}
