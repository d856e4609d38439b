//! Pools of threads that live as long as a call. The global pool of `rayon` is never used: its threads
//! do not exist in the child of a `fork`, and a child that waits for them hangs.

use std::thread;

use image_gip::Threads;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::numbers::Integer;

/// Most threads of a call.
const MAX_THREADS: usize = 1024;

/// The argument `threads`.
pub(crate) fn checked(threads: &Bound<'_, PyAny>) -> PyResult<usize> {
    threads.extract::<Integer<'_>>()?.within("threads", 1..=MAX_THREADS)
}

/// Calls `work` with a pool of so many threads, which have ended when this returns.
pub(crate) fn with_pool<R>(threads: usize, work: impl FnOnce(&ThreadPool) -> R) -> PyResult<R> {
    let mut handles = Vec::with_capacity(threads);
    let pool = ThreadPoolBuilder::new()
        .num_threads(threads)
        .spawn_handler(|thread| {
            let name = format!("image_gip {}", thread.index());
            handles.push(thread::Builder::new().name(name).spawn(|| thread.run())?);
            Ok(())
        })
        .build()
        .map_err(|error| PyRuntimeError::new_err(format!("no thread could be started: {error}")))?;
    let result = work(&pool);
    drop(pool);
    for handle in handles {
        // They have no result; a panic in the work has reached this thread already.
        let _ = handle.join();
    }
    Ok(result)
}

/// Does the work of a decoder: on the caller's thread, or on a pool of several.
pub(crate) fn decoding<R: Send>(
    threads: usize,
    work: impl FnOnce(Threads) -> R + Send,
) -> PyResult<R> {
    if threads == 1 {
        return Ok(work(Threads::One));
    }
    with_pool(threads, |pool| pool.install(|| work(Threads::Pool)))
}
