//! Which version was measured, and on which machine.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::available_parallelism;

use anyhow::{Context, Result};

use crate::{code, files};

/// The crate's folder in the repository.
pub(crate) const FOLDER: &str = env!("CARGO_MANIFEST_DIR");
/// What the version of our codec begins with.
const PRODUCT: &str = "gip-";

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

/// The version of our codec: what can change a result, as a checksum.
pub(crate) fn product() -> Result<String> {
    let folder = Path::new(FOLDER);
    let checksum = code::checksum(&folder.join("../src"), &folder.join("Cargo.lock"), "image-gip")?;
    Ok(format!("{PRODUCT}{checksum:08x}"))
}

/// Packages with their versions, from `Cargo.lock`.
pub(crate) fn packages(names: &[&str]) -> Result<Vec<String>> {
    let lock = files::read(&Path::new(FOLDER).join("Cargo.lock"))?;
    let needed = code::packages(&lock, env!("CARGO_PKG_NAME"));
    let known = names.iter().map(|name| {
        let found = needed.iter().find(|package| package.split(' ').next() == Some(*name));
        found.cloned().with_context(|| format!("no package {name}"))
    });
    known.collect()
}

/// Whether a version of measurements is that of another version of our codec than this one.
pub(crate) fn is_of_another(version: &str, product: &str) -> bool {
    version.contains(PRODUCT) && !version.contains(product)
}

/// The commit that is checked out, and whether the product differs from it.
pub(crate) fn commit() -> String {
    let Some(commit) = git(&["log", "-1", "--format=%h", "--abbrev=10"], &[]) else {
        return "none: a copy outside of git".into();
    };
    let changes = git(&["status", "--porcelain"], &["../src"]).unwrap_or_default();
    if changes.is_empty() { commit } else { format!("{commit} with changes") }
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
    fn packages_have_versions() {
        let packages = packages(&["anyhow", "csv"]).expect("both are used");
        assert!(packages[0].starts_with("anyhow 1.") && packages[1].starts_with("csv 1."));
        assert!(super::packages(&["no such"]).is_err());
    }

    #[test]
    fn versions_of_baselines_stay_and_those_of_other_codecs_do_not() {
        let product = product().expect("the source is there");
        assert_eq!(product.len(), PRODUCT.len() + 8);
        assert!(!is_of_another(&product, &product));
        assert!(!is_of_another("libwebp 1.6.0", &product));
        assert!(!is_of_another(&format!("libwebp 1.6.0, beside {product}"), &product));
        assert!(is_of_another("libwebp 1.6.0, beside gip-other", &product));
        assert!(is_of_another("gip-other", &product));
    }
}
