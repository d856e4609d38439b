//! Progress reports to the caller, and cancellation by it.

use core::fmt;
use core::ops::ControlFlow;

use super::error::EncodeError;

/// The progress of an encoding.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Progress {
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

/// The caller's callback and the last progress reported to it. Code that runs for more than a few
/// milliseconds polls it, so that the caller can cancel at any time.
pub(crate) struct Observer<'a> {
    callback: &'a mut (dyn FnMut(&Progress) -> ControlFlow<()> + Send),
    progress: Progress,
}

impl<'a> Observer<'a> {
    pub(crate) fn new(
        callback: &'a mut (dyn FnMut(&Progress) -> ControlFlow<()> + Send),
        iterations: u32,
    ) -> Self {
        let progress = Progress { iteration: 0, iterations, gaussians: 0, psnr: 0.0 };
        Self { callback, progress }
    }

    /// Reports progress to the caller.
    ///
    /// # Errors
    /// As [`Observer::poll`].
    pub(crate) fn report(&mut self, progress: Progress) -> Result<(), EncodeError> {
        self.progress = progress;
        self.poll()
    }

    /// Calls the callback with the last progress, so that the caller can cancel.
    ///
    /// # Errors
    /// [`EncodeError::Cancelled`] when the caller cancels.
    pub(crate) fn poll(&mut self) -> Result<(), EncodeError> {
        match (self.callback)(&self.progress) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(EncodeError::Cancelled),
        }
    }
}

impl fmt::Debug for Observer<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Observer").field("progress", &self.progress).finish_non_exhaustive()
    }
}
