//! Files of a report: one program at a time writes them, each of them as a whole.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::Path;

use anyhow::{Context, Result, bail};

/// The file in the report's folder that says that a program writes there.
const LOCK: &str = ".lock";

/// Keeps other programs from writing to a report's folder until it is dropped.
///
/// # Errors
/// When another one writes there.
pub(crate) fn lock(folder: &Path) -> Result<File> {
    let path = folder.join(LOCK);
    let file = File::create(&path).with_context(|| format!("cannot write {}", path.display()))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => {
            bail!(
                "another run is writing to {}: wait for it or choose another folder",
                folder.display()
            )
        }
        Err(TryLockError::Error(error)) => {
            Err(error).with_context(|| format!("cannot lock {}", path.display()))
        }
    }
}

/// Makes a folder, and those that it is in, where they are missing.
pub(crate) fn make_folder(path: &Path) -> Result<()> {
    fs::create_dir_all(path).with_context(|| format!("cannot make the folder {}", path.display()))
}

/// The text of a file.
pub(crate) fn read(path: &Path) -> Result<String> {
    fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))
}

/// The text of a file, `None` if there is none.
pub(crate) fn read_if_any(path: &Path) -> Result<Option<String>> {
    match fs::read_to_string(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        text => text.map(Some).with_context(|| format!("cannot read {}", path.display())),
    }
}

/// Writes a file, or replaces it once the new one is whole: an interruption leaves no part of one.
pub(crate) fn replace(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut name = path.file_name().context("a file has a name")?.to_owned();
    name.push(".new");
    let new = path.with_file_name(name);
    let written = fs::write(&new, bytes).and_then(|()| fs::rename(&new, path));
    written.with_context(|| format!("cannot write {}", path.display()))
}

/// How many bytes of a text are whole lines: an interruption leaves at most one torn one, at the end.
pub(crate) fn whole_lines(text: &str) -> usize {
    text.rfind('\n').map_or(0, |end| end + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_program_at_a_time_writes_to_a_folder() {
        let folder = tempfile::tempdir().expect("a folder");
        let first = lock(folder.path()).expect("nobody writes");
        let refusal = lock(folder.path()).expect_err("the first one writes").to_string();
        assert!(refusal.contains("another run"), "{refusal}");
        drop(first);
        assert!(lock(folder.path()).is_ok());
    }

    #[test]
    fn a_file_is_replaced_and_nothing_is_left_beside_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.csv");
        assert_eq!(read_if_any(&path).expect("there is none"), None);
        replace(&path, b"1").expect("it is written");
        replace(&path, b"2").expect("it is written");
        assert_eq!(read(&path).expect("text"), "2");
        assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1);
        let failure = replace(&folder.path().join("b/a.csv"), b"1").expect_err("no such folder");
        assert!(failure.to_string().contains("a.csv"), "{failure}");
    }
}
