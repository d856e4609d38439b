//! The files of a batch, and the names of their results.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use anyhow::{Context, Result, bail};
use ignore::gitignore::GitignoreBuilder;
use ignore::{DirEntry, WalkBuilder};

use super::left_out::LeftOut;
use super::selection::Selection;
use crate::errors::WrongUsage;
use crate::files;

/// A file with patterns of what is to be left out, as in .gitignore, of the folder that it is in.
const IGNORE_FILE: &str = ".gipignore";

/// A file and its result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Item {
    pub(crate) source: PathBuf,
    pub(crate) output: PathBuf,
}

/// How a file of a folder is taken, by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// One to work on.
    Taken,
    /// A picture of a format that is not read.
    Unread,
    /// Something else.
    Other,
}

/// What the inputs have besides the files to work on.
#[derive(Debug, Default)]
pub(crate) struct Rest {
    pub(crate) left_out: LeftOut,
    /// What could not be looked at, and why.
    pub(crate) failed: BTreeMap<PathBuf, String>,
    /// The folders that were looked at.
    pub(crate) folders: Vec<PathBuf>,
}

/// Finds the files to work on: those of the inputs that `selection` takes. `kind` tells which files of a folder are
/// meant; a file that is an input itself is of any kind. `output` names the result of a file by its
/// path below the input.
pub(crate) fn find(
    inputs: &[PathBuf],
    selection: &Selection,
    kind: impl Fn(&Path) -> Kind,
    output: impl Fn(&Path) -> PathBuf,
) -> Result<(Vec<Item>, Rest)> {
    let (mut items, mut rest) = (Vec::new(), Rest::default());
    for input in inputs {
        let name = || input.display().to_string();
        if files::is_standard_stream(input) {
            bail!(WrongUsage("gip batch takes files and folders, not standard input".into()));
        }
        let metadata = fs::metadata(input).with_context(name)?;
        if metadata.is_dir() {
            let add = |source: &Path, below: &Path| {
                items.push(Item { source: source.to_owned(), output: output(below) });
            };
            walk(input, selection, &kind, add, &mut rest)?;
        } else if metadata.is_file() {
            let file_name = Path::new(input.file_name().unwrap_or_default());
            if selection.takes(file_name) {
                items.push(Item { source: input.clone(), output: output(file_name) });
            }
        } else {
            bail!("{}: neither a file nor a folder", name());
        }
    }
    Ok((items, rest))
}

/// Calls `add` with the files to work on in a folder and in its subfolders, in the order of their
/// names, and with their paths below the folder. Hidden files are left out, and links to folders are
/// not followed: they may lead in a circle.
fn walk(
    folder: &Path,
    selection: &Selection,
    kind: &impl Fn(&Path) -> Kind,
    mut add: impl FnMut(&Path, &Path),
    rest: &mut Rest,
) -> Result<()> {
    let is_folder = |entry: &DirEntry| entry.file_type().is_some_and(|kind| kind.is_dir());
    // The walk reads the patterns of a folder before it returns the folder: those of the first one, which
    // no filter is asked about, are checked here.
    check_ignore_file(folder)?;
    let unreadable = Arc::new(OnceLock::new());
    let is_met = {
        let (selection, folder) = (selection.clone(), folder.to_owned());
        let unreadable = Arc::clone(&unreadable);
        move |entry: &DirEntry| {
            if !is_folder(entry) {
                return true;
            }
            let path = entry.path();
            selection.enters(below(&folder, path))
                && check_ignore_file(path).map_err(|error| unreadable.set(error)).is_ok()
        }
    };
    let walk = WalkBuilder::new(folder)
        // What git ignores are often pictures: they are too large for it.
        .standard_filters(false)
        .hidden(true)
        .add_custom_ignore_filename(IGNORE_FILE)
        .ignore_case_insensitive(true)
        .filter_entry(is_met)
        .sort_by_file_name(OsStr::cmp)
        .build();
    for entry in walk {
        let entry = match entry {
            Ok(entry) => entry,
            Err(error) => {
                let path = place(&error).unwrap_or(folder).to_owned();
                rest.failed.insert(path, error.to_string());
                continue;
            }
        };
        if let Some(error) = entry.error() {
            bail!("{error}");
        }
        let path = entry.path();
        if entry.depth() == 0 || is_folder(&entry) {
            rest.folders.push(path.to_owned());
            continue;
        }
        match fs::metadata(path) {
            Ok(metadata) if metadata.is_dir() => rest.left_out.add(path, "links to folders"),
            Ok(metadata) if !metadata.is_file() => rest.left_out.add(path, "devices and pipes"),
            _ if !selection.takes(below(folder, path)) => {}
            outcome => match (kind(path), outcome) {
                (Kind::Taken, Ok(_)) => add(path, below(folder, path)),
                (Kind::Taken, Err(error)) => {
                    rest.failed.insert(path.to_owned(), format!("{}: {error}", path.display()));
                }
                (Kind::Unread, _) => drop(rest.left_out.pictures.insert(path.to_owned())),
                (Kind::Other, _) => rest.left_out.add_file(path),
            },
        }
    }
    Arc::into_inner(unreadable).and_then(OnceLock::into_inner).map_or(Ok(()), Err)
}

