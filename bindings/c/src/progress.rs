//! Progress of an encoding, told to the caller on the caller's thread.

use core::ffi::{c_int, c_void};
use core::ops::ControlFlow;
use core::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use image_gip::{EncodeError, Encoded, Encoder, Progress, Source};

use crate::status::Failure;
use crate::threads;

/// The progress of an encoding.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CProgress {
    /// The bytes of the structure that the library has filled: those of its version of the header.
    pub struct_size: usize,
    /// The share of the work that is done, 0 to 1: an estimate, which never falls.
    pub fraction: f64,
    /// PSNR in dB of the Gaussians so far.
    pub psnr: f64,
    /// Iterations of training done so far.
    pub iteration: u32,
    /// Iterations planned in total; the number may grow.
    pub iterations: u32,
    /// Gaussians so far.
    pub gaussians: u32,
}

/// Is called again and again during gip_encode, on the thread that has called it, with the progress and with
/// gip_encode_options.user. It returns 0 to go on; anything else cancels the encoding. It must return: no
/// exception and no longjmp may leave it.
pub type ProgressFn =
    Option<unsafe extern "C" fn(progress: *const CProgress, user: *mut c_void) -> c_int>;

/// The fraction of the work after which there is something to report, if no iteration has ended.
const NEWS: f64 = 0.002;

/// What the threads that encode and the thread that waits for them tell each other.
#[derive(Default)]
struct Watch {
    state: Mutex<State>,
    changed: Condvar,
    is_cancelled: AtomicBool,
}

#[derive(Default)]
struct State {
    /// What was reported since the last look.
    news: Option<Progress>,
    is_done: bool,
}

impl Watch {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes a report of the encoder, and tells it whether to go on. `last` is the last one that was news.
    fn report(&self, progress: &Progress, last: &mut Option<Progress>) -> ControlFlow<()> {
        if self.is_cancelled.load(Ordering::Relaxed) {
            return ControlFlow::Break(());
        }
        // The encoder calls every few milliseconds, so that it can be cancelled.
        let is_news = last.is_none_or(|last| {
            progress.iteration != last.iteration || progress.fraction >= last.fraction + NEWS
        });
        if is_news {
            *last = Some(*progress);
            self.state().news = Some(*progress);
            self.changed.notify_one();
        }
        ControlFlow::Continue(())
    }

    /// Passes on reports until the encoder is done, or cancels it. Returns whether it did not.
    fn attend(&self, mut tell: impl FnMut(&Progress) -> bool) -> bool {
        loop {
            let waits = |state: &mut State| !state.is_done && state.news.is_none();
            let waited = self.changed.wait_while(self.state(), waits);
            let mut state = waited.unwrap_or_else(PoisonError::into_inner);
            let (news, is_done) = (state.news.take(), state.is_done);
            drop(state);
            if news.is_some_and(|news| !tell(&news)) {
                self.is_cancelled.store(true, Ordering::Relaxed);
                return false;
            }
            if is_done {
                return true;
            }
        }
    }
}

/// Tells that the encoder is done, even if it panics.
struct Done<'a>(&'a Watch);

impl Drop for Done<'_> {
    fn drop(&mut self) {
        self.0.state().is_done = true;
        self.0.changed.notify_one();
    }
}

/// Encodes on a pool of threads, while this thread attends to the callback.
///
/// # Safety
/// `callback` may be called with `user`.
pub(crate) unsafe fn encode(
    encoder: &Encoder,
    source: &Source<'_>,
    threads: usize,
    callback: ProgressFn,
    user: *mut c_void,
) -> Result<Encoded, Failure> {
    let Some(callback) = callback else {
        let encode = |pool: &rayon::ThreadPool| pool.install(|| encoder.encode(source));
        return Ok(threads::with_pool(threads, encode)??);
    };
    let tell = |progress: &Progress| {
        let Progress { fraction, iteration, iterations, gaussians, psnr, .. } = *progress;
        let struct_size = size_of::<CProgress>();
        let progress = CProgress { struct_size, fraction, psnr, iteration, iterations, gaussians };
        // SAFETY: the same contract; this is the thread of the caller.
        unsafe { callback(&raw const progress, user) == 0 }
    };
    let watch = Watch::default();
    let mut encoded = None;
    let goes_on = threads::with_pool(threads, |pool| {
        pool.in_place_scope(|scope| {
            scope.spawn(|_| {
                let _done = Done(&watch);
                let mut last = None;
                let report = &mut |progress: &Progress| watch.report(progress, &mut last);
                encoded = Some(encoder.encode_with(source, report));
            });
            watch.attend(tell)
        })
    })?;
    if !goes_on {
        return Err(EncodeError::Cancelled.into());
    }
    Ok(encoded.expect("the scope waits for the encoder")?)
}
