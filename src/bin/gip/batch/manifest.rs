//! The manifest: a line of JSON for every file.

use core::mem;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::fs::{File, Metadata, OpenOptions};
use std::io::{self, BufRead, BufReader, BufWriter, ErrorKind, Read, Write};
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::SystemTime;

use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};

use super::inputs::{Item, Rest};
use super::task::Facts;
use crate::files::{self, Output};

/// A line.
#[derive(Debug, Serialize)]
pub(crate) struct Record {
    input: String,
    output: Option<String>,
    status: Status,
    input_bytes: Option<u64>,
    #[serde(flatten)]
    facts: Facts,
    error: Option<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Status {
    Written,
    Skipped,
    Failed,
    Ignored,
}

impl Record {
    pub(crate) fn written(item: &Item, facts: Facts) -> Self {
        Self::new(item, Status::Written, facts, None)
    }

    fn skipped(item: &Item, facts: Facts) -> Self {
        Self::new(item, Status::Skipped, facts, None)
    }

    pub(crate) fn failed(item: &Item, error: String) -> Self {
        Self::new(item, Status::Failed, Facts::default(), Some(error))
    }

    /// A picture of a format that is not read.
    fn ignored(source: &Path) -> Self {
        let error = format!("{}: pictures of this format are not read", source.display());
        Self::without_output(source, Status::Ignored, error)
    }

    fn without_output(source: &Path, status: Status, error: String) -> Self {
        let file = source.metadata().ok().filter(Metadata::is_file);
        Self {
            input: files::unique_text(source),
            output: None,
            status,
            input_bytes: file.map(|metadata| metadata.len()),
            facts: Facts::default(),
            error: Some(error),
        }
    }

    fn new(item: &Item, status: Status, facts: Facts, error: Option<String>) -> Self {
        Self {
            input: files::unique_text(&item.source),
            output: Some(files::unique_text(&item.output)),
            status,
            input_bytes: item.source.metadata().ok().map(|metadata| metadata.len()),
            facts,
            error,
        }
    }
}

/// What is read of a line.
#[derive(Debug, Deserialize)]
struct Known {
    input: String,
    output: Option<String>,
    status: Status,
    bytes: Option<u64>,
}

/// How every line begins.
const START: &[u8] = b"{\"input\":";
/// Most bytes of the first line of a manifest: a longer one is something else.
const MAX_FIRST_LINE: u64 = 1 << 20;

/// Refuses to replace a file that is no manifest. One without a whole line may be of a run that was killed.
pub(crate) fn check(path: &Path) -> Result<()> {
    if files::is_standard_stream(path) || !path.is_file() {
        return Ok(());
    }
    let read = || -> io::Result<Vec<u8>> {
        let mut line = Vec::new();
        let file = File::open(path)?.take(MAX_FIRST_LINE);
        BufReader::new(file).read_until(b'\n', &mut line)?;
        Ok(line)
    };
    let line = read().with_context(|| path.display().to_string())?;
    let is_known = if line.ends_with(b"\n") {
        serde_json::from_slice::<Known>(&line).is_ok()
    } else {
        line.starts_with(START) || START.starts_with(&line)
    };
    if !is_known {
        let name = path.display();
        bail!("{name}: line 1 is not one of a manifest of gip batch, so the file is not replaced");
    }
    Ok(())
}

/// The results that an earlier run wrote, as its manifest says, and that nobody has changed since: each by
/// its name, with its bytes.
#[derive(Debug, Default)]
pub(crate) struct Written {
    results: HashMap<String, u64>,
    /// When the manifest got its last line.
    end: Option<SystemTime>,
}

impl Written {
    /// `path` has passed [`check`]. What cannot be read tells of no result.
    pub(crate) fn read(path: &Path) -> Self {
        let mut written = Self::default();
        let file = (!files::is_standard_stream(path) && path.is_file()).then(|| File::open(path));
        let Some(Ok(file)) = file else { return written };
        written.end = file.metadata().and_then(|metadata| metadata.modified()).ok();
        for line in BufReader::new(file).lines().map_while(Result::ok) {
            let Ok(known) = serde_json::from_str::<Known>(&line) else { continue };
            let Some(output) = known.output else { continue };
            match (known.status, known.bytes) {
                (Status::Written | Status::Skipped, Some(bytes)) => {
                    written.results.insert(output, bytes)
                }
                _ => written.results.remove(&output),
            };
        }
        written
    }

