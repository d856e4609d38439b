//! The report: its sections, and one text that has each of them as it was last measured.

use std::fmt;
use std::path::Path;

use anyhow::Result;
use clap::ValueEnum;

use crate::files;

/// The name of the report in its folder.
pub(crate) const NAME: &str = "report.md";

const TITLE: &str = "\
# image-gip, measured

Written by `evaluation/`, whose README has the command. Every single measurement is in the CSV files of \
this folder, and the pictures are those of [`pictures.csv`](../pictures.csv). Sizes are those of whole files. PSNR is over all samples \
of the decoded 8-bit RGB picture, unless stated otherwise.
";

/// A line in the head of sections of a quick run.
pub(crate) const QUICK: &str = "- A quick run: few pictures and settings\n";

/// What can be measured on its own; the comments are the help of `--only`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Section {
    /// One page of claims with their numbers, from what other sections have measured
    Summary,
    /// The fit itself, without quantization: against GaussianImage and GaussianImage++
    Representation,
    /// What each part of the method contributes
    Ablation,
    /// Rate and distortion, against every baseline
    Rate,
    /// Pictures and kinds of content where our files are larger, and why
    Losses,
    /// Small pictures enlarged, and thumbnails
    Sizes,
    /// Figures that see texture, and the blind choice
    Texture,
    /// Our curve on Kodak beside curves and codecs that papers print
    Printed,
    /// Whether the same quality looks the same on every picture
    Quality,
    /// What one sees at equal size: contact sheets of crops
    Sheet,
    /// Files of 100 to 800 bytes against ThumbHash, BlurHash and the smallest files of others
    Placeholders,
    /// Time against quality, and how time and memory grow
    Speed,
    /// Decoding time against other decoders; threads and partial decoding
    Decode,
    /// Extreme Gaussians, and pictures that are hard to fit
    Stability,
    /// Gaussians and bytes for simple and for difficult pictures
    Content,
    /// Whether more bits and more effort give no worse picture
    Monotony,
    /// Random crops for training against other formats, and what a network learns from them
    Training,
}

impl Section {
    /// In the order of the report.
    pub(crate) const ALL: [Self; 17] = [
        Self::Summary,
        Self::Representation,
        Self::Ablation,
        Self::Rate,
        Self::Losses,
        Self::Sizes,
        Self::Texture,
        Self::Printed,
        Self::Quality,
        Self::Sheet,
        Self::Placeholders,
        Self::Speed,
        Self::Decode,
        Self::Stability,
        Self::Content,
        Self::Monotony,
        Self::Training,
    ];

    fn title(self) -> &'static str {
        match self {
            Self::Summary => "Summary",
            Self::Representation => "Representation",
            Self::Ablation => "Ablation",
            Self::Rate => "Rate and distortion",
            Self::Losses => "Where we lose",
            Self::Sizes => "At other sizes",
            Self::Texture => "Texture",
            Self::Printed => "Beside printed figures",
            Self::Quality => "Quality as asked for",
            Self::Sheet => "Contact sheets",
            Self::Placeholders => "Placeholders",
            Self::Speed => "Speed against error",
            Self::Decode => "Decoding",
            Self::Stability => "Numerical stability",
            Self::Content => "Only what a scene needs",
            Self::Monotony => "More bits, more effort",
            Self::Training => "For training",
        }
    }
}

impl fmt::Display for Section {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = self.to_possible_value().expect("no section is skipped");
        f.write_str(value.get_name())
    }
}

/// Replaces one section of the report in a file, which is made if it is missing.
pub(crate) fn update(path: &Path, section: Section, text: &str) -> Result<()> {
    let before = files::read_if_any(path)?.unwrap_or_default();
    files::replace(path, with(&before, section, text).as_bytes())
}

/// The sections of a report that are missing or of another version of our codec than this one.
pub(crate) fn of_other_versions(report: &str, product: &str) -> Vec<Section> {
    let is_of_it = |section| text_of(report, section).is_some_and(|text| text.contains(product));
    Section::ALL.into_iter().filter(|&section| !is_of_it(section)).collect()
}

/// The sections of a report that a full run has measured.
pub(crate) fn of_full_runs(report: &str) -> Vec<Section> {
    let is_full = |section| text_of(report, section).is_some_and(|text| !text.contains(QUICK));
    Section::ALL.into_iter().filter(|&section| is_full(section)).collect()
}

