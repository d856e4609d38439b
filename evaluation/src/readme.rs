//! Figures of the report in the README and in `docs/`: comments name them, and they are compared with
//! `figures.csv`.
//!
//! `<!-- report: decode/0.5/WebP -->0.7<!-- /report -->` marks a number; several names, with semicolons
//! between them or alternatives in braces, are those of as many numbers. `<!-- report table: rate/kodak/{row}/{column} -->` before a
//! table marks all of its cells, by their row's first cell and the head of their column, up to a comma and with
//! slashes for colons.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

use crate::figures::{Figure, Figures};
use crate::files;
use crate::provenance::FOLDER;

const MARK: &str = "<!-- report: ";
const TABLE: &str = "<!-- report table: ";
const END: &str = " -->";
const CLOSE: &str = "<!-- /report -->";

/// Checks that the figures that the README and docs/ mark are those of the report.
#[derive(Debug, Default, clap::Args)]
pub(crate) struct Args {
    /// Writes the report's figures in place of those that differ, with as many decimals.
    #[arg(long)]
    write: bool,
}

/// Checks the marked figures, or writes them.
///
/// # Errors
/// When a figure differs, or a mark is none.
pub(crate) fn check(args: &Args) -> Result<()> {
    let root = Path::new(FOLDER).join("..");
    let figures = Figures::load(&Path::new(FOLDER).join("report"))?;
    let mut faults = Vec::new();
    for path in texts(&root)? {
        let text = files::read(&path)?;
        let found = compare(&text, &figures);
        let name = path.strip_prefix(&root)?.display();
        let of_text = |fault: &String| format!("{name}: {fault}");
        faults.extend(found.faults.iter().map(of_text));
        if !args.write {
            faults.extend(found.other.iter().map(of_text));
        } else if !found.other.is_empty() {
            files::replace(&path, found.text.as_bytes())?;
            println!("{name}: {} figures written", found.other.len());
        }
    }
    ensure!(faults.is_empty(), "{}", faults.join("\n"));
    Ok(())
}

/// The texts that may have figures of the report.
fn texts(root: &Path) -> Result<Vec<PathBuf>> {
    let mut texts = vec![root.join("README.md")];
    for entry in fs::read_dir(root.join("docs")).context("there is no docs/")? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "md") {
            texts.push(path);
        }
    }
    texts.sort();
    Ok(texts)
}

/// What the marks of a text say.
#[derive(Debug, Default)]
struct Compared {
    /// The text with the figures of the report.
    text: String,
    /// Figures that are others in the report.
    other: Vec<String>,
    /// Marks that are none, and figures that the report does not have.
    faults: Vec<String>,
}

fn compare(text: &str, figures: &Figures) -> Compared {
    let mut marks = Marks { text, figures, edits: Vec::new(), found: Compared::default() };
    marks.inline();
    marks.tables();
    let Marks { mut edits, mut found, .. } = marks;
    edits.sort_by_key(|(range, _)| range.start);
    text.clone_into(&mut found.text);
    for (range, new) in edits.into_iter().rev() {
        found.text.replace_range(range, &new);
    }
    found
}

struct Marks<'a> {
    text: &'a str,
    figures: &'a Figures,
    edits: Vec<(Range<usize>, String)>,
    found: Compared,
}

