//! What a batch works on, and what has been done.

use core::fmt;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;

use anyhow::{Context, Error, Result, bail};
use indicatif::{ProgressBar, ProgressState, ProgressStyle};

use super::age;
use super::budget::Budget;
use super::failure::is_disk_full;
use super::inputs::{Item, Rest};
use super::stop::Stop;
use super::task::{Facts, Task};
use crate::errors::one_line;
use crate::files;

/// What is done, to which files, and how many of them at the same time.
pub(super) struct Batch {
    pub(super) task: Task,
    pub(super) items: Vec<Item>,
    pub(super) rest: Rest,
    /// Whether results get the times of their sources.
    pub(super) preserve_times: bool,
    pub(super) jobs: usize,
    pub(super) budget: Budget,
    pub(super) stop: Stop,
}

/// What has been done.
#[derive(Debug, Default)]
pub(super) struct Tally {
    pub(super) written: AtomicUsize,
    pub(super) bytes: AtomicU64,
    pub(super) failed: AtomicUsize,
    pub(super) is_disk_full: AtomicBool,
}

impl Batch {
    /// Makes the bytes of the result of one file.
    pub(super) fn bytes(&self, item: &Item) -> Result<(Vec<u8>, Facts)> {
        let stamp = || age::stamp(&item.source).with_context(|| item.source.display().to_string());
        let before = stamp()?;
        let made = self.task.perform(item, &self.budget, &self.stop)?;
        // The result will be newer, and would never be made again.
        if stamp()? != before {
            bail!("{}: the file changed while it was worked on", item.source.display());
        }
        Ok(made)
    }

    /// Tells why something failed, and stops when the disk is full. Returns the line that was told.
    pub(super) fn tell(&self, error: &Error, tally: &Tally, bar: &ProgressBar) -> String {
        if is_disk_full(error) {
            tally.is_disk_full.store(true, Ordering::Relaxed);
            self.stop.halt();
        }
        let line = one_line(error);
        bar.suspend(|| files::tell(&format!("error: {line}")));
        line
    }
}

/// A progress bar, which is visible on a terminal only.
pub(super) fn bar(length: usize) -> Result<ProgressBar> {
    let template = "{bar:40} {pos}/{len}  {rate}  {eta} left  {msg}";
    let style = ProgressStyle::with_template(template)?;
    let style = style.with_key("rate", |state: &ProgressState, out: &mut dyn fmt::Write| {
        _ = write!(out, "{:.2} files/s", state.per_sec());
    });
    let bar = ProgressBar::new(length as u64).with_style(style);
    if !bar.is_hidden() {
        bar.enable_steady_tick(Duration::from_millis(500));
    }
    Ok(bar)
}
