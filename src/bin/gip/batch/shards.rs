//! Shards: tar files that many results are written to.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufReader, BufWriter};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::Ordering;

use anyhow::{Context, Result, bail};

use super::age;
use super::failure::{catch_panic, is_cancelled};
use super::inputs::Item;
use super::left_out::listed;
use super::manifest::{Manifest, Record};
use super::tar::{self, TarWriter};
use super::task::Facts;
use super::work::{Batch, Tally, bar};
use super::workers;
use crate::errors::WrongUsage;
use crate::files;

/// The path of a result below the folder of the results, as the key that a member is named by: what follows the
/// first dot of a member's name is its format.
pub(super) fn member(below: &Path) -> PathBuf {
    let stem = below.file_stem().unwrap_or_default().to_string_lossy().replace('.', "_");
    below.with_file_name(stem)
}

/// Makes members of the shards out of single results: of so many that follow each other, `OUT/000000.tar/KEY.gip` and so
/// on.
pub(super) fn assign(items: &mut [Item], out: &Path, each: usize) {
    for (number, item) in items.iter_mut().enumerate() {
        let below = item.output.strip_prefix(out).unwrap_or(&item.output);
        item.output = out.join(name_of(number / each)).join(below);
    }
}

/// Refuses a folder that has shards beyond the `count` of this run, such as those of an earlier one with fewer pictures
/// each: who reads the folder would take them for a part of the result.
pub(super) fn check_last(out: &Path, count: usize) -> Result<()> {
    let Ok(entries) = fs::read_dir(out) else { return Ok(()) };
    let is_beyond = |name: &str| {
        let number = name.strip_suffix(".tar").and_then(|number| number.parse::<usize>().ok());
        number.is_some_and(|number| number >= count && name == name_of(number))
    };
    let names = entries.flatten().filter_map(|entry| entry.file_name().into_string().ok());
    let mut beyond: Vec<_> = names.filter(|name| is_beyond(name)).collect();
    if beyond.is_empty() {
        return Ok(());
    }
    beyond.sort();
    let (out, found) = (out.display(), listed(beyond.iter().cloned(), beyond.len()));
    bail!(WrongUsage(format!(
        "{out} has shards of another run, beyond the last one of this run, which is {}: {found}; remove them, or take \
         another folder for --out",
        name_of(count - 1)
    )))
}

/// The name of a shard.
fn name_of(number: usize) -> String {
    format!("{number:06}.tar")
}

/// A tar file that results are written to.
struct Shard<'a> {
    path: PathBuf,
    /// The numbers of the files, and their names as members.
    members: Vec<(usize, &'a Item, String)>,
}

impl Batch {
    /// The shards, in order.
    fn shards(&self, out: &Path) -> Vec<Shard<'_>> {
        let mut shards: BTreeMap<PathBuf, Vec<_>> = BTreeMap::new();
        for (number, item) in self.items.iter().enumerate() {
            let below = item.output.strip_prefix(out).unwrap_or(&item.output);
            let mut parts = below.components();
            let shard = parts.next().map_or_else(PathBuf::new, |part| out.join(part));
            // Tar has slashes on every system.
            let parts: Vec<_> = parts.map(|part| part.as_os_str().to_string_lossy()).collect();
            shards.entry(shard).or_default().push((number, item, parts.join("/")));
        }
        shards.into_iter().map(|(path, members)| Shard { path, members }).collect()
    }

    /// For each file whose shard has all of its pictures, and is newer than they are, the bytes of the member.
    pub(super) fn up_to_date_shards(&self, out: &Path) -> Vec<Option<Facts>> {
        let mut found = vec![None; self.items.len()];
        for shard in self.shards(out) {
            let is_new = |item: &Item| age::is_new(&shard.path, &item.source, false);
            let Ok(file) = File::open(&shard.path) else { continue };
            let Ok(there) = tar::members(BufReader::new(file)) else { continue };
            let is_it = |(member, item): (&(String, u64), &(usize, &Item, String))| {
                member.0 == item.2 && is_new(item.1)
            };
            if there.len() == shard.members.len() && there.iter().zip(&shard.members).all(is_it) {
                for ((_, bytes), (number, ..)) in there.iter().zip(&shard.members) {
                    found[*number] = Some(Facts::of_size(*bytes));
                }
            }
        }
        found
    }

    /// Makes all shards that are not skipped, each on one thread.
    ///
    /// # Errors
    /// When the manifest cannot be written. What fails with a file is told, and counted.
    pub(super) fn work_on_shards(
        &self,
        out: &Path,
        skipped: &[Option<Facts>],
        manifest: Option<&Manifest>,
    ) -> Result<Tally> {
        let (tally, fatal) = (Tally::default(), OnceLock::new());
        let is_missing = |shard: &Shard<'_>| skipped[shard.members[0].0].is_none();
        let shards: Vec<_> = self.shards(out).into_iter().filter(is_missing).collect();
        let progress = bar(shards.iter().map(|shard| shard.members.len()).sum())?;
        let tell = |error: &anyhow::Error| self.tell(error, &tally, &progress);
        workers::for_each(self.jobs, shards.len(), &self.stop, |index| {
            let shard = &shards[index];
            let (mut written, mut failed) = (Vec::new(), Vec::new());
            let done = files::replace(&shard.path, out, |file| {
                let mut tar = TarWriter::new(BufWriter::new(file));
                for (_, item, name) in &shard.members {
                    match catch_panic(item, || self.bytes(item)) {
                        Ok((bytes, facts)) => {
                            progress.suspend(|| files::warn(&item.source, &facts.warnings));
                            tar.add(name, &bytes)?;
                            written.push((*item, facts));
                        }
                        Err(error) if is_cancelled(&error) => return Err(error),
                        Err(error) => failed.push((*item, tell(&error))),
                    }
                    progress.inc(1);
                }
                if written.is_empty() {
                    bail!("none of its pictures could be read");
                }
                tar.finish()?;
                Ok(())
            });
            if let Err(error) = done.with_context(|| shard.path.display().to_string()) {
                if is_cancelled(&error) {
                    return;
                }
                let line = tell(&error);
                failed.extend(written.drain(..).map(|(item, _)| (item, line.clone())));
            }
            tally.failed.fetch_add(failed.len(), Ordering::Relaxed);
            tally.written.fetch_add(written.len(), Ordering::Relaxed);
            let bytes = written.iter().filter_map(|(_, facts)| facts.bytes).sum();
            tally.bytes.fetch_add(bytes, Ordering::Relaxed);
            let written = written.into_iter().map(|(item, facts)| Record::written(item, facts));
            let failed = failed.into_iter().map(|(item, line)| Record::failed(item, line));
            for record in written.chain(failed) {
                if let Some(Err(error)) = manifest.map(|manifest| manifest.add(&record)) {
                    let _ = fatal.set(error);
                    self.stop.halt();
                }
            }
        });
        progress.finish_and_clear();
        fatal.into_inner().map_or(Ok(tally), Err)
    }
}
