//! Progress reports to the caller, and cancellation by it.

use core::fmt;
use core::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::error::{EncodeError, Result};
use super::stopwatch::Stopwatch;
use crate::threads;

/// The progress of an encoding.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Progress {
    /// The share of the work that is done, from 0 to 1: an estimate, which never falls.
    pub fraction: f64,
    /// Iterations of training done so far.
    pub iteration: u32,
    /// Iterations planned in total. The number grows when a finished fit is extended to meet its
    /// target.
    pub iterations: u32,
    /// Present number of Gaussians.
    pub gaussians: u32,
    /// PSNR in dB of the present Gaussians, rendered to floats and clamped.
    pub psnr: f64,
}

/// Time of a thread from one poll of the observer to the next, if no task takes longer.
const BETWEEN_POLLS: Duration = Duration::from_millis(4);
/// The least time for which a thread takes tasks from what all threads share: taking them costs a hundredth.
const LEAST_PORTION: Duration = Duration::from_micros(10);
/// A thread takes an nth of its equal share of the remaining tasks at a time, so that all threads end at
/// about the same time.
const PART_OF_SHARE: usize = 3;
/// The least work that is assumed to be left, as a share of the work done: an estimate may be too low.
const LEAST_LEFT: f64 = 0.03;

/// The caller's callback and the last progress reported to it. Code that runs for more than a few
/// milliseconds polls it, so that the caller can cancel at any time.
///
/// Work is counted in the nanoseconds that it takes one core, about (`workload.rs`).
pub(crate) struct Observer<'a> {
    callback: &'a mut (dyn FnMut(&Progress) -> ControlFlow<()> + Send),
    progress: Progress,
    /// Work that is done, and work that is left.
    done: f64,
    left: f64,
}

impl<'a> Observer<'a> {
    pub(crate) fn new(
        callback: &'a mut (dyn FnMut(&Progress) -> ControlFlow<()> + Send),
        iterations: u32,
    ) -> Self {
        let progress =
            Progress { fraction: 0.0, iteration: 0, iterations, gaussians: 0, psnr: 0.0 };
        Self { callback, progress, done: 0.0, left: 0.0 }
    }

    /// Reports the progress of training to the caller.
    pub(crate) fn report(
        &mut self,
        iteration: u32,
        iterations: u32,
        gaussians: usize,
        psnr: f64,
    ) -> Result<()> {
        let fraction = self.progress.fraction;
        self.progress =
            Progress { fraction, iteration, iterations, gaussians: gaussians as u32, psnr };
        self.poll()
    }

    /// Replaces the estimate of the work that is left.
    pub(crate) fn expect(&mut self, work: f64) {
        self.left = work;
    }

    /// Reports that work is done.
    pub(crate) fn advance(&mut self, work: f64) -> Result<()> {
        let left = self.left.max(LEAST_LEFT * self.done).max(work);
        if left > 0.0 {
            self.progress.fraction += work / left * (1.0 - self.progress.fraction);
        }
        self.done += work;
        self.left -= work;
        self.poll()
    }

