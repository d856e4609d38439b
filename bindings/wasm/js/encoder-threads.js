// Starts an encoder with threads: workers that share memory. The page starts all of them, so that it hears of what
// becomes of each, and can end them.

import { source, starts } from './encoder-threads-place.js';

/** Workers that are ready to encode with the first of them; `null` if there can be none. */
export async function teamOf(threads) {
  for (const start of starts) {
    const workers = [];
    try {
      while (workers.length < threads) workers.push(start());
      const answers = new Map();
      const failed = new Promise((_, reject) => {
        for (const worker of workers) {
          worker.onerror = (event) => (event.preventDefault(), reject());
          worker.onmessage = ({ data }) => (data === 'failed' || data.error ? reject() : answers.get(worker)(data));
        }
      });
      const ask = (worker, message) => {
        const answered = new Promise((resolve) => answers.set(worker, resolve));
        worker.postMessage(message);
        return Promise.race([failed, answered]);
      };
      const [first, ...others] = workers;
      const shared = await ask(first, { module: await source() });
      await Promise.all(others.map((worker) => ask(worker, shared)));
      await ask(first, { threads });
      return workers;
    } catch {
      for (const worker of workers) worker.terminate();
    }
  }
  return null;
}
