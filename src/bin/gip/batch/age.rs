//! Whether a result is that of its source as it is.

use std::fs;
use std::io;
use std::path::Path;
use std::time::{Duration, SystemTime};

/// In how many nanoseconds file systems count. One that counts in larger steps rounds down.
const STEPS: [u128; 6] = [1, 100, 1_000, 1_000_000, 1_000_000_000, 2_000_000_000];

/// Size and time of a file, which tell whether it changed.
pub(super) fn stamp(path: &Path) -> io::Result<(u64, Option<SystemTime>)> {
    let metadata = fs::metadata(path)?;
    Ok((metadata.len(), metadata.modified().ok()))
}

/// Whether a result is newer than its source, or as old, if it was to get the source's time.
pub(super) fn is_new(output: &Path, source: &Path, preserve_times: bool) -> bool {
    let modified = |path| fs::metadata(path).and_then(|metadata| metadata.modified());
    let (Ok(output), Ok(source)) = (modified(output), modified(source)) else { return false };
    output > source || preserve_times && is_kept(output, source)
}

/// Whether a time is what a file system makes of another.
fn is_kept(kept: SystemTime, time: SystemTime) -> bool {
    let Ok(since) = time.duration_since(SystemTime::UNIX_EPOCH) else { return kept == time };
    STEPS.into_iter().any(|step| {
        let rest = (since.as_nanos() % step) as u64;
        time.checked_sub(Duration::from_nanos(rest)) == Some(kept)
    })
}
