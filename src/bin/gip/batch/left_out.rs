//! What is found in folders and left out, and how that is told.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// How many pictures, and kinds of files, are named.
const NAMED: usize = 5;

/// Files of folders that are not worked on.
#[derive(Debug, Default)]
pub(crate) struct LeftOut {
    /// Pictures of formats that are not read.
    pub(crate) pictures: BTreeSet<PathBuf>,
    /// The kinds of all else.
    others: BTreeMap<PathBuf, String>,
}

impl LeftOut {
    /// Adds a file that is no picture.
    pub(crate) fn add_file(&mut self, path: &Path) {
        self.add(path, kind(path));
    }

    /// Adds something of a kind.
    pub(crate) fn add(&mut self, path: &Path, kind: impl Into<String>) {
        self.others.insert(path.to_owned(), kind.into());
    }

    /// What to tell the user, a line each.
    pub(crate) fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if let count @ 1.. = self.pictures.len() {
            let names = self.pictures.iter().map(|picture| picture.display().to_string());
            lines.push(format!(
                "warning: {} of formats that are not read left out ({}): {}",
                if count == 1 { "1 picture".into() } else { format!("{count} pictures") },
                counts(self.pictures.iter().map(|picture| kind(picture))),
                listed(names, count)
            ));
        }
        if let count @ 1.. = self.others.len() {
            lines.push(format!(
                "note: {} left out ({})",
                if count == 1 { "1 other file".into() } else { format!("{count} other files") },
                counts(self.others.values().cloned())
            ));
        }
        lines
    }
}

/// The kind of a file, by its extension.
fn kind(path: &Path) -> String {
    match path.extension() {
        Some(extension) => format!(".{}", extension.to_string_lossy().to_lowercase()),
        None => "without extension".into(),
    }
}

/// How many there are of each kind, the most frequent ones first.
fn counts(kinds: impl Iterator<Item = String>) -> String {
    let mut counts = BTreeMap::<_, usize>::new();
    for kind in kinds {
        *counts.entry(kind).or_default() += 1;
    }
    let mut kinds: Vec<_> = counts.iter().collect();
    kinds.sort_by_key(|&(_, count)| core::cmp::Reverse(count));
    listed(kinds.iter().map(|(kind, count)| format!("{count} {kind}")), kinds.len())
}

/// The first of some names, and how many more there are.
pub(super) fn listed(names: impl Iterator<Item = String>, count: usize) -> String {
    let mut text = names.take(NAMED).collect::<Vec<_>>().join(", ");
    if count > NAMED {
        text.push_str(&format!(" and {} more", count - NAMED));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_few_are_named_and_all_are_counted() {
        let mut left_out = LeftOut::default();
        assert!(left_out.lines().is_empty());
        left_out.pictures.insert("in/a.heic".into());
        left_out.add_file(Path::new("in/b.TXT"));
        let expected = [
            "warning: 1 picture of formats that are not read left out (1 .heic): in/a.heic",
            "note: 1 other file left out (1 .txt)",
        ];
        assert_eq!(left_out.lines(), expected);
        for number in 0..9 {
            left_out.pictures.insert(format!("in/{number}.CR3").into());
            left_out.add_file(Path::new(&format!("in/{number}.{}", number / 2)));
        }
        left_out.add_file(Path::new("in/README"));
        left_out.add(Path::new("in/link"), "links to folders");
        let expected = [
            "warning: 10 pictures of formats that are not read left out (9 .cr3, 1 .heic): in/0.CR3, \
             in/1.CR3, in/2.CR3, in/3.CR3, in/4.CR3 and 5 more",
            "note: 12 other files left out (2 .0, 2 .1, 2 .2, 2 .3, 1 .4 and 3 more)",
        ];
        assert_eq!(left_out.lines(), expected);
    }
}
