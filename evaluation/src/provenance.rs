//! Which version was measured, and on which machine.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread::available_parallelism;

/// The crate's folder in the repository.
pub(crate) const FOLDER: &str = env!("CARGO_MANIFEST_DIR");
/// The files of the product, relative to [`FOLDER`].
const PRODUCT: [&str; 2] = ["../src", "../Cargo.toml"];

/// Processor, number of cores, system.
pub(crate) fn machine() -> String {
    let info = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    let model = model.map_or("unknown processor", |(_, model)| model.trim());
    format!("{model} ({}), {} cores, {}", std::env::consts::ARCH, cores(), std::env::consts::OS)
}

pub(crate) fn cores() -> usize {
    available_parallelism().map_or(1, Into::into)
}

/// The commit that last changed the product, with a checksum of its files if they differ from it.
pub(crate) fn product() -> String {
    let checksum = || {
        let mut hasher = crc32fast::Hasher::new();
        PRODUCT.iter().for_each(|path| hash(&Path::new(FOLDER).join(path), &mut hasher));
        format!("{:08x}", hasher.finalize())
    };
    let Some(commit) = git(&["log", "-1", "--format=%h", "--abbrev=10"], &PRODUCT) else {
        return format!("a copy outside of git, {}", checksum());
    };
    let changes = git(&["status", "--porcelain"], &PRODUCT).unwrap_or_default();
    if changes.is_empty() { commit } else { format!("{commit}+{}", checksum()) }
}

/// Hashes a file, or all files of a folder in the order of their names.
fn hash(path: &Path, hasher: &mut crc32fast::Hasher) {
    if let Ok(folder) = fs::read_dir(path) {
        let mut paths: Vec<PathBuf> = folder.flatten().map(|entry| entry.path()).collect();
        paths.sort();
        paths.iter().for_each(|path| hash(path, hasher));
    } else if let Ok(bytes) = fs::read(path) {
        hasher.update(&bytes);
    }
}

/// The commit that is checked out.
pub(crate) fn commit() -> String {
    git(&["log", "-1", "--format=%H"], &[]).unwrap_or_else(|| "none: a copy outside of git".into())
}

/// The version of the compiler.
pub(crate) fn compiler() -> String {
    output(Command::new("rustc").arg("--version")).unwrap_or_else(|| "unknown".into())
}

fn git(arguments: &[&str], paths: &[&str]) -> Option<String> {
    output(Command::new("git").current_dir(FOLDER).args(arguments).arg("--").args(paths))
}

fn output(command: &mut Command) -> Option<String> {
    let output = command.stderr(Stdio::null()).output().ok()?;
    let text = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    output.status.success().then_some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksums_follow_every_file_of_a_folder() {
        let folder = tempfile::tempdir().expect("a folder");
        let checksum = || {
            let mut hasher = crc32fast::Hasher::new();
            hash(folder.path(), &mut hasher);
            hasher.finalize()
        };
        fs::create_dir(folder.path().join("inner")).expect("a folder");
        let file = folder.path().join("inner/file");
        fs::write(&file, "one").expect("it is written");
        let one = checksum();
        assert_eq!(checksum(), one);
        fs::write(&file, "two").expect("it is written");
        assert_ne!(checksum(), one);
    }
}
