//! What was measured, and where.

use std::fs;
use std::io::Write;
use std::process::{Command, Stdio};
use std::thread::available_parallelism;

/// The crate's folder in the repository.
pub(crate) const FOLDER: &str = env!("CARGO_MANIFEST_DIR");
/// What of the repository is measured, seen from [`FOLDER`].
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

/// The commit that last changed the codec, and a hash of what was changed since.
pub(crate) fn product() -> String {
    let Some(commit) = git(&["log", "-1", "--format=%h", "--abbrev=10"], &PRODUCT) else {
        return "a copy outside of git".into();
    };
    let change = git(&["diff", "HEAD"], &PRODUCT).unwrap_or_default();
    if change.is_empty() { commit } else { format!("{commit}+{}", hash(&change)) }
}

/// The commit that is checked out.
pub(crate) fn commit() -> String {
    git(&["log", "-1", "--format=%H"], &[]).unwrap_or_else(|| "none: a copy outside of git".into())
}

/// The compiler, as far as it tells.
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

/// Eight digits that tell one text from another.
fn hash(text: &str) -> String {
    let hashed = || -> Option<String> {
        let mut git = Command::new("git")
            .args(["hash-object", "--stdin"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .ok()?;
        git.stdin.take()?.write_all(text.as_bytes()).ok()?;
        let output = git.wait_with_output().ok()?;
        Some(String::from_utf8_lossy(&output.stdout).chars().take(8).collect())
    };
    hashed().unwrap_or_else(|| "changed".into())
}
