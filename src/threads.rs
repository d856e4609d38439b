//! Work on this thread alone, or also on others of the current `rayon` pool.

use alloc::vec::Vec;
#[cfg(feature = "rayon")]
use core::sync::atomic::{AtomicUsize, Ordering};

#[cfg(feature = "rayon")]
use rayon::iter::plumbing::{Folder, Reducer, UnindexedConsumer};
#[cfg(feature = "rayon")]
use rayon::iter::{ParallelExtend, ParallelIterator};

/// How many threads [`for_each`] uses at most.
pub(crate) fn count(parallel: bool) -> usize {
    #[cfg(feature = "rayon")]
    if parallel {
        return rayon::current_num_threads();
    }
    let _ = parallel;
    1
}

/// Runs `work` on every item, on this thread and, if asked for, on others of the current pool; each
/// lends its memory from one item to the next.
pub(crate) fn for_each<M: Default, T: Send>(
    parallel: bool,
    items: Vec<T>,
    work: impl Fn(&mut M, T) + Send + Sync,
) {
    #[cfg(feature = "rayon")]
    if parallel && items.len() > 1 {
        on_threads(items, work);
        return;
    }
    let _ = parallel;
    let mut memory = M::default();
    items.into_iter().for_each(|item| work(&mut memory, item));
}

/// What `work` makes of every item, in their order.
pub(crate) fn map<T: Send, R: Send>(
    parallel: bool,
    items: impl Iterator<Item = T>,
    work: impl Fn(T) -> R + Send + Sync,
) -> Vec<R> {
    let items: Vec<T> = items.collect();
    let mut results: Vec<Option<R>> = items.iter().map(|_| None).collect();
    let items = items.into_iter().zip(&mut results).collect();
    for_each(parallel, items, |(): &mut (), (item, result)| *result = Some(work(item)));
    results.into_iter().map(|result| result.expect("every item was worked on")).collect()
}

/// Fewest copies that are shared among threads.
#[cfg(feature = "rayon")]
const LEAST_SHARED: usize = 2048;

/// Adds copies of a value to a vector. Every thread adds some: memory that is new, or in the cache of
/// another core, takes a single one long to write to.
pub(crate) fn extend<T: Copy + Send + Sync>(
    parallel: bool,
    items: &mut Vec<T>,
    value: T,
    count: usize,
) {
    #[cfg(feature = "rayon")]
    if parallel && count >= LEAST_SHARED {
        items.par_extend(Copies { value, count });
        return;
    }
    let _ = parallel;
    items.resize(items.len() + count, value);
}

/// Copies of a value, for `rayon` to put in their places: without `unsafe`, it alone can let several
/// threads write to memory that holds nothing yet.
#[cfg(feature = "rayon")]
struct Copies<T> {
    value: T,
    count: usize,
}

#[cfg(feature = "rayon")]
impl<T: Copy + Send + Sync> ParallelIterator for Copies<T> {
    type Item = T;

    fn opt_len(&self) -> Option<usize> {
        Some(self.count)
    }

    fn drive_unindexed<C: UnindexedConsumer<T>>(self, consumer: C) -> C::Result {
        let Self { value, count } = self;
        let (mut rest, mut left) = (consumer, count);
        let (mut parts, mut reducers) = (Vec::new(), Vec::new());
        for threads in (1..=self::count(true)).rev() {
            let length = left.div_ceil(threads);
            let (part, others, reducer) = rest.split_at(length);
            (rest, left) = (others, left - length);
            parts.push((part, length));
            reducers.push(reducer);
        }
        let results = map(true, parts.into_iter(), |(part, length)| {
            part.into_folder().consume_iter(core::iter::repeat_n(value, length)).complete()
        });
        let nothing = rest.into_folder().complete();
        let all = results.into_iter().zip(reducers);
        all.rfold(nothing, |others, (result, reducer)| reducer.reduce(result, others))
    }
}

/// How often a thread asks whether the others are done before it falls asleep: some milliseconds.
#[cfg(feature = "rayon")]
const PATIENCE: u32 = 10_000;

/// A thread that is expected to work; it is done when this is dropped.
#[cfg(feature = "rayon")]
struct Expected<'a>(&'a AtomicUsize);

#[cfg(feature = "rayon")]
impl Drop for Expected<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Wakes up a thread of the current pool for work that is about to come: that takes as long as some
/// of the work does.
#[cfg(feature = "std")]
pub(crate) fn wake(parallel: bool) {
    #[cfg(feature = "rayon")]
    if count(parallel) > 1 {
        rayon::spawn(|| ());
    }
    let _ = parallel;
}

#[cfg(feature = "rayon")]
fn on_threads<M: Default, T: Send>(items: Vec<T>, work: impl Fn(&mut M, T) + Send + Sync) {
    let others = count(true).min(items.len()).saturating_sub(1);
    let items = std::sync::Mutex::new(items.into_iter());
    let next = || items.lock().expect("taking an item does not panic").next();
    let expected = AtomicUsize::new(others + 1);
    let run = || {
        let _expected = Expected(&expected);
        let mut memory = M::default();
        while let Some(item) = next() {
            work(&mut memory, item);
        }
    };
    // Threads of the pool may have to wake up first; this one begins without them.
    rayon::in_place_scope(|scope| {
        for _ in 0..others {
            scope.spawn(|_| run());
        }
        run();
        // What is left is under way and mostly soon done, and who was late soon here. To fall asleep
        // until then takes longer, and so does it to wake up the others for what comes next.
        for _ in 0..PATIENCE {
            if expected.load(Ordering::Relaxed) == 0 {
                break;
            }
            // Within a busy pool there is nobody but this thread to do what it has spawned.
            if rayon::yield_local() != Some(rayon::Yield::Executed) {
                std::thread::yield_now();
            }
        }
    });
}

#[cfg(all(test, feature = "rayon"))]
mod tests {
    use super::*;

    #[test]
    fn threads_add_as_many_copies_as_one() {
        for before in [0, 3] {
            for count in [0, 1, LEAST_SHARED - 1, LEAST_SHARED, LEAST_SHARED + 1, 10_007] {
                let mut items = vec![1_u64; before];
                extend(true, &mut items, 7, count);
                assert_eq!(items.len(), before + count);
                assert!(items[..before].iter().all(|&item| item == 1));
                assert!(items[before..].iter().all(|&item| item == 7));
            }
        }
    }
}