    pub(crate) fn includes(&self, output: &Path) -> bool {
        let Ok(metadata) = output.metadata() else { return false };
        self.results.get(&files::unique_text(output)) == Some(&metadata.len())
            && metadata.modified().ok().is_some_and(|time| Some(time) <= self.end)
    }
}

/// The manifest that is being written.
pub(crate) struct Manifest {
    name: String,
    file: Mutex<Box<dyn Write + Send>>,
}

impl Manifest {
    /// Begins a manifest with the lines of the files that are skipped, for each of which there are
    /// facts, and of the rest of what was found. With `resume`, they and the lines of unknown files are taken from the manifest that is
    /// there, which is unchanged if this fails.
    pub(crate) fn begin(
        path: &Path,
        items: &[Item],
        skipped: &[Option<Facts>],
        rest: &Rest,
        resume: bool,
    ) -> Result<Self> {
        let name = files::output_name(path);
        let begin = |file: &mut dyn Write, old: Option<File>| -> Result<()> {
            let mut file = BufWriter::new(file);
            let mut lines = Lines::new(items, skipped, rest);
            if let Some(old) = old {
                lines.copy(BufReader::new(old), &mut file)?;
            }
            lines.add_missing(&mut file)?;
            Ok(file.flush()?)
        };
        let file: Result<Box<dyn Write + Send>> = match Output::new(path)? {
            Output::Standard => {
                begin(&mut io::stdout(), None).map(|()| Box::new(io::stdout()) as _)
            }
            Output::Special(path) => {
                let mut file = OpenOptions::new().write(true).open(path)?;
                begin(&mut file, None).map(|()| Box::new(file) as _)
            }
            Output::Regular { path, directory } => {
                let old = match File::open(&path) {
                    Ok(old) if resume => Some(old),
                    Err(error) if resume && error.kind() != ErrorKind::NotFound => {
                        return Err(error).context(name);
                    }
                    _ => None,
                };
                files::replace(&path, &directory, |file| begin(file, old))
                    .map(|file| Box::new(file) as _)
            }
        };
        Ok(Self { file: Mutex::new(file.with_context(|| name.clone())?), name })
    }

    /// Adds a line.
    pub(crate) fn add(&self, record: &Record) -> Result<()> {
        let mut line = serde_json::to_vec(record)?;
        line.push(b'\n');
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.write_all(&line).and_then(|()| file.flush()).with_context(|| self.name.clone())
    }
}

/// The lines that a manifest begins with.
struct Lines<'a> {
    items: &'a [Item],
    skipped: &'a [Option<Facts>],
    /// The number of each file, by the name of its result.
    numbers: HashMap<String, usize>,
    /// The results that have a line.
    added: HashSet<String>,
    /// Lines of what has no result, by its name, and whether they are there.
    others: BTreeMap<String, (Record, bool)>,
    /// All that was found: what is said of it there holds no longer.
    inputs: HashSet<String>,
}

impl<'a> Lines<'a> {
    fn new(items: &'a [Item], skipped: &'a [Option<Facts>], rest: &Rest) -> Self {
        let output = |item: &Item| files::unique_text(&item.output);
        let numbers = items.iter().map(output).zip(0..).collect();
        let ignored = rest.left_out.pictures.iter().map(|path| Record::ignored(path));
        let failed = rest
            .failed
            .iter()
            .map(|(path, error)| Record::without_output(path, Status::Failed, error.clone()));
        let others = ignored.chain(failed).map(|record| (record.input.clone(), (record, false)));
        let sources = items.iter().map(|item| &item.source);
        let inputs = sources.chain(&rest.folders).map(|path| files::unique_text(path)).collect();
        Self { items, skipped, numbers, added: HashSet::new(), others: others.collect(), inputs }
    }

    /// Copies the lines of an earlier manifest that still hold.
    fn copy(&mut self, mut old: impl BufRead, file: &mut impl Write) -> Result<()> {
        let mut line = Vec::new();
        for number in 1.. {
            line.clear();
            old.read_until(b'\n', &mut line)?;
            // A last line without an end is one that was not written completely.
            if !line.ends_with(b"\n") {
                break;
            }
            let known: Known = serde_json::from_slice(&line)
                .with_context(|| format!("line {number} is not one of a manifest of gip batch"))?;
            if self.keeps(known) {
                file.write_all(&line)?;
            }
        }
        Ok(())
    }

    /// Whether what a line says is still so, and new. This is not known about files of other runs.
    fn keeps(&mut self, known: Known) -> bool {
        if let Some((record, is_there)) = self.others.get_mut(&known.input) {
            let statuses = [known.status, record.status];
            return statuses == [Status::Ignored; 2] && !mem::replace(is_there, true);
        }
        let Some(output) = known.output else { return !self.inputs.contains(&known.input) };
        let holds = match self.numbers.get(&output) {
            None => true,
            Some(&number) => self.skipped[number].as_ref().is_some_and(|facts| {
                known.status != Status::Failed
                    && known.bytes == facts.bytes
                    && known.input == files::unique_text(&self.items[number].source)
            }),
        };
        holds && self.added.insert(output)
    }

    /// Writes a line for every skipped file and for all else that has none.
    fn add_missing(&self, file: &mut impl Write) -> Result<()> {
        let mut add = |record: &Record| -> Result<()> {
            serde_json::to_writer(&mut *file, record)?;
            Ok(file.write_all(b"\n")?)
        };
        for (item, facts) in self.items.iter().zip(self.skipped) {
            let Some(facts) = facts else { continue };
            if !self.added.contains(&files::unique_text(&item.output)) {
                add(&Record::skipped(item, facts.clone()))?;
            }
        }
        self.others
            .values()
            .filter(|(_, is_there)| !is_there)
            .try_for_each(|(record, _)| add(record))
    }
}
