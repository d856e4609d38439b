//! The pixels that may be worked on at the same time.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Bounds the pixels of the pictures in memory.
#[derive(Debug)]
pub(crate) struct Budget {
    pixels: u64,
    used: Mutex<u64>,
    freed: Condvar,
    /// Held by the one who waits for room. All others stand behind, so that a large picture gets its
    /// turn even while small ones would fit.
    turn: Mutex<()>,
}

/// Pixels of the budget, which are free again when it is dropped.
#[derive(Debug)]
pub(crate) struct Permit<'a> {
    budget: &'a Budget,
    pixels: u64,
}

impl Budget {
    pub(crate) fn new(pixels: u64) -> Self {
        Self { pixels, used: Mutex::new(0), freed: Condvar::new(), turn: Mutex::new(()) }
    }

    /// Waits until so many pixels fit. More than the budget fit when nothing else is worked on.
    pub(crate) fn wait_for(&self, pixels: u64) -> Permit<'_> {
        let _turn = self.turn.lock().unwrap_or_else(PoisonError::into_inner);
        let is_full = |used: &mut u64| *used > 0 && used.saturating_add(pixels) > self.pixels;
        let used = self.freed.wait_while(self.used(), is_full);
        *used.unwrap_or_else(PoisonError::into_inner) += pixels;
        Permit { budget: self, pixels }
    }

    fn used(&self) -> MutexGuard<'_, u64> {
        // Adding cannot leave a wrong number behind.
        self.used.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Permit<'_> {
    fn drop(&mut self) {
        *self.budget.used() -= self.pixels;
        // One waits at most: the others wait for their turn.
        self.budget.freed.notify_one();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU64, Ordering};
    use std::thread;

    #[test]
    fn the_budget_is_kept_and_a_picture_larger_than_it_is_alone() {
        let budget = Budget::new(10);
        let (used, most, alone) = (AtomicU64::new(0), AtomicU64::new(0), AtomicU64::new(0));
        thread::scope(|scope| {
            for sizes in [[1, 9, 4], [10, 3, 25], [7, 40, 2], [5, 5, 5]] {
                let (budget, used, most, alone) = (&budget, &used, &most, &alone);
                scope.spawn(move || {
                    for pixels in sizes.into_iter().cycle().take(60) {
                        let _permit = budget.wait_for(pixels);
                        let now = used.fetch_add(pixels, Ordering::SeqCst) + pixels;
                        if pixels > 10 {
                            assert_eq!(now, pixels, "it is alone");
                            alone.fetch_add(1, Ordering::SeqCst);
                        } else {
                            assert!(now <= 10, "{now}");
                            most.fetch_max(now, Ordering::SeqCst);
                        }
                        thread::yield_now();
                        used.fetch_sub(pixels, Ordering::SeqCst);
                    }
                });
            }
        });
        assert_eq!(alone.into_inner(), 40);
        assert_eq!(*budget.used(), 0);
        assert_eq!(most.into_inner(), 10);
    }

    #[test]
    fn a_large_picture_gets_its_turn_before_small_ones_that_come_later() {
        let budget = Budget::new(10);
        let order = Mutex::new(Vec::new());
        let first = budget.wait_for(6);
        thread::scope(|scope| {
            let enter = |pixels| {
                let (budget, order) = (&budget, &order);
                scope.spawn(move || {
                    let _permit = budget.wait_for(pixels);
                    order.lock().expect("no panic").push(pixels);
                });
            };
            enter(10);
            // Until the large one waits in the doorway.
            while budget.turn.try_lock().is_ok() {
                thread::yield_now();
            }
            enter(1);
            drop(first);
        });
        assert_eq!(order.into_inner().expect("no panic"), [10, 1]);
    }
}
