//! Reading and writing whole files; `-` is standard input or output.

use std::ffi::OsStr;
use std::fs::{self, File, FileTimes, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use tempfile::NamedTempFile;

use crate::errors::WrongUsage;

/// How the names of temporary files begin and end.
const TEMPORARY: (&str, &str) = (".gip-", ".tmp");
/// Random characters between them.
const TEMPORARY_RANDOM: usize = 6;

/// Whether a path stands for standard input or output. So do the devices: if they are redirected to
/// a regular file, that file must not be replaced while another program has it open.
pub(crate) fn is_standard_stream(path: &Path) -> bool {
    ["-", "/dev/stdin", "/dev/stdout"].iter().any(|name| path.as_os_str() == *name)
}

/// The name of an input in messages.
pub(crate) fn input_name(path: &Path) -> String {
    if is_standard_stream(path) { "standard input".into() } else { path.display().to_string() }
}

/// The name of an output in messages.
pub(crate) fn output_name(path: &Path) -> String {
    if is_standard_stream(path) { "standard output".into() } else { path.display().to_string() }
}

/// A path as text that no other path has: every byte that is not UTF-8 is U+FFFD and two hexadecimal
/// digits. So are the three bytes of a U+FFFD in the path itself. On Windows, the bytes are WTF-8.
pub(crate) fn unique_text(path: &Path) -> String {
    let mut text = String::new();
    let escape = |text: &mut String, bytes: &[u8]| {
        for byte in bytes {
            text.push_str(&format!("\u{FFFD}{byte:02X}"));
        }
    };
    for chunk in path.as_os_str().as_encoded_bytes().utf8_chunks() {
        for part in chunk.valid().split_inclusive(char::REPLACEMENT_CHARACTER) {
            let plain = part.trim_end_matches(char::REPLACEMENT_CHARACTER);
            text.push_str(plain);
            escape(&mut text, &part.as_bytes()[plain.len()..]);
        }
        escape(&mut text, chunk.invalid());
    }
    text
}

/// Prints a line to standard error. Where nobody can read it, the work is no worse for it.
pub(crate) fn tell(line: &str) {
    let _ = writeln!(io::stderr(), "{line}");
}

/// Prints what of an input is lost to standard error.
pub(crate) fn warn(input: &Path, warnings: &[String]) {
    for warning in warnings {
        tell(&format!("warning: {}: {warning}", input_name(input)));
    }
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

/// When a file was changed and read last.
pub(crate) fn times(path: &Path) -> Result<FileTimes> {
    let context = || input_name(path);
    let metadata = fs::metadata(path).with_context(context)?;
    let times = FileTimes::new().set_modified(metadata.modified().with_context(context)?);
    // Not every system knows when a file was read.
    Ok(metadata.accessed().map_or(times, |accessed| times.set_accessed(accessed)))
}

/// Prints text to standard output, or to standard error if the output file goes to standard output.
/// It is not an error if the reader has closed the pipe.
pub(crate) fn print(text: &str, output: Option<&Path>) -> Result<()> {
    if output.is_some_and(is_standard_stream) {
        tell(text);
        return Ok(());
    }
    Ok(unless_closed(writeln!(io::stdout(), "{text}"))?)
}

/// A program that reads our output, such as `head`, may have seen enough of it.
fn unless_closed(written: io::Result<()>) -> io::Result<()> {
    written.or_else(|error| match error.kind() {
        io::ErrorKind::BrokenPipe => Ok(()),
        _ => Err(error),
    })
}

/// The destination of a result. A regular file gets its name only when it is complete: after a
/// failure, an existing file is unchanged, and a new one does not exist.
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
    /// Checks what is at `path`, so that an error is reported before the work is done.
    pub(crate) fn new(path: &Path) -> Result<Self> {
        if is_standard_stream(path) {
            return Ok(Self::Standard);
        }
        let context = || output_name(path);
        // The target of a symbolic link is written, and the link stays.
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

    /// Refuses a name with another extension than .gip for what this command writes: programs would take the
    /// file for another format.
    pub(crate) fn check_name(&self, command: &str) -> Result<()> {
        let Self::Regular { path, .. } = self else { return Ok(()) };
        let extension = path.extension().unwrap_or_default();
        if !extension.eq_ignore_ascii_case("gip") {
            bail!(
                "{}: gip {command} writes .gip files only; use a name that ends in .gip, or --force",
                path.display()
            );
        }
        Ok(())
    }

    /// Refuses to replace the input by what is made of it, which has less than the input.
    pub(crate) fn check_is_not(&self, input: &Path) -> Result<()> {
        let Self::Regular { path, .. } = self else { return Ok(()) };
        if input.canonicalize().is_ok_and(|input| input == *path) {
            bail!("{} is the input; use another name", path.display());
        }
        Ok(())
    }

    /// The times of the source, for this result.
    ///
    /// # Errors
    /// When the source has no times, or this cannot have them.
    pub(crate) fn times_of(&self, source: &Path) -> Result<FileTimes> {
        if is_standard_stream(source) || !matches!(self, Self::Regular { .. }) {
            bail!(WrongUsage("--preserve-times needs files as input and output".into()));
        }
        times(source)
    }

    /// Writes the whole result, and gives it these times if it is a regular file.
    pub(crate) fn write(&self, bytes: &[u8], times: Option<FileTimes>) -> Result<()> {
        match self {
            Self::Standard => {
                let mut stdout = io::stdout().lock();
                let written = stdout.write_all(bytes).and_then(|()| stdout.flush());
                unless_closed(written).context("standard output")
            }
            Self::Special(path) => OpenOptions::new()
                .write(true)
                .open(path)
                .and_then(|mut file| file.write_all(bytes))
                .with_context(|| output_name(path)),
            Self::Regular { path, directory } => {
                let write = |file: &mut File| {
                    file.write_all(bytes)?;
                    Ok(times.map_or(Ok(()), |times| file.set_times(times))?)
                };
                replace(path, directory, write).map(|_| ()).with_context(|| output_name(path))
            }
        }
    }
}

/// Writes a temporary file next to `path` and renames it. Returns the file, to be written further.
pub(crate) fn replace(
    path: &Path,
    directory: &Path,
    write: impl FnOnce(&mut File) -> Result<()>,
) -> Result<File> {
    let mut file = temporary(directory)?;
    if let Ok(existing) = fs::metadata(path) {
        file.as_file().set_permissions(existing.permissions())?;
    }
    write(file.as_file_mut())?;
    file.as_file().sync_all()?;
    let file = file.persist(path)?;
    // Only temporary files are locked.
    let _ = file.unlock();
    Ok(file)
}

/// Makes a temporary file, which is removed when it is dropped. It is locked, which tells
/// [`remove_leftovers`] that it is in use: a lock ends with its process, however that ends.
fn temporary(directory: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(TEMPORARY.0).suffix(TEMPORARY.1).rand_bytes(TEMPORARY_RANDOM);
    // By default, temporary files are private; this one gets the permissions of a new file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let file = builder.tempfile_in(directory)?;
    // Where there are no locks, no file is taken for a leftover.
    let _ = file.as_file().try_lock();
    Ok(file)
}

/// Removes the temporary files in a directory whose processes were killed. What cannot be removed
/// stays.
pub(crate) fn remove_leftovers(directory: &Path) {
    let Ok(entries) = fs::read_dir(directory) else { return };
    for entry in entries.flatten() {
        if !is_temporary(&entry.file_name()) || !entry.file_type().is_ok_and(|kind| kind.is_file())
        {
            continue;
        }
        let file = OpenOptions::new().write(true).open(entry.path());
        if file.is_ok_and(|file| file.try_lock().is_ok()) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Whether [`temporary`] gives such names.
fn is_temporary(name: &OsStr) -> bool {
    let random = |name: &str| {
        let random = name.strip_prefix(TEMPORARY.0)?.strip_suffix(TEMPORARY.1)?;
        Some(random.len() == TEMPORARY_RANDOM && random.chars().all(|c| c.is_ascii_alphanumeric()))
    };
    name.to_str().and_then(random).unwrap_or(false)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ordinary_paths_are_their_own_text() {
        for path in ["", "in/a b%20\\xFF.png", "Grüße/写真.jpg", "in\n/\u{10FFFF}"] {
            assert_eq!(unique_text(Path::new(path)), path);
        }
    }

    #[test]
    fn a_replacement_character_is_told_from_what_it_stands_for() {
        assert_eq!(unique_text(Path::new("a\u{FFFD}.png")), "a\u{FFFD}EF\u{FFFD}BF\u{FFFD}BD.png");
    }

    #[test]
    #[cfg(unix)]
    fn bytes_that_are_not_utf8_keep_their_values() {
        use std::os::unix::ffi::OsStrExt;
        let text = |bytes: &[u8]| unique_text(Path::new(OsStr::from_bytes(bytes)));
        assert_eq!(text(b"\xFFa\xFE\xED\xA0\x80"), "�FFa�FE�ED�A0�80");
        assert_eq!(text(b"caf\xE9/\xC3\xA9\xC3"), "caf�E9/é�C3");
    }

    #[test]
    #[cfg(windows)]
    fn unpaired_surrogates_keep_their_values() {
        use std::os::windows::ffi::OsStringExt;
        let name = std::ffi::OsString::from_wide(&[0x61, 0xD800, 0x62]);
        assert_eq!(unique_text(Path::new(&name)), "a�ED�A0�80b");
    }
}