impl Marks<'_> {
    fn inline(&mut self) {
        let mut at = 0;
        while let Some(start) = self.text[at..].find(MARK).map(|start| at + start) {
            at = start + MARK.len();
            let names = self.text[at..].find(END).map(|end| at..at + end);
            let marked = names.clone().and_then(|names| {
                let start = names.end + END.len();
                Some(start..start + self.text[start..].find(CLOSE)?)
            });
            let (Some(names), Some(marked)) = (names, marked) else {
                self.found.faults.push(format!("`{}` has no end", line(self.text, start)));
                return;
            };
            // There it begins a block of HTML, and ends the paragraph.
            for place in [start, marked.end] {
                if self.text[..place].rsplit('\n').next().is_some_and(|line| line.trim().is_empty())
                {
                    let line = line(self.text, place);
                    self.found.faults.push(format!("a mark begins the line `{line}`"));
                }
            }
            at = marked.end + CLOSE.len();
            self.numbers(&marked, &expanded(&self.text[names]));
        }
    }

    fn tables(&mut self) {
        let text = self.text;
        for (start, _) in text.match_indices(TABLE) {
            let mark = line(text, start);
            let patterns = mark.strip_prefix(TABLE).and_then(|mark| mark.strip_suffix(END));
            let mut rows = lines(text, start + mark.len())
                .skip_while(|row| text[row.clone()].trim().is_empty());
            let head = rows.next().map(|row| cells(text, &row)).unwrap_or_default();
            let (Some(patterns), 2..) = (patterns, head.len()) else {
                self.found.faults.push(format!("`{mark}` is before no table"));
                continue;
            };
            let body = rows.skip(1).take_while(|row| text[row.clone()].starts_with('|'));
            for row in body {
                let cells = cells(text, &row);
                let Some((first, cells)) = cells.split_first() else { continue };
                for (cell, head) in cells.iter().zip(&head[1..]) {
                    let names = patterns.replace("{row}", &label(&text[first.clone()]));
                    let names = names.replace("{column}", &label(&text[head.clone()]));
                    self.cell(cell, &expanded(&names));
                }
            }
        }
    }

    /// A cell of a table, which has no number where the report has none.
    fn cell(&mut self, cell: &Range<usize>, names: &[String]) {
        let known = names.iter().filter(|name| self.figures.get(name).is_some()).count();
        if known > 0 || !numbers(&self.text[cell.clone()]).is_empty() {
            self.numbers(cell, names);
        }
    }

    /// The numbers of a part of the text, and the names of as many figures.
    fn numbers(&mut self, part: &Range<usize>, names: &[String]) {
        let text = &self.text[part.clone()];
        let numbers = numbers(text);
        if numbers.len() != names.len() {
            let fault =
                format!("`{text}` has not as many numbers as are named: {}", names.join("; "));
            self.found.faults.push(fault);
            return;
        }
        for (number, name) in numbers.into_iter().zip(names) {
            let old = &text[number.clone()];
            let Some(figure) = self.figures.get(name) else {
                self.found.faults.push(format!("the report has no figure {name} (here: {old})"));
                continue;
            };
            let new = written(figure, old);
            if new.parse::<f64>() != old.parse::<f64>() {
                self.found.other.push(format!("{name} is {new}, not {old}"));
                self.edits.push((part.start + number.start..part.start + number.end, new));
            }
        }
    }
}

/// The names that a mark has: with semicolons between them, and one for each of the alternatives in braces.
fn expanded(names: &str) -> Vec<String> {
    let all = names.split("; ").flat_map(|name| {
        let parts =
            name.split_once('{').and_then(|(before, rest)| Some((before, rest.split_once('}')?)));
        let Some((before, (alternatives, after))) = parts else { return vec![name.to_owned()] };
        let each = alternatives.split(',');
        each.map(|alternative| format!("{before}{alternative}{after}")).collect()
    });
    all.collect()
}

/// A figure with as many decimals as a number has, and a sign where that has one.
fn written(figure: &Figure, like: &str) -> String {
    let decimals = like.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    let new = format!("{:.decimals$}", figure.value);
    let is_zero = new.trim_start_matches('-').bytes().all(|byte| matches!(byte, b'0' | b'.'));
    let new = if is_zero { new.trim_start_matches('-').to_owned() } else { new };
    // A share that was less may be more, and then says so.
    let signed = like.starts_with('+') || (like.starts_with('-') && figure.unit == "%");
    if signed && !is_zero && !new.starts_with('-') { format!("+{new}") } else { new }
}

/// Where the numbers of a text are. A sign belongs to them where no range is meant.
fn numbers(text: &str) -> Vec<Range<usize>> {
    let bytes = text.as_bytes();
    let is_word = |index: Option<usize>| {
        index.is_some_and(|index| bytes[index].is_ascii_alphanumeric() || bytes[index] == b'.')
    };
    let mut numbers = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let digits =
            |from: usize| bytes[from..].iter().take_while(|byte| byte.is_ascii_digit()).count();
        let count = digits(at);
        if count == 0 || is_word(at.checked_sub(1)) {
            at += count.max(1);
            continue;
        }
        let sign = at
            .checked_sub(1)
            .filter(|&sign| matches!(bytes[sign], b'+' | b'-') && !is_word(sign.checked_sub(1)));
        let mut end = at + count;
        if bytes.get(end) == Some(&b'.') && digits(end + 1) > 0 {
            end += 1 + digits(end + 1);
        }
        numbers.push(sign.unwrap_or(at)..end);
        at = end;
    }
    numbers
}

/// The name that a cell gives its row or column.
fn label(cell: &str) -> String {
    let name = cell.split(',').next().unwrap_or_default().replace(": ", "/");
    let is_markup = |letter: char| letter.is_whitespace() || matches!(letter, '*' | '`');
    name.trim_matches(is_markup).to_owned()
}

/// Where the cells of a table's row are; none of another line.
fn cells(text: &str, row: &Range<usize>) -> Vec<Range<usize>> {
    let bars: Vec<usize> =
        text[row.clone()].match_indices('|').map(|(at, _)| row.start + at).collect();
    bars.windows(2).map(|bars| bars[0] + 1..bars[1]).collect()
}

