//! The run of a batch, from its arguments to its exit status.

use std::fs;
use std::path::Path;
use std::process::ExitCode;
use std::sync::OnceLock;
use std::sync::atomic::Ordering;
use std::thread;
use std::time::Instant;

use anyhow::{Context, Result, bail};

use super::age;
use super::budget::Budget;
use super::failure::{catch_panic, is_cancelled};
use super::inputs::{self, Item};
use super::manifest::{self, Manifest, Record, Written};
use super::outputs::{self, Plan};
use super::selection::Selection;
use super::shards;
use super::stop::{self, Stop};
use super::task::{Facts, Task};
use super::work::{Batch, Tally, bar};
use super::workers;
use crate::args;
use crate::errors::{SOME_FAILED, WrongUsage};
use crate::files::{self, Output};

/// The budget of one job by default, in pixels.
const PIXELS_PER_JOB: u64 = 16_000_000;

pub(crate) fn run(args: &args::Batch) -> Result<ExitCode> {
    let start = Instant::now();
    let task = Task::new(args)?;
    let selection = Selection::new(&args.include, &args.exclude)?;
    if args.shards.is_some() && args.keep.preserve_times {
        bail!(WrongUsage("--preserve-times needs a file per picture, and not --shards".into()));
    }
    let output = |below: &Path| {
        let name = if args.shards.is_some() { &shards::member(below) } else { below };
        args.out.join(name).with_extension(task.extension())
    };
    let (items, rest) = inputs::find(&args.inputs, &selection, |path| task.kind(path), output)?;
    let Plan { mut items, mut folders } = Plan::new(items, args.manifest.as_deref())?;
    if let Some(each) = args.shards {
        shards::assign(&mut items, &args.out, each as usize);
        if !items.is_empty() {
            shards::check_last(&args.out, items.len().div_ceil(each as usize))?;
        }
        folders = [args.out.clone()].into();
    }
    args.manifest.as_deref().map_or(Ok(()), manifest::check)?;
    let jobs = match args.jobs {
        Some(jobs) => usize::from(jobs),
        None => thread::available_parallelism().map_or(1, usize::from),
    };
    let pixels = match args.budget {
        Some(megapixels) => (megapixels * 1e6) as u64,
        None => PIXELS_PER_JOB * jobs as u64,
    };
    let (budget, stop) = (Budget::new(pixels), Stop::on_signals()?);
    let preserve_times = args.keep.preserve_times;
    let batch = Batch { task, items, rest, preserve_times, jobs, budget, stop };

    let skipped = match args.shards {
        _ if !args.resume => vec![None; batch.items.len()],
        None => batch.up_to_date()?,
        Some(_) => batch.up_to_date_shards(&args.out),
    };
    // A .gip file is a result, but a picture may be an original.
    if matches!(batch.task, Task::Decode { .. }) && !batch.stop.is_asked_for() {
        let earlier = args.manifest.as_deref().map(Written::read).unwrap_or_default();
        outputs::protect(batch.todo(&skipped), &batch.rest.folders, &earlier)?;
    }
    fs::create_dir_all(&args.out).with_context(|| args.out.display().to_string())?;
    for folder in &folders {
        files::remove_leftovers(folder);
    }
    batch.tell_rest();
    let mut tally = Tally::default();
    // The manifest that is there needs all that was found out about the files that are skipped.
    if !batch.stop.is_asked_for() {
        let begin = |path| Manifest::begin(path, &batch.items, &skipped, &batch.rest, args.resume);
        let manifest = args.manifest.as_deref().map(begin).transpose()?;
        tally = match args.shards {
            None => batch.work(&skipped, manifest.as_ref())?,
            Some(_) => batch.work_on_shards(&args.out, &skipped, manifest.as_ref())?,
        };
    }
    files::print(&batch.summary(&skipped, &tally, start), args.manifest.as_deref())?;
    Ok(ExitCode::from(match batch.stop.signal() {
        Some(signal) => stop::end_by(signal),
        None if tally.failed.into_inner() > 0 || !batch.rest.failed.is_empty() => SOME_FAILED,
        None => 0,
    }))
}

impl Batch {
    /// Tells what will not be done.
    fn tell_rest(&self) {
        for line in self.rest.left_out.lines() {
            files::tell(&line);
        }
        for error in self.rest.failed.values() {
            files::tell(&format!("error: {error}"));
        }
    }

    /// For each file whose result is whole and newer than the file, what the result tells.
    fn up_to_date(&self) -> Result<Vec<Option<Facts>>> {
        let found: Vec<OnceLock<Facts>> = self.items.iter().map(|_| OnceLock::new()).collect();
        let bar = bar(self.items.len())?.with_message("checking");
        workers::for_each(self.jobs, self.items.len(), &self.stop, |index| {
            let item = &self.items[index];
            let inspect = || self.task.inspect(&item.output, &self.budget);
            if age::is_new(&item.output, &item.source, self.preserve_times)
                && let Ok(facts) = catch_panic(item, inspect)
            {
                let _ = found[index].set(facts);
            }
            bar.inc(1);
        });
        bar.finish_and_clear();
        Ok(found.into_iter().map(OnceLock::into_inner).collect())
    }

