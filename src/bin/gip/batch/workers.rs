//! Threads that share the files of a batch.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use super::stop::Stop;

/// Calls `work` with the numbers below `count`, on `jobs` threads, until it is asked to stop. They
/// are no threads of `rayon`: one of those that waits for a picture would begin another one.
pub(crate) fn for_each(jobs: usize, count: usize, stop: &Stop, work: impl Fn(usize) + Sync) {
    let next = AtomicUsize::new(0);
    let run = || {
        while !stop.is_asked_for() {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= count {
                break;
            }
            work(index);
        }
    };
    thread::scope(|scope| {
        for _ in 1..jobs.min(count) {
            // Where no more threads can be started, those that run do the work.
            if thread::Builder::new().spawn_scoped(scope, run).is_err() {
                break;
            }
        }
        run();
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_comes_once_until_asked_to_stop() {
        let counts: Vec<AtomicUsize> = (0..50).map(|_| AtomicUsize::new(0)).collect();
        let count = |index: usize| counts[index].fetch_add(1, Ordering::Relaxed);
        let stop = Stop::default();
        for_each(4, 50, &stop, |index| _ = count(index));
        assert!(counts.iter().all(|count| count.load(Ordering::Relaxed) == 1));
        for_each(1, 50, &stop, |index| {
            count(index);
            if index == 7 {
                stop.halt();
            }
        });
        let again = counts.iter().filter(|count| count.load(Ordering::Relaxed) == 2).count();
        assert_eq!(again, 8);
        for_each(4, 50, &stop, |_| panic!("asked to stop"));
    }
}
