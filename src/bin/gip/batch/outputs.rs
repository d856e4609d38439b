//! Where results go: checks before anything is written.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use super::inputs::Item;
use super::left_out::listed;
use super::manifest::Written;
use crate::errors::WrongUsage;
use crate::files;

/// What a batch does, without conflicts.
#[derive(Debug)]
pub(crate) struct Plan {
    /// The files, in order; none is there twice.
    pub(crate) items: Vec<Item>,
    /// The folders that results, and the manifest, are written to. They need not exist.
    pub(crate) folders: BTreeSet<PathBuf>,
}

impl Plan {
    /// Refuses results that would replace each other, or a source, or stand in each other's way. The
    /// manifest counts as a result. A file that is given twice is taken once.
    pub(crate) fn new(found: Vec<Item>, manifest: Option<&Path>) -> Result<Self> {
        let (mut items, mut folders) = (Vec::<Item>::new(), BTreeSet::new());
        // What is written to each place: the result of an item, or the manifest.
        let mut places: BTreeMap<PathBuf, Option<usize>> = BTreeMap::new();
        // Where the sources of the items really are.
        let mut sources = Vec::new();
        if let Some(manifest) = manifest.filter(|path| !files::is_standard_stream(path)) {
            let place = place(manifest);
            folders.extend(place.parent().map(Path::to_owned));
            places.insert(folded(&place), None);
        }
        for item in found {
            let (name, output) = (item.source.display(), item.output.display());
            let source = item.source.canonicalize().with_context(|| name.to_string())?;
            let (source, place) = (folded(&source), place(&item.output));
            match places.get(&folded(&place)) {
                Some(&Some(other)) if sources[other] == source => continue,
                Some(&Some(other)) => {
                    let other = items[other].source.display();
                    bail!(WrongUsage(format!("{other} and {name} both become {output}")));
                }
                Some(None) => bail!(WrongUsage(format!("{output} is also the manifest"))),
                None => {}
            }
            folders.extend(place.parent().map(Path::to_owned));
            places.insert(folded(&place), Some(items.len()));
            sources.push(source);
            items.push(item);
        }
        let sources: HashSet<PathBuf> = sources.into_iter().collect();
        let name = |place: &Path| {
            let result = places[place].map(|index| items[index].output.as_path());
            result.or(manifest).unwrap_or(place).display().to_string()
        };
        for place in places.keys() {
            if sources.contains(place) {
                bail!(WrongUsage(format!("{} is an input and would be replaced", name(place))));
            }
            if let Some(file) = place.ancestors().skip(1).find(|path| places.contains_key(*path)) {
                let (file, place) = (name(file), name(place));
                bail!(WrongUsage(format!("{file} would be a file and the folder of {place}")));
            }
        }
        Ok(Self { items, folders })
    }
}

/// Refuses results that would replace files of the inputs: those in `folders`, which are the ones that were
/// looked at, and those beside a source. Nobody knows whether such a file is an earlier result, unless the
/// manifest says so.
pub(crate) fn protect<'a>(
    results: impl Iterator<Item = &'a Item> + Clone,
    folders: &[PathBuf],
    earlier: &Written,
) -> Result<()> {
    let sources = results.clone().filter_map(|item| item.source.parent());
    let folders: HashSet<&Path> = folders.iter().map(PathBuf::as_path).chain(sources).collect();
    let folders: HashSet<PathBuf> = folders.into_iter().map(|path| folded(&place(path))).collect();
    let is_in_input =
        |file: &Path| file.parent().is_some_and(|path| folders.contains(&folded(path)));
    let replaced = |output: &Path| {
        // A link in an input counts, and so does a file of an input that a link leads to.
        let link = match (output.parent(), output.file_name()) {
            (Some(parent), Some(name)) => place(parent).join(name),
            _ => output.to_owned(),
        };
        link.exists()
            && !earlier.includes(output)
            && (is_in_input(&link) || is_in_input(&place(output)))
    };
    let outputs = results.map(|item| item.output.as_path());
    let lost: Vec<_> = outputs.filter(|path| replaced(path)).collect();
    if lost.is_empty() {
        return Ok(());
    }
    let names = listed(lost.iter().map(|path| path.display().to_string()), lost.len());
    bail!(WrongUsage(format!(
        "results would replace files of the inputs: {names}; take another folder for --out, or the --manifest \
         of the run that wrote them"
    )))
}

