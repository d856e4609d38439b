//! Figures of the product's own tests, where these see more than its interface shows: gradients
//! against finite differences, and every SIMD level.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};

use crate::bench::Bench;
use crate::provenance::FOLDER;
use crate::table::Table;
use crate::verdict::list;

/// What the tests print before a figure.
const MARK: &str = "figure: ";
/// The tests, by the starts of their names.
const TESTS: [&str; 2] = ["every_gradient_", "every_simd_level_"];
/// Colour models, as columns.
const COLORS: [&str; 4] = ["Gray", "GrayAlpha", "Rgb", "Rgba"];

/// What the tests printed.
#[derive(Debug, Default, PartialEq)]
struct Figures {
    /// Largest relative errors, by chart, kernel, and colour model.
    gradients: BTreeMap<[String; 2], BTreeMap<String, f64>>,
    /// Differing values and all values, by level, and by what was computed.
    levels: BTreeMap<String, BTreeMap<String, [f64; 2]>>,
}

pub(super) fn measure(bench: &Bench) -> Result<String> {
    let figures = parse(&run()?)?;
    let mut store = bench.store(
        "stability-tests.csv",
        ["test", "of", "kernel", "colors"],
        ["largest_error_or_differing", "compared"],
    )?;
    // The tests have just run; what they say is kept for those who read the CSV.
    let mut keep = |key: [&str; 4], values| store.get(&bench.product, key, || Ok(values));

    let mut columns = vec!["parameterization", "kernel"];
    columns.extend(COLORS);
    let mut gradients = Table::new(&columns);
    let (mut worst, mut at) = (0.0, String::new());
    for ([chart, kernel], errors) in &figures.gradients {
        let mut cells = vec![chart.clone(), kernel.clone()];
        for color in COLORS {
            let error = *errors.get(color).with_context(|| format!("no figure for {color}"))?;
            keep(["gradient", chart, kernel, color], [error, f64::NAN])?;
            cells.push(format!("{error:.1e}"));
            if error > worst {
                (worst, at) = (error, format!("{chart}, {kernel}, {color}"));
            }
        }
        gradients.row(&cells);
    }
    let mut levels =
        Table::new(&["level", "differing samples", "compared", "differing gradients", "compared"]);
    let mut unequal = Vec::new();
    for (level, counts) in &figures.levels {
        let mut cells = vec![level.clone()];
        for of in ["rendering", "gradients"] {
            let [differing, all] =
                *counts.get(of).with_context(|| format!("no figure for {of} at {level}"))?;
            keep([of, level, "all", "all"], [differing, all])?;
            cells.extend([differing.to_string(), all.to_string()]);
            if differing > 0.0 {
                unequal.push(level.as_str());
            }
        }
        levels.row(&cells);
    }
    Ok(format!(
        "\n### Gradients\n\nCompared with: central differences of the loss in f64, straight from \
         the formulas, for every parameter of twelve Gaussians (round ones, slanted ones, needles) \
         per cell. The largest error in f32, relative to the gradient's magnitude plus 0.1, from \
         the product's own tests.\n{}\nWorst: {worst:.1e} ({at}).\n\n### SIMD levels\n\nCompared \
         with: scalar code for samples, the level that needs no asking of the processor for \
         gradients, at every level that this machine has; `best` is what the codec takes here, \
         `baseline` what it may take unasked. Samples are those of random Gaussians of every size, \
         gradients those of the encoder's pass. All counts of differing values must be zero, from \
         the product's own tests.\n{}\nLevels that differ: {}.\n",
        gradients.finish(),
        levels.finish(),
        list(unequal.into_iter()),
    ))
}

/// Runs the tests, which are built first if need be.
fn run() -> Result<String> {
    let manifest = Path::new(FOLDER).join("../Cargo.toml");
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    eprintln!("the product's own tests: {}", TESTS.join(" "));
    let output = Command::new(cargo)
        .args(["test", "--release", "--lib", "--manifest-path"])
        .arg(manifest)
        .args(["--", "--nocapture"])
        .args(TESTS)
        .output()
        .context("cannot run cargo, which the product's own tests need")?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    if !output.status.success() {
        let errors = String::from_utf8_lossy(&output.stderr);
        bail!("the product's own tests failed ({}):\n{text}{errors}", output.status);
    }
    Ok(text)
}

/// Takes the figures out of what the tests printed; there must be some of every kind.
fn parse(text: &str) -> Result<Figures> {
    let mut figures = Figures::default();
    // The test harness may have begun the line.
    for line in text.lines().filter_map(|line| Some(line.split_once(MARK)?.1)) {
        let unknown = || format!("the tests printed `{line}`");
        match line.split_whitespace().collect::<Vec<_>>()[..] {
            ["gradient", chart, kernel, color, error] => {
                let error = error.parse().with_context(unknown)?;
                let row = figures.gradients.entry([chart, kernel].map(str::to_owned)).or_default();
                row.insert(color.to_owned(), error);
            }
            ["simd", of, level, differing, all] => {
                let counts =
                    [differing.parse().with_context(unknown)?, all.parse().with_context(unknown)?];
                let row = figures.levels.entry(level.to_owned()).or_default();
                row.insert(of.to_owned(), counts);
            }
            _ => bail!(unknown()),
        }
    }
    ensure!(
        !figures.gradients.is_empty() && !figures.levels.is_empty(),
        "the product's own tests printed no figures:\n{text}"
    );
    Ok(figures)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_found_wherever_the_line_begins() {
        let text = "running 3 tests\n\
                    test a::every_gradient ... figure: gradient Cholesky quartic Rgb 1.5e-6\n\
                    figure: simd rendering AVX2 0 512000\n\
                    figure: simd gradients AVX2 2 109\nok\n";
        let figures = parse(text).expect("all is there");
        let row = &figures.gradients[&["Cholesky".to_owned(), "quartic".to_owned()]];
        assert_eq!(row["Rgb"], 1.5e-6);
        assert_eq!(figures.levels["AVX2"]["rendering"], [0.0, 512_000.0]);
        assert_eq!(figures.levels["AVX2"]["gradients"], [2.0, 109.0]);
    }

    #[test]
    fn tests_that_say_nothing_or_something_else_are_refused() {
        assert!(parse("test result: ok. 0 passed").is_err());
        assert!(parse("figure: simd rendering AVX2 0 512000").is_err());
        assert!(parse("figure: gradient Cholesky quartic Rgb much").is_err());
        assert!(parse("figure: weather fine").is_err());
    }
}
