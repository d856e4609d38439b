//! Measures image-gip against the world and writes a report: see `README.md`.

mod baselines;
mod bench;
mod blind;
mod canvas;
mod comparison;
mod contents;
mod curve;
mod gip;
mod kernel_benchmark;
mod local_statistics;
mod memory;
mod metric;
mod parallel;
mod pictures;
mod plot;
mod provenance;
mod python;
mod report;
mod sections;
mod store;
mod table;
mod versions;
mod visual;

use std::fs;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::{Parser, Subcommand};

use bench::{Bench, Folders};
use blind::{choices, triplets};
use report::Section;
use sections::{
    ablation, content, decode, losses, monotony, placeholders, printed, quality, rate,
    representation, sheet, sizes, speed, stability, summary, texture, training,
};

/// Measures image-gip against other codecs and writes `report.md`, SVG plots, and CSV with every
/// single measurement.
///
/// Nothing is measured twice on the same machine with the same version of the codec: an interrupted
/// run continues, and a finished one only writes the report again.
#[derive(Debug, Parser)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
struct Cli {
    #[command(flatten)]
    folders: Option<Folders>,
    #[command(flatten)]
    report: Option<Args>,
    #[command(subcommand)]
    command: Option<Command>,
}

/// What there is to do besides the report: the blind choice.
#[derive(Debug, Subcommand)]
enum Command {
    Triplets(triplets::Args),
    Choices(choices::Args),
}

/// What to measure, beside the pictures.
#[derive(Debug, clap::Args)]
struct Args {
    /// Folder for the report; it is made if it is missing.
    #[arg(long, value_name = "REPORT_DIR")]
    out: PathBuf,
    /// Four pictures of each set and fewer settings: twenty minutes on two cores.
    #[arg(long)]
    quick: bool,
    /// Only these sections [default: all].
    #[arg(long, value_enum, value_name = "SECTION")]
    only: Vec<Section>,
    /// Iterations of the published methods [default: 3000, quick: 2000; the paper: 50000].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    iterations: Option<u32>,
    /// CSV with measurements of the same baselines by other programs, to compare ours with; it
    /// needs the columns codec, quality, image, bytes, psnr and msssim of `rate.csv`.
    #[arg(long, value_name = "CSV")]
    reference: Option<PathBuf>,
    /// JPEG for the README: the crops of all pictures in which we compare best and worst. The
    /// section `sheet` writes it.
    #[arg(long, value_name = "JPEG")]
    readme_picture: Option<PathBuf>,
}

fn main() -> Result<()> {
    let Cli { folders, report, command } = Cli::parse();
    match command {
        Some(Command::Triplets(args)) => triplets::make(&args),
        Some(Command::Choices(args)) => choices::print(&args),
        None => {
            let (folders, args) = folders.zip(report).expect("both have arguments that it needs");
            write_report(&folders, args)
        }
    }
}

fn write_report(folders: &Folders, args: Args) -> Result<()> {
    let start = Instant::now();
    fs::create_dir_all(&args.out)
        .with_context(|| format!("cannot make the folder {}", args.out.display()))?;
    let mut bench = Bench::new(folders, args.out, args.quick, args.iterations, args.reference)?;
    bench.readme_picture = args.readme_picture;
    let mut sections = if args.only.is_empty() { Section::ALL.to_vec() } else { args.only };
    // The first page tells what the others have measured.
    sections.sort_by_key(|section| *section == Section::Summary);
    for section in sections {
        eprintln!("== {section} (after {:.0} s)", start.elapsed().as_secs_f64());
        let text = measure(section, &mut bench)?;
        let path = bench.path("report.md");
        report::update(&path, section, &format!("{}\n{text}", bench.provenance()))?;
        eprintln!("{} (after {:.0} s)", path.display(), start.elapsed().as_secs_f64());
    }
    Ok(())
}

/// Measures what a section lacks and returns its text.
fn measure(section: Section, bench: &mut Bench) -> Result<String> {
    match section {
        Section::Summary => summary::measure(bench),
        Section::Representation => representation::measure(bench),
        Section::Ablation => ablation::measure(bench),
        Section::Rate => rate::measure(bench),
        Section::Losses => losses::measure(bench),
        Section::Sizes => sizes::measure(bench),
        Section::Texture => texture::measure(bench),
        Section::Printed => printed::measure(bench),
        Section::Quality => quality::measure(bench),
        Section::Sheet => sheet::measure(bench),
        Section::Placeholders => placeholders::measure(bench),
        Section::Speed => speed::measure(bench),
        Section::Decode => decode::measure(bench),
        Section::Stability => stability::measure(bench),
        Section::Content => content::measure(bench),
        Section::Monotony => monotony::measure(bench),
        Section::Training => training::measure(bench),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
        let args = ["evaluation", "--kodak", "a", "--out", "b", "--only", "rate"];
        let cli = Cli::try_parse_from(args).expect("it is as the README has it");
        assert_eq!(cli.report.expect("a report is asked for").only, [Section::Rate]);
        assert!(Cli::try_parse_from(["evaluation", "--kodak", "a"]).is_err());
        let args = ["evaluation", "triplets", "--pictures", "a", "--pictures", "b", "--out", "c"];
        let cli = Cli::try_parse_from(args).expect("it is as the README has it");
        assert!(matches!(cli.command, Some(Command::Triplets(_))));
        let cli = Cli::try_parse_from(["evaluation", "choices", "a"]);
        assert!(matches!(cli.expect("as the README has it").command, Some(Command::Choices(_))));
    }
}
