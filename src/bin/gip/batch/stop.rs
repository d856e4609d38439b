//! Stopping early: on a signal, or after an error that all further files would have, too.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::{flag, low_level};

/// Whether to stop. Whoever works for long asks from time to time.
#[derive(Debug, Default)]
pub(crate) struct Stop {
    /// The number of the signal, or 0.
    signal: Arc<AtomicUsize>,
    halted: AtomicBool,
}

impl Stop {
    /// From now on SIGINT and SIGTERM ask to stop; when one of them comes again, it ends the process
    /// at once.
    pub(crate) fn on_signals() -> io::Result<Self> {
        let stop = Self::default();
        let again = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            flag::register_conditional_default(signal, Arc::clone(&again))?;
            flag::register(signal, Arc::clone(&again))?;
            flag::register_usize(signal, Arc::clone(&stop.signal), signal as usize)?;
        }
        Ok(stop)
    }

    pub(crate) fn is_asked_for(&self) -> bool {
        self.signal().is_some() || self.halted.load(Ordering::Relaxed)
    }

    /// Asks to stop.
    pub(crate) fn halt(&self) {
        self.halted.store(true, Ordering::Relaxed);
    }

    /// The signal that asked to stop.
    pub(crate) fn signal(&self) -> Option<i32> {
        match self.signal.load(Ordering::Relaxed) {
            0 => None,
            signal => Some(signal as i32),
        }
    }
}

/// Ends the process by a signal, so that a shell that runs it in a loop stops, too. Returns the exit
/// status that stands for the signal, for systems where processes do not end that way.
pub(crate) fn end_by(signal: i32) -> u8 {
    let _ = low_level::emulate_default_handler(signal);
    128 + signal as u8
}
