//! Measures image-gip against the world and writes a report: see `README.md`.

mod baselines;
mod bench;
mod blind;
mod canvas;
mod check;
mod code;
mod comparison;
mod contents;
mod curve;
mod fetch;
mod figures;
mod files;
mod gip;
mod kernel_benchmark;
mod local_statistics;
mod manifest;
mod memory;
mod metric;
mod number;
mod origins;
mod parallel;
mod pictures;
mod plot;
mod provenance;
mod prune;
mod python;
mod readme;
mod report;
mod sections;
mod store;
mod table;
mod versions;
mod visual;

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Result, ensure};
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
/// Nothing is measured twice on the same machine with the same code of the codec: an interrupted
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

/// What there is to do besides measuring: the blind choice, and what belongs to the report.
#[derive(Debug, Subcommand)]
enum Command {
    Fetch(fetch::Args),
    Check(check::Args),
    Readme(readme::Args),
    Prune(prune::Args),
    Triplets(triplets::Args),
    Choices(choices::Args),
}

/// What to measure, beside the pictures.
#[derive(Debug, clap::Args)]
struct Args {
    /// Folder for the report; it is made if it is missing.
    #[arg(long, value_name = "REPORT_DIR")]
    out: PathBuf,
    /// Two pictures of each set and fewer settings: ten minutes on two cores.
    #[arg(long)]
    quick: bool,
    /// Only these sections [default: all].
    #[arg(long, value_enum, value_name = "SECTION", value_delimiter = ',')]
    only: Vec<Section>,
    /// In `representation`, the published methods with all of the paper's iterations, too, on four pictures: hours.
    #[arg(long, conflicts_with = "quick")]
    long: bool,
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
        Some(Command::Fetch(args)) => fetch::fetch(&args),
        Some(Command::Check(args)) => check::check(&args),
        Some(Command::Readme(args)) => readme::check(&args),
        Some(Command::Prune(args)) => prune::prune(&args),
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
    files::make_folder(&args.out)?;
    let _lock = files::lock(&args.out)?;
    store::tidy(&args.out)?;
    let sections = sections(&args)?;
    let mut bench = Bench::new(folders, args.out, args.quick, args.long, args.reference)?;
    bench.readme_picture = args.readme_picture;
    let mut failed = Vec::new();
    for section in sections {
        eprintln!("== {section} (after {:.0} s)", start.elapsed().as_secs_f64());
        if let Err(error) = write_section(section, &mut bench) {
            // The others may have nothing to do with it.
            eprintln!("{section} failed: {error:#}");
            bench.stop_baselines();
            failed.push(section);
        }
    }
    let path = bench.path(report::NAME);
    eprintln!("{} (after {:.0} s)", path.display(), start.elapsed().as_secs_f64());
    let report = files::read_if_any(&path)?.unwrap_or_default();
    let stale = report::of_other_versions(&report, &bench.product);
    if !stale.is_empty() {
        eprintln!("not of this version, or missing: {}", report::names(&stale));
    }
    ensure!(failed.is_empty(), "these sections failed, as said above: {}", report::names(&failed));
    Ok(())
}

/// The sections that are asked for, each of them once.
///
/// # Errors
/// When a quick run would take the place of full ones.
fn sections(args: &Args) -> Result<Vec<Section>> {
    let is_wanted = |section: &Section| args.only.is_empty() || args.only.contains(section);
    let mut sections: Vec<Section> = Section::ALL.into_iter().filter(is_wanted).collect();
    // The first page tells what the others have measured.
    sections.sort_by_key(|section| *section == Section::Summary);
    if args.quick {
        let report = files::read_if_any(&args.out.join(report::NAME))?.unwrap_or_default();
        let mut full = report::of_full_runs(&report);
        full.retain(|section| sections.contains(section));
        ensure!(
            full.is_empty(),
            "{} has sections of a full run, which --quick would replace: {}; choose another folder",
            args.out.display(),
            report::names(&full)
        );
    }
    if let Some(path) = &args.readme_picture {
        ensure!(sections.contains(&Section::Sheet), "--readme-picture needs the section sheet");
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        ensure!(folder.is_none_or(Path::is_dir), "there is no folder for {}", path.display());
    }
    if let Some(path) = &args.reference {
        ensure!(sections.contains(&Section::Rate), "--reference needs the section rate");
        ensure!(path.is_file(), "there is no {}", path.display());
    }
    Ok(sections)
}

/// Measures what a section lacks, and writes it.
fn write_section(section: Section, bench: &mut Bench) -> Result<()> {
    bench.begin();
    let text = measure(section, bench)?;
    let provenance = bench.provenance()?;
    report::update(&bench.path(report::NAME), section, &format!("{provenance}\n{text}"))?;
    bench.write_figures(&section.to_string())?;
    // All its stores are closed.
    store::tidy(&bench.path(""))
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
    use std::fs;

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
        let cli = Cli::try_parse_from(["evaluation", "readme", "--write"]);
        assert!(matches!(cli.expect("as the README has it").command, Some(Command::Readme(_))));
        let cli = Cli::try_parse_from(["evaluation", "choices", "a"]);
        assert!(matches!(cli.expect("as the README has it").command, Some(Command::Choices(_))));
    }

    #[test]
    fn a_second_run_measures_nothing_and_writes_the_same_bytes() {
        let (pictures, out) = (tempfile::tempdir(), tempfile::tempdir());
        let (pictures, out) = (pictures.expect("a folder"), out.expect("a folder"));
        let pixel = |x: u32, y: u32| image::Rgb([(x * 15) as u8, (y * 13) as u8, 90]);
        let picture = image::RgbImage::from_fn(16, 16, pixel);
        picture.save(pictures.path().join("a.png")).expect("it is written");
        let run = || {
            let folders = ["--kodak", pictures.path().to_str().expect("it is text")];
            let report = ["--out", out.path().to_str().expect("it is text"), "--quick"];
            let args = [&["evaluation"], &folders[..], &report, &["--only", "monotony"]].concat();
            let cli = Cli::try_parse_from(args).expect("it is as the README has it");
            write_report(&cli.folders.expect("given"), cli.report.expect("given"))
                .expect("it is measured");
            let names = ["report.md", "monotony.csv", "origins.csv", "figures.csv", "images.csv"];
            names.map(|name| fs::read_to_string(out.path().join(name)).expect(name))
        };
        let files = run();
        let [report, monotony, origins, figures, _] = &files;
        assert!(report.contains("\n## More bits, more effort\n"), "{report}");
        assert!(monotony.lines().is_sorted_by(|a, b| a.starts_with("origin,") || a < b));
        assert_eq!(origins.lines().count(), 3, "of the codec, and of pictures");
        assert!(figures.contains("\nmonotony/pictures,1.0,pictures\n"), "{figures}");
        assert_eq!(run(), files);
    }
}