    /// What is not skipped.
    fn todo(&self, skipped: &[Option<Facts>]) -> impl Iterator<Item = &Item> + Clone {
        let items = self.items.iter().zip(skipped);
        items.filter_map(|(item, facts)| facts.is_none().then_some(item))
    }

    /// Does all that is not skipped.
    ///
    /// # Errors
    /// When the manifest cannot be written. What fails with a file is told, and counted.
    fn work(&self, skipped: &[Option<Facts>], manifest: Option<&Manifest>) -> Result<Tally> {
        let (tally, fatal) = (Tally::default(), OnceLock::new());
        let todo: Vec<&Item> = self.todo(skipped).collect();
        let bar = bar(todo.len())?;
        workers::for_each(self.jobs, todo.len(), &self.stop, |index| {
            let item = todo[index];
            let record = match catch_panic(item, || self.result(item)) {
                Ok(facts) => {
                    bar.suspend(|| files::warn(&item.source, &facts.warnings));
                    tally.written.fetch_add(1, Ordering::Relaxed);
                    tally.bytes.fetch_add(facts.bytes.unwrap_or(0), Ordering::Relaxed);
                    Record::written(item, facts)
                }
                Err(error) if is_cancelled(&error) => return,
                Err(error) => {
                    let line = self.tell(&error, &tally, &bar);
                    let failed = tally.failed.fetch_add(1, Ordering::Relaxed) + 1;
                    bar.set_message(format!("{failed} failed"));
                    Record::failed(item, line)
                }
            };
            if let Some(Err(error)) = manifest.map(|manifest| manifest.add(&record)) {
                let _ = fatal.set(error);
                self.stop.halt();
            }
            bar.inc(1);
        });
        bar.finish_and_clear();
        fatal.into_inner().map_or(Ok(tally), Err)
    }

    /// Makes the result of one file.
    fn result(&self, item: &Item) -> Result<Facts> {
        let times = self.preserve_times.then(|| files::times(&item.source)).transpose()?;
        let (bytes, facts) = self.bytes(item)?;
        if let Some(folder) = item.output.parent() {
            fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        }
        Output::new(&item.output)?.write(&bytes, times)?;
        Ok(facts)
    }

    /// The last words.
    fn summary(&self, skipped: &[Option<Facts>], tally: &Tally, start: Instant) -> String {
        let all = self.items.len() + self.rest.failed.len();
        let skipped = skipped.iter().flatten().count();
        let [written, failed] = [&tally.written, &tally.failed].map(|n| n.load(Ordering::Relaxed));
        let failed = failed + self.rest.failed.len();
        let left = all - written - skipped - failed;
        let bytes = tally.bytes.load(Ordering::Relaxed);
        let seconds = start.elapsed().as_secs_f64();
        let files = if all == 1 { "file" } else { "files" };
        let mut text = format!(
            "{all} {files}: {written} written, {skipped} skipped, {failed} failed, {left} left; {bytes} \
             bytes, {seconds:.1} s"
        );
        if all == 0 {
            text.push_str("\nnote: the folders have no files of the formats that are read");
        } else if left > 0 {
            let full = tally.is_disk_full.load(Ordering::Relaxed);
            let why = if full { "the disk is full" } else { "interrupted" };
            text.push_str(&format!("\nnote: {why}; the same command with --resume does the rest"));
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::super::inputs::Rest;
    use super::*;
    use crate::source::Reading;
    use image_gip::{Limits, RenderOptions};

    #[test]
    #[cfg(unix)]
    fn a_source_that_changes_while_it_is_read_has_no_result() {
        let room = tempfile::tempdir().expect("a place for temporary files");
        let reading = Reading { limits: Limits::default(), allow_partial: false };
        let extension = "png".into();
        let options = RenderOptions::new();
        let task = Task::Decode { extension, reading, options, bounds: None, policy: None };
        let (budget, stop) = (Budget::new(1), Stop::default());
        let (items, rest, preserve_times) = (Vec::new(), Rest::default(), false);
        let batch = Batch { task, items, rest, preserve_times, jobs: 1, budget, stop };
        let item = |name: &str| Item {
            source: room.path().join(name),
            output: room.path().join("out").join(name).with_extension("png"),
        };
        let (still, changing) = (item("still.gip"), item("changing.gip"));
        let file = image_gip::encode(8, 8, image_gip::ColorModel::Gray, &[9; 64]).expect("encoded");
        fs::write(&still.source, &file).expect("writable");
        batch.result(&still).expect("a sound file");
        assert!(still.output.is_file());

        // The time of a pipe changes when something is written to it.
        let script = "mkfifo changing.gip && touch -t 200001010000 changing.gip";
        let mut shell = std::process::Command::new("sh");
        let made = shell.args(["-c", script]).current_dir(room.path()).status();
        assert!(made.expect("there is a shell").success());
        let result = thread::scope(|scope| {
            scope.spawn(|| fs::write(&changing.source, &file).expect("it is read"));
            batch.result(&changing)
        });
        let error = result.expect_err("it changed").to_string();
        assert!(error.contains("changing.gip: the file changed"), "{error}");
        assert!(!changing.output.exists());
    }
}
