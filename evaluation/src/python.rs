//! Virtual environments of Python, which are set up here.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::files;
use crate::provenance::FOLDER;

/// A package that is built from its source, and the version of that source.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Built<'a> {
    pub(crate) source: &'a Path,
    pub(crate) version: &'a str,
}

/// The Python of the environment of this name, which has the packages of a list of requirements. It is made where it is
/// missing or has others.
pub(crate) fn environment(
    name: &str,
    requirements: &Path,
    built: Option<Built<'_>>,
) -> Result<PathBuf> {
    let folder = Path::new(FOLDER).join("target").join(name);
    let mut wanted = files::read(requirements)?;
    if let Some(Built { source, version }) = built {
        wanted.push_str(&format!("{} of {version}\n", source.display()));
    }
    let installed = folder.join("installed.txt");
    let python = folder.join("bin/python");
    if fs::read_to_string(&installed).is_ok_and(|text| text == wanted) {
        return Ok(python);
    }
    eprintln!("setting up {}", folder.display());
    run(Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder))?;
    let pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--requirement"];
    let mut install = Command::new(&python);
    install.args(pip).arg(requirements);
    run(install.args(built.map(|built| built.source)))?;
    files::replace(&installed, wanted.as_bytes())?;
    Ok(python)
}

fn run(command: &mut Command) -> Result<()> {
    let status = command.status();
    let status = status.with_context(|| format!("cannot run {command:?}: is Python installed?"))?;
    ensure!(
        status.success(),
        "{command:?} failed; Python 3.11 or later and the network are needed"
    );
    Ok(())
}