/// Refuses a file of patterns that cannot be read as a whole: what it says to leave out would be taken.
fn check_ignore_file(folder: &Path) -> Result<()> {
    let path = folder.join(IGNORE_FILE);
    let name = || path.display().to_string();
    // Where not even this can be asked, nothing in the folder can be read.
    if fs::symlink_metadata(&path).is_err() {
        return Ok(());
    }
    if !fs::metadata(&path).with_context(name)?.is_file() {
        bail!("{}: not a file", name());
    }
    let bytes = fs::read(&path).with_context(name)?;
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&bytes);
    let mut builder = GitignoreBuilder::new(folder);
    // As the walk has it, a class without an end is text: more likely it is a mistake.
    builder.allow_unclosed_class(false);
    for (line, number) in bytes.split(|&byte| byte == b'\n').zip(1..) {
        let place = || format!("{}: line {number}", name());
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        let line = str::from_utf8(line).with_context(place)?;
        // These are of text in another encoding.
        if line.contains('\0') {
            bail!("{}: a NUL character", place());
        }
        builder.add_line(None, line).with_context(place)?;
    }
    builder.build().with_context(name)?;
    Ok(())
}

/// The path of something in a folder below that folder.
fn below<'a>(folder: &Path, path: &'a Path) -> &'a Path {
    path.strip_prefix(folder).unwrap_or(path)
}

/// The path that an error is about.
fn place(error: &ignore::Error) -> Option<&Path> {
    match error {
        ignore::Error::WithPath { path, .. } => Some(path),
        ignore::Error::WithDepth { err, .. } | ignore::Error::WithLineNumber { err, .. } => {
            place(err)
        }
        _ => None,
    }
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
        fs::write(path("in/a/raw.HEIC"), "").expect("writable");
        let kind =
            |path: &Path| match path.extension().map(|extension| extension.to_ascii_lowercase()) {
                Some(extension) if extension == "png" => Kind::Taken,
                Some(extension) if extension == "heic" => Kind::Unread,
                _ => Kind::Other,
            };
        let find = |exclude: &[&str]| {
            // A file that is an input itself may have any name.
            let inputs = [path("in/a/note.txt"), path("in")];
            let exclude: Vec<_> = exclude.iter().map(|&glob| glob.into()).collect();
            let selection = Selection::new(&[], &exclude).expect("globs");
            let output = |below: &Path| Path::new("out").join(below).with_extension("gip");
            find(&inputs, &selection, kind, output).expect("readable")
        };
        let outputs = |items: &[Item]| -> Vec<String> {
            items.iter().map(|item| item.output.display().to_string()).collect()
        };
        let (items, rest) = find(&[]);
        let expected = ["note.gip", "a/deep/x.gip", "a.gip", "b/10.gip", "b/2.gip", "c.gip"];
        assert_eq!(outputs(&items), expected.map(|name| format!("out/{name}")));
        assert_eq!(items[1].source, path("in/a/deep/x.png"));
        assert!(rest.left_out.pictures.iter().eq([&path("in/a/raw.HEIC")]));
        assert_eq!(rest.left_out.lines()[1], "note: 1 other file left out (1 .txt)");
        assert!(rest.failed.is_empty());
        assert_eq!(rest.folders, ["in", "in/a", "in/a/deep", "in/b"].map(path));

        // Patterns hold for files that are named, too.
        let (items, rest) = find(&["b/", "*.TXT", "raw.*"]);
        assert_eq!(outputs(&items), ["a/deep/x", "a", "c"].map(|name| format!("out/{name}.gip")));
        assert!(rest.left_out.lines().is_empty());

        #[cfg(unix)]
        {
            // No circle, but links to files are followed.
            let link = |to: &str, name: &str| {
                std::os::unix::fs::symlink(path(to), path(name)).expect("links exist");
            };
            link("in", "in/b/circle");
            link("in/a.png", "in/d.png");
            link("in/none.png", "in/e.png");
            let (items, rest) = find(&[]);
            assert_eq!(items.len(), expected.len() + 1);
            assert!(rest.left_out.lines()[1].contains("1 links to folders"));
            assert!(rest.failed.keys().eq([&path("in/e.png")]), "{:?}", rest.failed);
        }
    }

    #[test]
    fn an_ignore_file_holds_for_its_folder_and_not_those_of_git() {
        let room = tempfile::tempdir().expect("a place for temporary files");
        let path = |name: &str| room.path().join(name);
        for name in ["a.png", "b/a.png", "b/c/a.png", "b/c/d.png", "e/d.PNG"] {
            fs::create_dir_all(path(name).parent().expect("a folder")).expect("writable");
            fs::write(path(name), "").expect("writable");
        }
        fs::create_dir(path(".git")).expect("writable");
        for name in [".gitignore", ".ignore"] {
            fs::write(path(name), "*").expect("writable");
        }
        fs::write(path(".gipignore"), "d.png").expect("writable");
        fs::write(path("b/.gipignore"), "# those of this folder\n/a.png\n!d.png")
            .expect("writable");
        let selection = Selection::new(&[], &[]).expect("globs");
        let find = || find(&[room.path().into()], &selection, |_| Kind::Taken, Path::to_owned);
        let (items, _) = find().expect("readable");
        let found: Vec<_> = items.iter().map(|item| item.output.display().to_string()).collect();
        assert_eq!(found, ["a.png", "b/c/a.png", "b/c/d.png"]);

        fs::write(path("b/.gipignore"), "good\nbad{").expect("writable");
        let error = find().expect_err("no glob").to_string();
        assert!(error.contains(".gipignore") && error.contains("line 2"), "{error}");
    }

    #[test]
    fn standard_input_and_missing_files_are_refused() {
        let selection = Selection::new(&[], &[]).expect("globs");
        for (input, is_wrong_usage) in [("-", true), ("/dev/stdin", true), ("missing", false)] {
            let found = find(&[input.into()], &selection, |_| Kind::Taken, Path::to_owned);
            let error = found.expect_err("no such input");
            assert_eq!(error.is::<WrongUsage>(), is_wrong_usage, "{error}");
        }
    }
}
