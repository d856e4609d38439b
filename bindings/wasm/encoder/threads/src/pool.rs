//! The pool of threads.

use std::sync::{Condvar, Mutex};

use rayon::{ThreadBuilder, ThreadPoolBuilder};
use wasm_bindgen::prelude::*;

/// Threads of the pool that no worker has taken yet.
static WAITING: Mutex<Vec<ThreadBuilder>> = Mutex::new(Vec::new());
static ADDED: Condvar = Condvar::new();

/// Makes the pool of so many threads. This thread is one of them, and waits until the others have begun
/// [`run_thread`]. It may be called once.
#[wasm_bindgen(js_name = startPool)]
pub fn start_pool(threads: usize) {
    ThreadPoolBuilder::new()
        .num_threads(threads)
        // Encoding calls JavaScript, which must be that of the thread with the caller's functions.
        .use_current_thread()
        .spawn_handler(|thread| {
            WAITING.lock().expect("no thread panics").push(thread);
            ADDED.notify_one();
            Ok(())
        })
        .build_global()
        .expect("there is no pool yet");
}

/// Is a thread of the pool, and never returns.
#[wasm_bindgen(js_name = runThread)]
pub fn run_thread() {
    let waiting = WAITING.lock().expect("no thread panics");
    let mut waiting =
        ADDED.wait_while(waiting, |threads| threads.is_empty()).expect("no thread panics");
    let thread = waiting.pop().expect("there is one");
    drop(waiting);
    thread.run();
}
