//! Work on this thread alone, or also on others of the current `rayon` pool.

use alloc::vec::Vec;
#[cfg(feature = "rayon")]
use core::sync::atomic::{AtomicUsize, Ordering};

/// The threads that work is shared among. What comes out does not depend on them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Threads {
    /// Those of the current `rayon` pool: the global one, or the one whose `install` makes the call.
    /// Without the feature `rayon`, the same as [`Threads::One`].
    #[default]
    Pool,
    /// The caller's thread alone.
    One,
}

impl Threads {
    /// How many there are.
    pub(crate) fn count(self) -> usize {
        #[cfg(feature = "rayon")]
        if self == Self::Pool {
            return rayon::current_num_threads();
        }
        1
    }
}

/// Runs `work` on every item, on this thread and, if asked for, on others of the current pool; each
/// lends its memory from one item to the next.
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

/// What `work` makes of every item, in their order.
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

/// How often a thread asks whether the others are done before it falls asleep: some ten microseconds
/// in all. Two threads decode in 0.98 to 0.99 of the time that they take without that (8 Kodak pictures
/// at 0.25, 0.5 and 1 bpp, both in one program in turns), and no longer wait brings more.
#[cfg(feature = "rayon")]
const MOST_ASKED: u32 = 64;

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
        // The last items are being worked on and mostly soon done: falling asleep takes longer, and so
        // does waking up for the next call.
        for _ in 0..MOST_ASKED {
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
