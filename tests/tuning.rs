//! `docs/tuning.md` and the code of the encoder agree: values are the same, no constant is missing, and
//! files with tuned constants name the document.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// A line of a table: constants, or a function with numbers in it.
#[derive(Debug)]
struct Row<'a> {
    names: Vec<&'a str>,
    file: &'a str,
    values: Vec<&'a str>,
}

/// What is between backticks.
fn code(cell: &str) -> Vec<&str> {
    cell.split('`').skip(1).step_by(2).collect()
}

/// The lines of the tables in a part of the document.
fn rows(part: &str) -> Vec<Row<'_>> {
    let row = |line| {
        let cells: Vec<&str> = str::split(line, " | ").collect();
        let [names, file, values, ..] = cells[..] else { panic!("too few columns: {line}") };
        Row { names: code(names), file: code(file)[0], values: code(values) }
    };
    part.lines().filter(|line| line.starts_with("| `")).map(row).collect()
}

/// The text with one space wherever there is any.
fn spaced(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The name, the type and what follows, if this is the definition of a constant.
fn constant(line: &str) -> Option<(&str, &str)> {
    let line = line.trim_start();
    let visibility = ["", "pub ", "pub(crate) ", "pub(super) "];
    let rest =
        visibility.into_iter().find_map(|scope| line.strip_prefix(scope)?.strip_prefix("const "));
    rest?
        .split_once(": ")
        .filter(|(name, _)| name.chars().all(|c| c.is_ascii_uppercase() || c == '_'))
}

/// The value of a constant.
fn value(source: &str, name: &str) -> Option<String> {
    let line =
        source.lines().find(|line| constant(line).is_some_and(|(found, _)| found == name))?;
    let from = line.as_ptr() as usize - source.as_ptr() as usize;
    let (_, value) = source[from..].split_once('=')?;
    Some(spaced(value.split_once(';')?.0))
}

/// The body of a function.
fn body(source: &str, name: &str) -> Option<String> {
    let is_start = |line: &&str| {
        line.split_once(&format!("fn {name}")).is_some_and(|(_, rest)| rest.starts_with(['(', '<']))
    };
    let mut lines = source.lines().skip_while(|line| !is_start(line));
    let first = lines.next()?;
    let end = format!("{}}}", &first[..first.len() - first.trim_start().len()]);
    Some(spaced(&lines.take_while(|line| *line != end).collect::<Vec<_>>().join("\n")))
}

/// All `.rs` files in a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("the folder is there");
    let paths = entries.map(|entry| entry.expect("it can be read").path());
    let found = paths.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] });
    found.filter(|path| path.extension().is_some_and(|extension| extension == "rs")).collect()
}

#[test]
fn the_document_and_the_code_agree() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    // It is no part of the package.
    let Ok(document) = fs::read_to_string(root.join("docs/tuning.md")) else { return };
    let (tuned, fixed) = document.split_once("\n## Not tuned\n").expect("the heading");
    let read = |file: &str| fs::read_to_string(root.join("src").join(file));
    let mut documented = BTreeSet::new();
    let mut faults = Vec::new();
    for (part, is_tuned) in [(tuned, true), (fixed, false)] {
        for Row { names, file, values } in rows(part) {
            let Ok(source) = read(file) else {
                faults.push(format!("{names:?}: there is no {file}"));
                continue;
            };
            if is_tuned && !source.contains("docs/tuning.md") {
                faults.push(format!("{file} does not name docs/tuning.md"));
            }
            for name in names {
                documented.insert((file.to_owned(), name.to_owned()));
                let agrees = match (value(&source, name), body(&source, name)) {
                    (Some(value), _) => !is_tuned || values == [value],
                    (None, Some(body)) => values.iter().all(|value| body.contains(value)),
                    (None, None) => false,
                };
                if !agrees {
                    faults.push(format!("{file}: {name} is not {values:?}"));
                }
            }
        }
    }
    for path in files(&root.join("src/encode")) {
        let file = path.strip_prefix(root.join("src")).expect("it is inside");
        let file = file.to_str().expect("UTF-8").replace('\\', "/");
        if file.ends_with("tests.rs") || file.ends_with("testing.rs") {
            continue;
        }
        let source = fs::read_to_string(&path).expect("it is text");
        let (product, _) = source.split_once("#[cfg(test)]\nmod ").unwrap_or((&source, ""));
        for (name, rest) in product.lines().filter_map(constant) {
            if !rest.starts_with("Self") && !documented.contains(&(file.clone(), name.to_owned())) {
                faults.push(format!("{file}: {name} is not in docs/tuning.md"));
            }
        }
    }
    assert!(documented.len() > 200, "only {} constants were found", documented.len());
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