/// The file that is written under a name, which need not exist: an absolute path without links.
fn place(path: &Path) -> PathBuf {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    absolute.canonicalize().unwrap_or_else(|_| match (absolute.parent(), absolute.file_name()) {
        (Some(parent), Some(name)) => place(parent).join(name),
        _ => absolute,
    })
}

/// A path in the form in which the file system compares it.
fn folded(path: &Path) -> PathBuf {
    if cfg!(any(windows, target_vendor = "apple")) {
        return files::unique_text(path).to_lowercase().into();
    }
    path.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    /// A folder with files in it.
    fn room(names: &[&str]) -> tempfile::TempDir {
        let room = tempfile::tempdir().expect("a place for temporary files");
        for name in names {
            let path = room.path().join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("writable");
            fs::write(path, "").expect("writable");
        }
        room
    }

    fn plan(room: &Path, pairs: &[(&str, &str)], manifest: Option<&str>) -> Result<Plan> {
        let item = |&(source, output): &(&str, &str)| Item {
            source: room.join(source),
            output: room.join(output),
        };
        Plan::new(pairs.iter().map(item).collect(), manifest.map(|name| room.join(name)).as_deref())
    }

    #[test]
    fn results_do_not_replace_each_other_or_a_source() {
        let room = room(&["a.png", "a.jpg", "b.png", "a.gip"]);
        for (pairs, manifest, words) in [
            (&[("a.png", "o/a.gip"), ("a.jpg", "o/a.gip")][..], None, "both become"),
            (&[("a.png", "o/a.gip"), ("a.jpg", "o/./a.gip")], None, "both become"),
            (&[("a.png", "a.gip"), ("a.gip", "o/a.gip")], None, "is an input"),
            (&[("a.gip", "a.gip")], None, "is an input"),
            (&[("a.png", "o/a.gip"), ("b.png", "o/a.gip/b.gip")], None, "the folder of"),
            (&[("a.png", "o/a.gip")], Some("o/a.gip"), "the manifest"),
            (&[("a.png", "o/a.gip")], Some("a.png"), "is an input"),
            (&[("a.png", "o/a.gip")], Some("o"), "the folder of"),
        ] {
            let error = plan(room.path(), pairs, manifest).expect_err("a conflict");
            assert!(error.is::<WrongUsage>(), "{error}");
            assert!(error.to_string().contains(words), "{error}: {words}");
        }
        let pairs = [("a.png", "o/a.gip"), ("b.png", "o/p/b.gip"), ("a.png", "o/a.gip")];
        let plan = plan(room.path(), &pairs, Some("m")).expect("no conflict");
        assert_eq!(plan.items.len(), 2, "a file that is given twice is taken once");
        let root = room.path().canonicalize().expect("it exists");
        assert!(plan.folders.into_iter().eq([root.clone(), root.join("o"), root.join("o/p")]));
    }

    #[test]
    #[cfg(unix)]
    fn links_hide_no_conflict() {
        let room = room(&["a.png", "b.png", "x/old.gip"]);
        let link = |to: &str, name: &str| {
            std::os::unix::fs::symlink(room.path().join(to), room.path().join(name))
        };
        link("x", "y").expect("links exist");
        link("x/old.gip", "x/new.gip").expect("links exist");
        for pairs in [
            [("a.png", "x/c.gip"), ("b.png", "y/c.gip")],
            [("a.png", "x/old.gip"), ("b.png", "x/new.gip")],
            [("a.png", "x/old.gip"), ("y/old.gip", "z.gip")],
        ] {
            assert!(plan(room.path(), &pairs, None).is_err(), "{pairs:?}");
        }
    }
}
