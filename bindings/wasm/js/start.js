// How a worker starts: it is given its WebAssembly, and says whether it could load it.

/** Waits until a worker has loaded its module; rejects if it cannot, or there can be none. */
function ready(worker, source) {
  return new Promise((resolve, reject) => {
    worker.onmessage = ({ data }) => (data === 'ready' ? resolve(worker) : reject());
    worker.onerror = (event) => (event.preventDefault(), reject());
    // It may end while the module is being compiled.
    Promise.resolve(source()).then((module) => worker.postMessage({ module }), reject);
  });
}

/** The first worker of some ways to start one; `null` if there can be none. */
export async function firstOf(starts, source) {
  for (const start of starts) {
    let worker;
    try {
      worker = start();
      return await ready(worker, source);
    } catch {
      worker?.terminate();
    }
  }
  return null;
}
