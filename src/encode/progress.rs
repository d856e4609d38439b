//! What a caller is told during an encoding, and how it stops one.

use core::fmt;
use core::ops::ControlFlow;

use super::error::EncodeError;

/// How far the encoder is.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Progress {
    /// Iterations done.
    pub iteration: u32,
    /// Iterations in all, as far as known.
    pub iterations: u32,
    /// Gaussians at this moment.
    pub gaussians: u32,
    /// PSNR of the float rendering at this moment, in dB.
    pub psnr: f64,
}

/// The caller's function and what it was told last. Whatever takes more than some milliseconds
/// polls it now and then.
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

    /// Tells the caller something new.
    pub(crate) fn tell(&mut self, progress: Progress) -> Result<(), EncodeError> {
        self.progress = progress;
        self.poll()
    }

    /// Gives the caller a chance to stop.
    ///
    /// # Errors
    /// [`EncodeError::Cancelled`] when it does.
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