/// The files beside a report that it links.
pub(crate) fn links(report: &str) -> Vec<&str> {
    let targets = report.split("](").skip(1).filter_map(|rest| Some(rest.split_once(')')?.0));
    let mut links: Vec<&str> = targets.filter(|target| !target.contains(':')).collect();
    links.sort_unstable();
    links.dedup();
    links
}

/// The names of sections in a sentence.
pub(crate) fn names(sections: &[Section]) -> String {
    sections.iter().map(Section::to_string).collect::<Vec<_>>().join(", ")
}

/// A report with a section as `text` has it, and all others as they were.
fn with(report: &str, section: Section, text: &str) -> String {
    let mut all = TITLE.to_owned();
    for each in Section::ALL {
        let text = if each == section { Some(text) } else { text_of(report, each) };
        if let Some(text) = text {
            all.push_str(&format!("{}{}\n", heading(each), text.trim_end()));
        }
    }
    all
}

/// What a report has under a section's heading, up to the next of its kind.
fn text_of(report: &str, section: Section) -> Option<&str> {
    let (_, rest) = report.split_once(&heading(section))?;
    Some(rest.split_once("\n## ").map_or(rest, |(text, _)| text))
}

/// A line, and the empty ones before and after it.
fn heading(section: Section) -> String {
    format!("\n## {}\n\n", section.title())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_section_is_replaced_and_the_others_stay() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("report.md");
        let report = |section: Section, text: &str| {
            update(&path, section, text).expect("it is written");
            fs::read_to_string(&path).expect("it was just written")
        };
        let expected = |rate: &str| {
            format!(
                "{TITLE}\n## Rate and distortion\n\n{rate}\n\n## Decoding\n\n- Codec: a\n\n### Part\
                 \n\nfast\n\n## Only what a scene needs\n\nflat\n"
            )
        };
        report(Section::Decode, "- Codec: a\n\n### Part\n\nfast\n");
        report(Section::Rate, "small\n\n");
        assert_eq!(report(Section::Content, "flat"), expected("small"));
        assert_eq!(report(Section::Rate, "smaller"), expected("smaller"));
        assert_eq!(report(Section::Content, "flat"), expected("smaller"));
        let files = fs::read_dir(folder.path()).expect("a folder").count();
        assert_eq!(files, 1, "nothing is left beside the report");
    }

    #[test]
    fn sections_of_other_versions_are_named() {
        let report = with("", Section::Decode, "- Codec: commit a, gip-1\n");
        let report = with(&report, Section::Rate, "- Codec: commit a, gip-2\n");
        let stale = of_other_versions(&report, "gip-1");
        assert_eq!(stale.len(), Section::ALL.len() - 1);
        assert!(!stale.contains(&Section::Decode) && stale.contains(&Section::Rate));
        assert_eq!(names(&[Section::Rate, Section::Decode]), "rate, decode");
    }

    #[test]
    fn sections_of_full_runs_and_links_are_found() {
        let report = with("", Section::Decode, &format!("- Seed: 1\n{QUICK}\n![a](a.svg)"));
        let report = with(&report, Section::Rate, "[b](b.csv), [c](https://c), [b](b.csv)");
        assert_eq!(of_full_runs(&report), [Section::Rate]);
        assert_eq!(links(&report), ["../pictures.csv", "a.svg", "b.csv"]);
    }

    #[test]
    fn the_committed_report_is_small() {
        let folder = Path::new(crate::provenance::FOLDER).join("report");
        let bytes = |end: &str| -> u64 {
            let files = fs::read_dir(&folder).expect("a folder").flatten();
            let files = files.filter(|file| file.file_name().to_string_lossy().ends_with(end));
            files.map(|file| file.metadata().expect("it is there").len()).sum()
        };
        assert!((1..=1_500_000).contains(&bytes(".jpg")), "sheets: {}", bytes(".jpg"));
        assert!(bytes(".csv") <= 2_000_000, "measurements: {}", bytes(".csv"));
    }

    #[test]
    fn titles_differ() {
        // A section is found by its title.
        for (index, section) in Section::ALL.iter().enumerate() {
            assert!(Section::ALL[..index].iter().all(|other| other.title() != section.title()));
        }
        assert_eq!(Section::ALL, Section::value_variants());
    }
}
