//! The report: one text, in which every section is as it was last measured.

use crate::sections::Section;

const TITLE: &str = "\
# image-gip, measured

Written by `evaluation/`, whose README has the command. The run leaves every single measurement as \
CSV beside this file. Sizes are those of whole files. PSNR is over all samples of the decoded 8-bit \
RGB picture, unless stated otherwise.
";

/// A report with a section as `text` has it, and all others as they were.
pub(crate) fn with(report: &str, section: Section, text: &str) -> String {
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
    use super::*;

    #[test]
    fn a_section_is_replaced_and_the_others_stay() {
        let report = with("", Section::Decode, "- Codec: a\n\n### Part\n\nfast\n");
        let report = with(&report, Section::Rate, "small\n\n");
        let report = with(&report, Section::Scene, "flat");
        let expected = |rate: &str| {
            format!(
                "{TITLE}\n## Rate and distortion\n\n{rate}\n\n## Decoding\n\n- Codec: a\n\n### Part\n\n\
                 fast\n\n## Only what a scene needs\n\nflat\n"
            )
        };
        assert_eq!(report, expected("small"));
        assert_eq!(with(&report, Section::Rate, "smaller"), expected("smaller"));
        assert_eq!(with(&report, Section::Scene, "flat"), report);
    }
}