    /// Calls the callback with the last progress, so that the caller can cancel.
    pub(crate) fn poll(&mut self) -> Result<()> {
        match (self.callback)(&self.progress) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(EncodeError::Cancelled),
        }
    }

    /// Calls `work` with an observer of its own, which polls this one, but whose progress is not reported.
    pub(crate) fn silently<T>(
        &mut self,
        work: impl FnOnce(&mut Observer<'_>) -> Result<T>,
    ) -> Result<T> {
        let mut callback = |_: &Progress| match self.poll() {
            Ok(()) => ControlFlow::Continue(()),
            Err(_) => ControlFlow::Break(()),
        };
        work(&mut Observer::new(&mut callback, 0))
    }

    /// What `task` makes of every item, in their order. All threads share the tasks, and every few
    /// milliseconds there is a poll on this one; without a clock, one at the beginning.
    pub(crate) fn map<T: Send, R: Send>(
        &mut self,
        items: impl ExactSizeIterator<Item = T> + Send,
        task: impl Fn(T) -> R + Send + Sync,
    ) -> Result<Vec<R>> {
        self.map_with(items, |(): &mut (), item| task(item))
    }

    /// [`Observer::map`], where each thread has memory of its own, which it passes to all of its tasks.
    pub(crate) fn map_with<M: Default, T: Send, R: Send>(
        &mut self,
        items: impl ExactSizeIterator<Item = T> + Send,
        task: impl Fn(&mut M, T) -> R + Send + Sync,
    ) -> Result<Vec<R>> {
        let total = items.len();
        let threads = rayon::current_num_threads();
        let items = Mutex::new(items);
        let is_cancelled = AtomicBool::new(false);
        // Moves the next items to `portion`, and returns the index of the first.
        let take = |portion: &mut Vec<T>, least, most| {
            let mut items = items.lock().expect("items do not panic");
            let left = items.len();
            if !is_cancelled.load(Ordering::Relaxed) {
                let count = (left / (PART_OF_SHARE * threads)).clamp(least, most);
                portion.extend(items.by_ref().take(count));
            }
            total - left
        };
        let results = Mutex::new(Vec::new());
        let run = |mut poll: Option<&mut dyn FnMut() -> Result<()>>| {
            let (mut memory, mut portion) = (M::default(), Vec::new());
            // Without a clock, nothing but the remaining tasks tells how many to take.
            let most = if Stopwatch::runs() { 1 } else { usize::MAX };
            let (mut least, mut most, mut since_poll) = (1, most, BETWEEN_POLLS);
            loop {
                let first = take(&mut portion, least, most);
                let count = portion.len();
                if count == 0 {
                    return Ok(());
                }
                if let Some(poll) = &mut poll
                    && since_poll >= BETWEEN_POLLS
                {
                    since_poll = Duration::ZERO;
                    poll().inspect_err(|_| is_cancelled.store(true, Ordering::Relaxed))?;
                }
                let start = Stopwatch::start();
                let found: Vec<R> = portion.drain(..).map(|item| task(&mut memory, item)).collect();
                let time = start.elapsed();
                results.lock().expect("no task runs meanwhile").push((first, found));
                if !Stopwatch::runs() {
                    continue;
                }
                since_poll += time;
                // The next tasks may take longer.
                let within = |limit: Duration| {
                    let share = limit.div_duration_f64(time);
                    ((share * count as f64) as usize).clamp(1, 2 * count)
                };
                (least, most) = (within(LEAST_PORTION), within(BETWEEN_POLLS));
            }
        };
        let others = total.min(threads).saturating_sub(1);
        let mut outcome: Result<()> = Ok(());
        let help = || run(None).expect("only polls fail");
        threads::together(others, help, || outcome = run(Some(&mut || self.poll())));
        outcome?;
        let mut results = results.into_inner().expect("no task runs meanwhile");
        results.sort_unstable_by_key(|&(first, _)| first);
        let mut all = Vec::with_capacity(total);
        results.into_iter().for_each(|(_, mut found)| all.append(&mut found));
        Ok(all)
    }
}

impl fmt::Debug for Observer<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Observer").field("progress", &self.progress).finish_non_exhaustive()
    }
}

/// Calls `work` with an observer that does nothing.
#[cfg(test)]
pub(crate) fn unobserved<T>(work: impl FnOnce(&mut Observer<'_>) -> Result<T>) -> T {
    let mut callback = |_: &Progress| ControlFlow::Continue(());
    work(&mut Observer::new(&mut callback, 0)).expect("no one cancels")
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicUsize;

    use super::*;

    /// Fractions that the callback gets.
    fn fractions(work: impl FnOnce(&mut Observer<'_>) -> Result<()>) -> Vec<f64> {
        let mut fractions = Vec::new();
        let mut callback = |progress: &Progress| {
            fractions.push(progress.fraction);
            ControlFlow::Continue(())
        };
        work(&mut Observer::new(&mut callback, 1)).expect("no one cancels");
        fractions
    }

    #[test]
    fn the_fraction_never_falls_whatever_is_expected() {
        let steps = fractions(|observer| {
            observer.expect(10.0);
            observer.advance(5.0)?;
            // More is left than was expected.
            observer.expect(20.0);
            observer.advance(5.0)?;
            // Less is left.
            observer.expect(5.0);
            observer.advance(4.0)
        });
        let expected = [0.5, 0.625, 0.925];
        for (step, expected) in steps.iter().zip(expected) {
            assert!((step - expected).abs() < 1e-9, "{steps:?}");
        }
        let beyond = fractions(|observer| {
            observer.expect(3.0);
            (0..50).try_for_each(|_| observer.advance(1.0))
        });
        assert!(beyond.is_sorted() && beyond[49] <= 1.0, "{beyond:?}");
        assert!(fractions(|observer| observer.advance(0.0)) == [0.0]);
    }

    #[test]
    fn tasks_keep_their_order_and_long_ones_have_polls_between_them() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
        pool.install(|| {
            let (mut polls, mut done) = (0, AtomicUsize::new(0));
            let mut callback = |_: &Progress| {
                polls += 1;
                if polls == 3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            };
            let long = Observer::new(&mut callback, 1).map(0..11, |_| {
                std::thread::sleep(BETWEEN_POLLS);
                done.fetch_add(1, Ordering::Relaxed);
            });
            assert!(matches!(long, Err(EncodeError::Cancelled)));
            assert_eq!((polls, *done.get_mut()), (3, 2));
        });
        let doubled = unobserved(|observer| observer.map(0..1000, |number| 2 * number));
        assert_eq!(doubled, (0..1000).map(|number| 2 * number).collect::<Vec<_>>());
    }
}
