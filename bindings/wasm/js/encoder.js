// The encoder for scripts. It works in workers of its own, and never blocks the page.

import { mostWorkers, source, starts } from './encoder-place.js';
import { GipError, unpack } from './errors.js';
import { pixelsOf } from './pictures.js';
import { firstOf } from './start.js';

export { GipError, LimitError } from './errors.js';

/** After so many milliseconds without work a worker ends: the memory of WebAssembly never shrinks. */
const mostIdle = 10_000;

/** A worker that encodes, one picture at a time. */
class EncoderThread {
  #worker;
  #idle = 0;

  constructor(worker) {
    this.#worker = worker;
  }

  /** Encodes. When the signal is aborted, the worker ends. */
  async run(message, transfer, onprogress, signal) {
    clearTimeout(this.#idle);
    if (signal?.aborted) this.#rest();
    signal?.throwIfAborted();
    this.#worker.hold?.(true);
    return new Promise((resolve, reject) => {
      const abort = () => (this.#end(), reject(signal.reason));
      const settle = (act) => {
        signal?.removeEventListener('abort', abort);
        this.#rest();
        act();
      };
      signal?.addEventListener('abort', abort, { once: true });
      this.#worker.onmessage = ({ data: { progress, result, error } }) => {
        if (progress) onprogress?.(progress);
        else settle(() => (error ? reject(unpack(error)) : resolve(result)));
      };
      this.#worker.onerror = (event) => {
        event.preventDefault();
        signal?.removeEventListener('abort', abort);
        this.#end();
        reject(new GipError(`the worker has ended: ${event.message}`));
      };
      this.#worker.postMessage(message, transfer);
    });
  }

  /** Waits for more work. */
  #rest() {
    this.#worker.hold?.(false);
    idle.add(this);
    this.#idle = setTimeout(() => this.#end(), mostIdle);
    this.#idle.unref?.();
  }

  #end() {
    this.#worker.terminate();
    idle.delete(this);
    count -= 1;
  }
}

/** This thread, where there can be no worker: the page stands still meanwhile. */
const ownThread = {
  async run({ image, options }, _, onprogress, signal) {
    const { encode, load } = await import('./encoder-core.js');
    await load();
    await new Promise((resolve) => setTimeout(resolve));
    signal?.throwIfAborted();
    return encode(image, { ...options, onprogress: (progress) => void onprogress?.(progress) });
  },
};

const idle = new Set();
let count = 0;
let canStart = true;
/** Those who wait for a thread. */
const waiting = [];

/** A thread for a picture: one that waits for work, a new one, or the first that has done its work. */
async function nextThread() {
  for (;;) {
    const [thread] = idle;
    if (thread) {
      idle.delete(thread);
      return thread;
    }
    if (!canStart) return ownThread;
    if (count < mostWorkers) {
      count += 1;
      const worker = await firstOf(starts, source);
      if (worker) return new EncoderThread(worker);
      count -= 1;
      canStart = false;
    } else {
      await new Promise((resolve) => waiting.push(resolve));
    }
  }
}

/** The arrays of a picture that nobody else needs. */
const buffersOf = (image, mayTake) => (mayTake && image?.data ? [image.data.buffer] : []);

/** Encodes a picture; see the declarations. */
export async function encode(picture, { signal, onprogress, transfer = false, colorSpace, ...options } = {}) {
  signal?.throwIfAborted();
  const pixels = await pixelsOf(picture, colorSpace);
  signal?.throwIfAborted();
  const { width, height, channels, data, colorSpace: space } = pixels ?? {};
  const image = { width, height, channels, data, colorSpace: space };
  const thread = await nextThread();
  try {
    return await thread.run({ image, options }, buffersOf(image, transfer || pixels !== picture), onprogress, signal);
  } finally {
    waiting.shift()?.();
  }
}
