//! Pools of threads that live as long as a call. The global pool of `rayon` is never used: its threads do
//! not exist in the child of a `fork`, and a child that waits for them hangs.

use std::thread;

use image_gip::Threads;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::status::{Failure, Status};

/// Most threads of a call.
const MOST: u32 = 1024;

/// The number of threads that the caller asks for: 0 is one.
pub(crate) fn checked(threads: u32) -> Result<usize, Failure> {
    if threads > MOST {
        return Err(Failure::argument(format!("threads {threads}; it must be 0 to {MOST}")));
    }
    Ok(threads.max(1) as usize)
}

/// Calls `work` with a pool of so many threads, which have ended when this returns.
pub(crate) fn with_pool<R>(
    threads: usize,
    work: impl FnOnce(&ThreadPool) -> R,
) -> Result<R, Failure> {
    let mut handles = Vec::with_capacity(threads);
    let pool = ThreadPoolBuilder::new()
        .num_threads(threads)
        .spawn_handler(|thread| {
            let name = format!("gip {}", thread.index());
            handles.push(thread::Builder::new().name(name).spawn(|| thread.run())?);
            Ok(())
        })
        .build();
    // Those that were started end if one could not be.
    let result = pool
        .map(|pool| work(&pool))
        .map_err(|error| Failure::new(Status::Threads, format!("no thread was started: {error}")));
    for handle in handles {
        // They have no result; a panic in the work has reached this thread already.
        let _ = handle.join();
    }
    result
}

/// Does the work of a decoder: on the caller's thread, or on a pool of several.
pub(crate) fn decoding<R: Send>(
    threads: usize,
    work: impl FnOnce(Threads) -> R + Send,
) -> Result<R, Failure> {
    if threads == 1 {
        return Ok(work(Threads::One));
    }
    with_pool(threads, |pool| pool.install(|| work(Threads::Pool)))
}
