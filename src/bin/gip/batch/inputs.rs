//! The files of a batch, and the names of their results.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use crate::errors::WrongUsage;
use crate::files;

/// A file and its result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Item {
    pub(crate) source: PathBuf,
    pub(crate) output: PathBuf,
}

/// Finds the files of the inputs. `takes` tells which files of a folder are meant; a file that is an
/// input itself is always meant. `extension` is that of the results.
pub(crate) fn find(
    inputs: &[PathBuf],
    out: &Path,
    takes: impl Fn(&Path) -> bool,
    extension: &str,
) -> Result<Vec<Item>> {
    let mut items = Vec::new();
    let mut add = |source: &Path, name: &Path| {
        let output = out.join(name).with_extension(extension);
        items.push(Item { source: source.to_owned(), output });
    };
    for input in inputs {
        let name = || input.display().to_string();
        if files::is_standard_stream(input) {
            bail!(WrongUsage("gip batch takes files and folders, not standard input".into()));
        }
        let kind = fs::metadata(input).with_context(name)?;
        if kind.is_dir() {
            walk(input, Path::new(""), &takes, &mut add)?;
        } else if kind.is_file() {
            add(input, Path::new(input.file_name().unwrap_or_default()));
        } else {
            bail!("{}: neither a file nor a folder", name());
        }
    }
    Ok(items)
}

/// Calls `add` with the files in a folder and in its subfolders, in the order of their names, and
/// with their paths below the first folder. Hidden files and links to folders are left out.
fn walk(
    folder: &Path,
    below: &Path,
    takes: &impl Fn(&Path) -> bool,
    add: &mut impl FnMut(&Path, &Path),
) -> Result<()> {
    let name = || folder.display().to_string();
    let entries: Result<Vec<_>, _> = fs::read_dir(folder).with_context(name)?.collect();
    let mut entries = entries.with_context(name)?;
    entries.sort_by_key(fs::DirEntry::file_name);
    for entry in entries {
        let (path, name) = (entry.path(), entry.file_name());
        if name.as_encoded_bytes().starts_with(b".") {
            continue;
        }
        if entry.file_type().with_context(|| path.display().to_string())?.is_dir() {
            walk(&path, &below.join(name), takes, add)?;
        } else if takes(&path) && path.is_file() {
            add(&path, &below.join(name));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_are_walked_in_the_order_of_names() {
        let room = tempfile::tempdir().expect("a place for temporary files");
        let path = |name: &str| room.path().join(name);
        for folder in ["in/b", "in/a/deep", "in/.git"] {
            fs::create_dir_all(path(folder)).expect("writable");
        }
        let names = ["b/2.png", "b/10.png", "c.PNG", "a/deep/x.png", "a.png", "a/note.txt"];
        for name in names.iter().chain(&[".hidden.png", ".git/x.png"]) {
            fs::write(path("in").join(name), "").expect("writable");
        }
        let takes = |path: &Path| {
            path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png"))
        };
        // A file that is an input itself may have any name.
        let inputs = [path("in/a/note.txt"), path("in")];
        let items = find(&inputs, Path::new("out"), takes, "gip").expect("readable");
        let outputs: Vec<_> = items.iter().map(|item| item.output.display().to_string()).collect();
        let expected = ["note.gip", "a/deep/x.gip", "a.gip", "b/10.gip", "b/2.gip", "c.gip"];
        assert_eq!(outputs, expected.map(|name| format!("out/{name}")));
        assert_eq!(items[1].source, path("in/a/deep/x.png"));

        #[cfg(unix)]
        {
            // No circle, but links to files are followed.
            std::os::unix::fs::symlink(path("in"), path("in/b/circle")).expect("links exist");
            std::os::unix::fs::symlink(path("in/a.png"), path("in/d.png")).expect("links exist");
            let items = find(&inputs, Path::new("out"), takes, "gip").expect("readable");
            assert_eq!(items.len(), expected.len() + 1);
        }
    }

    #[test]
    fn standard_input_and_missing_files_are_refused() {
        for (input, is_wrong_usage) in [("-", true), ("/dev/stdin", true), ("missing", false)] {
            let found = find(&[input.into()], Path::new("out"), |_| true, "gip");
            let error = found.expect_err("no such input");
            assert_eq!(error.is::<WrongUsage>(), is_wrong_usage, "{error}");
        }
    }
}
