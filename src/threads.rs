//! Runs work on the caller's thread alone, or on the threads of the current `rayon` pool.

use alloc::vec::Vec;
#[cfg(feature = "rayon")]
use core::cmp::Reverse;
#[cfg(feature = "rayon")]
use core::sync::atomic::{AtomicUsize, Ordering};

/// The threads that work is shared among. The result does not depend on them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Threads {
    /// The threads of the current `rayon` pool: of the global one, or of the one whose `install`
    /// makes the call. Without the feature `rayon`, the same as [`Threads::One`].
    #[default]
    Pool,
    /// The caller's thread alone.
    One,
}

impl Threads {
    /// The number of threads.
    pub(crate) fn count(self) -> usize {
        #[cfg(feature = "rayon")]
        if self == Self::Pool {
            return rayon::current_num_threads();
        }
        1
    }
}

/// Calls `work` with every item. Each thread has memory of its own, which it passes to all of its
/// calls.
pub(crate) fn for_each<M: Default, T: Send>(
    threads: Threads,
    items: Vec<T>,
    work: impl Fn(&mut M, T) + Send + Sync,
) {
    #[cfg(feature = "rayon")]
    if threads == Threads::Pool && items.len() > 1 {
        on_pool(items, work);
        return;
    }
    let _ = threads;
    let mut memory = M::default();
    items.into_iter().for_each(|item| work(&mut memory, item));
}

/// The same, with the items of the highest cost first, so that at the end no thread waits for one of them.
pub(crate) fn for_each_by_cost<M: Default, T: Send>(
    threads: Threads,
    items: Vec<T>,
    cost: impl Fn(&T) -> usize,
    work: impl Fn(&mut M, T) + Send + Sync,
) {
    // One thread needs no order, and no code for it.
    #[cfg(feature = "rayon")]
    let items = {
        let mut items = items;
        if threads == Threads::Pool {
            items.sort_by_cached_key(|item| Reverse(cost(item)));
        }
        items
    };
    #[cfg(not(feature = "rayon"))]
    let _ = cost;
    for_each(threads, items, work);
}

/// The results of `work` for every item, in the order of the items.
pub(crate) fn map<T: Send, R: Send>(
    threads: Threads,
    items: impl Iterator<Item = T>,
    work: impl Fn(T) -> R + Send + Sync,
) -> Vec<R> {
    let items: Vec<T> = items.collect();
    let mut results: Vec<Option<R>> = items.iter().map(|_| None).collect();
    let items = items.into_iter().zip(&mut results).collect();
    for_each(threads, items, |(): &mut (), (item, result)| *result = Some(work(item)));
    results.into_iter().map(|result| result.expect("every item was worked on")).collect()
}

// Constants: docs/tuning.md, "Layers and the decoder".
/// How often a thread checks whether the others are done before it goes to sleep: for some ten
/// microseconds.
#[cfg(feature = "rayon")]
const MAX_CHECKS: u32 = 64;

/// Counts a thread that has not finished its work. Dropping it says that the thread has.
#[cfg(feature = "rayon")]
struct Expected<'a>(&'a AtomicUsize);

#[cfg(feature = "rayon")]
impl Drop for Expected<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Wakes up a thread of the current pool, for work that follows soon: waking up takes as long as
/// some of the work does.
#[cfg(feature = "std")]
pub(crate) fn wake(threads: Threads) {
    #[cfg(feature = "rayon")]
    if threads.count() > 1 {
        rayon::spawn(|| ());
    }
    let _ = threads;
}

#[cfg(feature = "rayon")]
fn on_pool<M: Default, T: Send>(items: Vec<T>, work: impl Fn(&mut M, T) + Send + Sync) {
    let others = Threads::Pool.count().min(items.len()).saturating_sub(1);
    let items = std::sync::Mutex::new(items.into_iter());
    let next = || items.lock().expect("taking an item does not panic").next();
    let run = || {
        let mut memory = M::default();
        while let Some(item) = next() {
            work(&mut memory, item);
        }
    };
    together(others, run, run);
}

/// Calls `help` on at most so many other threads of the current pool while `work` runs on this one. Both
/// share what there is to do, so when `work` is done, nothing is left for a thread that starts late.
#[cfg(feature = "rayon")]
pub(crate) fn together(others: usize, help: impl Fn() + Send + Sync, work: impl FnOnce()) {
    let expected = AtomicUsize::new(others);
    let help = || {
        let _expected = Expected(&expected);
        help();
    };
    // The threads of the pool may have to wake up first. This thread does not wait for them.
    rayon::in_place_scope(|scope| {
        for _ in 0..others {
            scope.spawn(|_| help());
        }
        work();
        // The other threads will finish soon. Going to sleep until then would take longer, and so would
        // waking up for what comes next.
        for _ in 0..MAX_CHECKS {
            if expected.load(Ordering::Relaxed) == 0 {
                break;
            }
            // In a busy pool it may be this thread that has to run what it has spawned.
            if rayon::yield_local() != Some(rayon::Yield::Executed) {
                std::thread::yield_now();
            }
        }
    });
}