/// The lines after the one of a place.
fn lines(text: &str, place: usize) -> impl Iterator<Item = Range<usize>> {
    let breaks = text[place..].match_indices('\n').map(move |(at, _)| place + at);
    let ends = breaks.clone().skip(1).chain([text.len()]);
    breaks.zip(ends).map(|(start, end)| start + 1..end)
}

/// The rest of the line of a place.
fn line(text: &str, place: usize) -> &str {
    text[place..].lines().next().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figures() -> Figures {
        let mut figures = Figures::default();
        let rows = [("speed", 0.712, ""), ("a/0.5 bpp", -9.6, "%"), ("b/0.5 bpp", 4.4, "%")];
        for (name, value, unit) in rows {
            figures.add(name.into(), value, unit);
        }
        figures.add("a/1 bpp".into(), -0.04, "%");
        figures
    }

    #[test]
    fn marked_numbers_are_those_of_the_report() {
        let good = "In <!-- report: speed -->0.7<!-- /report --> s, and by <!-- report: a/0.5 bpp; b/0.5 bpp \
                    -->-10 to +4.4 %<!-- /report -->.\n\n<!-- report table: a/{column}; b/{column} -->\n\n\
                    | at | 0.5 bpp, as is | 1 bpp |\n| --- | --- | --- |\n| **x** | **-9.6; 4** | ";
        let found = compare(&format!("{good}-0.0; |\n"), &figures());
        assert_eq!(
            found.faults.len(),
            1,
            "of two figures of the last cell one is there: {found:?}"
        );
        let good = good.replace("1 bpp |\n", "2 bpp |\n");
        let found = compare(&format!("{good} - |\n\n7 of 8\n"), &figures());
        assert_eq!((found.faults.len(), found.other.len()), (0, 0), "{found:?}");
    }

    #[test]
    fn others_are_named_and_can_be_written() {
        let text = "By <!-- report: b/0.5 bpp -->-3.1<!-- /report --> %.\n\n\
                    <!-- report table: {row}/{column} -->\n| of | 0.5 bpp | 1 bpp |\n| --- | --- | --- |\n\
                    | a | -9 | -1.0 |\n| `b`, all | +4 | - |\n";
        let found = compare(text, &figures());
        assert!(found.faults.is_empty(), "{found:?}");
        assert_eq!(
            found.other,
            ["b/0.5 bpp is +4.4, not -3.1", "a/0.5 bpp is -10, not -9", "a/1 bpp is 0.0, not -1.0"]
        );
        let expected = text.replace("-3.1", "+4.4").replace("-9 |", "-10 |").replace("-1.0", "0.0");
        assert_eq!(found.text, expected);
        assert!(compare(&expected, &figures()).other.is_empty());
    }

    #[test]
    fn marks_that_are_none_are_faults() {
        for text in [
            "a <!-- report: speed -->0.7",
            "a <!-- report: speed -->fast<!-- /report -->",
            "a <!-- report: speeds -->0.7<!-- /report -->",
            "a\n<!-- report: speed -->0.7<!-- /report -->",
            "a <!-- report: speed -->0.7\n<!-- /report -->",
            "<!-- report table: {row}/{column} -->\n\nNo table.\n",
            "<!-- report table: {row}/{column} -->\n| a | 0.5 bpp |\n| --- | --- |\n| a | - |\n",
        ] {
            let found = compare(text, &figures());
            assert_eq!((found.faults.len(), found.other.len()), (1, 0), "{text}: {found:?}");
        }
    }

    #[test]
    fn alternatives_are_names_of_their_own() {
        assert_eq!(expanded("a/{1,0.5} bpp; b"), ["a/1 bpp", "a/0.5 bpp", "b"]);
        let text = "of <!-- report: {a,b}/0.5 bpp -->-9.6 and 4<!-- /report --> %";
        let found = compare(text, &figures());
        assert!(found.faults.is_empty() && found.other.is_empty(), "{found:?}");
    }

    #[test]
    fn numbers_have_signs_but_ranges_have_none() {
        let found = |text: &'static str| -> Vec<&str> {
            numbers(text).into_iter().map(|range| &text[range]).collect()
        };
        assert_eq!(
            found("**-9.6**; +4 % of 0.15-1.5 in 2.5."),
            ["-9.6", "+4", "0.15", "1.5", "2.5"]
        );
        assert_eq!(found("kodim05, v2, -"), [""; 0]);
    }

    #[test]
    fn the_readme_and_docs_have_the_figures_of_the_report() {
        check(&Args::default()).expect("`evaluation readme --write` writes what the report has");
    }
}
