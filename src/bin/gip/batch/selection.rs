//! Which files are meant: the patterns of the command line.

use std::path::Path;

use anyhow::Result;
use ignore::gitignore::{Gitignore, GitignoreBuilder};

use crate::errors::WrongUsage;

/// Patterns of files that are taken, and of files and folders that are not.
#[derive(Clone, Debug)]
pub(crate) struct Selection {
    include: Gitignore,
    exclude: Gitignore,
}

impl Selection {
    /// # Errors
    /// [`WrongUsage`] when one of the globs is none.
    pub(crate) fn new(include: &[String], exclude: &[String]) -> Result<Self> {
        Ok(Self { include: patterns(include)?, exclude: patterns(exclude)? })
    }

    /// Whether a file is meant, by its path below the folder that is an input.
    pub(crate) fn takes(&self, below: &Path) -> bool {
        let is_in =
            |patterns: &Gitignore| patterns.matched_path_or_any_parents(below, false).is_ignore();
        (self.include.is_empty() || is_in(&self.include)) && !is_in(&self.exclude)
    }

    /// Whether there can be files in a folder that are meant, by its path below the input.
    pub(crate) fn enters(&self, below: &Path) -> bool {
        !self.exclude.matched(below, true).is_ignore()
    }
}

fn patterns(globs: &[String]) -> Result<Gitignore> {
    let parse = || -> Result<Gitignore, ignore::Error> {
        // The paths are relative, and so is the place of the patterns.
        let mut builder = GitignoreBuilder::new("");
        // As with extensions: cameras write them in capitals.
        builder.case_insensitive(true)?.allow_unclosed_class(false);
        for glob in globs {
            builder.add_line(None, glob)?;
        }
        builder.build()
    };
    Ok(parse().map_err(|error| WrongUsage(error.to_string()))?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn selection(include: &[&str], exclude: &[&str]) -> Selection {
        let owned = |globs: &[&str]| globs.iter().map(|&glob| glob.into()).collect::<Vec<_>>();
        Selection::new(&owned(include), &owned(exclude)).expect("globs")
    }

    #[test]
    fn globs_are_those_of_gitignore() {
        for (include, exclude, taken, refused) in [
            (&[][..], &[][..], &["a.png", "b/c.png"][..], &[][..]),
            (&["*.JPG"], &[], &["a.jpg", "b/c.Jpg"], &["a.jpg.png"]),
            (&["2024/", "*.png"], &[], &["2024/may/a.jpg", "x/2024/b.jpg", "c.png"], &["d.jpg"]),
            (&["/2024/*.jpg"], &[], &["2024/a.jpg"], &["2024/may/a.jpg", "x/2024/a.jpg"]),
            (
                &[],
                &["*_small.*", "raw/**"],
                &["a.jpg"],
                &["a_small.jpg", "x/b_small.png", "raw/c.png"],
            ),
            (&["*.jpg"], &["x/"], &["a.jpg", "y/x.jpg"], &["x/a.jpg", "y/x/a.jpg"]),
            (&[], &["*.jpg", "!keep.jpg"], &["x/keep.jpg"], &["a.jpg"]),
        ] {
            let selection = selection(include, exclude);
            for path in taken {
                assert!(selection.takes(Path::new(path)), "{path}: {selection:?}");
            }
            for path in refused {
                assert!(!selection.takes(Path::new(path)), "{path}: {selection:?}");
            }
        }
    }

    #[test]
    fn excluded_folders_are_not_entered() {
        let selection = selection(&["*.jpg"], &["x/", "y/z"]);
        let entered = ["x", "a/x", "y", "y/z", "z"].map(|path| selection.enters(Path::new(path)));
        assert_eq!(entered, [false, false, true, false, true]);
    }

    #[test]
    fn what_is_no_glob_is_wrong_usage() {
        let error = Selection::new(&[], &["a[".into()]).expect_err("no glob");
        assert!(error.is::<WrongUsage>() && error.to_string().contains("a["), "{error}");
    }
}
