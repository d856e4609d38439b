//! Reading and writing whole files; `-` is standard input or output.

use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

/// Whether a path stands for standard input or output. The devices count too: where they lead to
/// a regular file, it must not be replaced under whoever opened it.
pub(crate) fn is_standard_stream(path: &Path) -> bool {
    ["-", "/dev/stdin", "/dev/stdout"].iter().any(|name| path.as_os_str() == *name)
}

/// What messages call the source of an input.
pub(crate) fn input_name(path: &Path) -> String {
    if is_standard_stream(path) { "standard input".into() } else { path.display().to_string() }
}

/// What messages call the destination of an output.
pub(crate) fn output_name(path: &Path) -> String {
    if is_standard_stream(path) { "standard output".into() } else { path.display().to_string() }
}

/// Reads a whole file, or standard input.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>> {
    if is_standard_stream(path) {
        let mut bytes = Vec::new();
        io::stdin().lock().read_to_end(&mut bytes).with_context(|| input_name(path))?;
        return Ok(bytes);
    }
    fs::read(path).with_context(|| input_name(path))
}

/// Prints text to standard output, or to standard error where the former carries a file. A reader
/// that has closed the pipe wants no more, which is no failure.
pub(crate) fn print(text: &str, output: Option<&Path>) -> Result<()> {
    let written = if output.is_some_and(is_standard_stream) {
        writeln!(io::stderr(), "{text}")
    } else {
        writeln!(io::stdout(), "{text}")
    };
    match written {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}

/// Where a result goes. A regular file appears under its name only when it is complete: on any
/// failure an existing file is as it was, and a new one is not there.
#[derive(Debug)]
pub(crate) enum Output {
    /// Standard output.
    Standard,
    /// Something that cannot be replaced, such as a device or a named pipe.
    Special(PathBuf),
    /// A regular file, with its directory.
    Regular { path: PathBuf, directory: PathBuf },
}

impl Output {
    /// Finds out what stands at `path`, so that what cannot be written is known before the work.
    pub(crate) fn new(path: &Path) -> Result<Self> {
        if is_standard_stream(path) {
            return Ok(Self::Standard);
        }
        let context = || output_name(path);
        // Through a symbolic link, the file that it leads to is written, and the link stays.
        let path = match fs::metadata(path) {
            Ok(metadata) if metadata.is_dir() => bail!("{} is a directory", path.display()),
            Ok(metadata) if !metadata.is_file() => return Ok(Self::Special(path.to_owned())),
            Ok(_) => path.canonicalize().with_context(context)?,
            Err(error) if error.kind() == io::ErrorKind::NotFound => path.to_owned(),
            Err(error) => return Err(error).with_context(context),
        };
        let directory = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
            _ => PathBuf::from("."),
        };
        if !directory.is_dir() {
            bail!("{}: there is no directory {}", path.display(), directory.display());
        }
        Ok(Self::Regular { path, directory })
    }

    /// Writes the whole result.
    pub(crate) fn write(&self, bytes: &[u8]) -> Result<()> {
        match self {
            Self::Standard => {
                let mut stdout = io::stdout().lock();
                stdout.write_all(bytes).and_then(|()| stdout.flush()).context("standard output")
            }
            Self::Special(path) => fs::OpenOptions::new()
                .write(true)
                .open(path)
                .and_then(|mut file| file.write_all(bytes))
                .with_context(|| output_name(path)),
            Self::Regular { path, directory } => {
                replace(path, directory, bytes).with_context(|| output_name(path))
            }
        }
    }
}

/// Writes a temporary file next to `path` and renames it.
fn replace(path: &Path, directory: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".gip-");
    // Temporary files are private; this one is to be as public as the user's mask allows.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(directory)?;
    if let Ok(existing) = fs::metadata(path) {
        file.as_file().set_permissions(existing.permissions())?;
    }
    file.write_all(bytes)?;
    file.as_file().sync_all()?;
    file.persist(path)?;
    Ok(())
}
