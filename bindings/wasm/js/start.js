// How a worker starts: it is given its WebAssembly, and says whether it could load it.

/** Waits until a worker has loaded a module; rejects if it cannot, or there can be none. */
function ready(worker, module) {
  return new Promise((resolve, reject) => {
    worker.onmessage = ({ data }) => (data === 'ready' ? resolve(worker) : reject());
    worker.onerror = (event) => (event.preventDefault(), reject());
    worker.postMessage({ module });
  });
}

/** The first worker of some ways to start one; `null` if there can be none. */
export async function firstOf(starts, source) {
  for (const start of starts) {
    let worker;
    try {
      worker = start();
      return await ready(worker, await source());
    } catch {
      worker?.terminate();
    }
  }
  return null;
}
