// The encoder for scripts. It works in workers of its own, and never blocks the page.

import { abortable } from './abortable.js';
import { canShare, cores, mostPictures, source, starts } from './encoder-place.js';
import { unpack } from './errors.js';
import { number } from './numbers.js';
import { pixelsOf } from './pictures.js';
import { checked } from './pixels.js';
import { firstOf } from './start.js';

export { GipError, LimitError } from './errors.js';

/** After so many milliseconds without work workers end: the memory of WebAssembly never shrinks. */
const mostIdle = 10_000;
/** Most threads of a picture, if nobody asks for more. */
const usualThreads = 16;

/** Workers that share the work on one picture at a time. The first one encodes, the others are its threads. */
class Team {
  #workers;
  #idle = 0;
  #settle = null;
  #onprogress = null;

  constructor(workers) {
    this.#workers = workers;
    for (const worker of workers) {
      worker.onmessage = ({ data }) => this.#hear(data);
      worker.onerror = (event) => {
        event.preventDefault();
        this.#hear({ error: { kind: 'failed', message: `the worker has ended: ${event.message}` } });
      };
    }
  }

  get threads() {
    return this.#workers.length;
  }

  /** Encodes. When the signal is aborted, the workers end. */
  async run(message, transfer, onprogress, signal) {
    clearTimeout(this.#idle);
    if (signal?.aborted) this.#rest();
    signal?.throwIfAborted();
    this.#hold(true);
    return new Promise((resolve, reject) => {
      const abort = () => (this.end(), reject(signal.reason));
      signal?.addEventListener('abort', abort, { once: true });
      this.#onprogress = onprogress;
      this.#settle = (error, result) => {
        signal?.removeEventListener('abort', abort);
        if (error) reject(error);
        else resolve(result);
      };
      try {
        this.#send(message, transfer);
      } catch (error) {
        // Among the options is what cannot be copied, such as a function.
        this.#rest();
        this.#finish(error);
      }
    });
  }

  #send(message, transfer) {
    const [first] = this.#workers;
    try {
      first.postMessage(message, transfer);
    } catch {
      // Shared memory, and a small `Buffer` of Node, are not moved.
      first.postMessage(message);
    }
  }

  #hear({ progress, result, error }) {
    if (progress) return this.#tell(progress);
    // After a trap, there is no telling what is in the memory.
    if (error?.kind === 'failed') this.end();
    else this.#rest();
    this.#finish(error && unpack(error), result);
  }

  #tell(progress) {
    try {
      this.#onprogress?.(progress);
    } catch (error) {
      this.end();
      this.#finish(error);
    }
  }

  #finish(error, result) {
    const settle = this.#settle;
    this.#settle = this.#onprogress = null;
    settle?.(error, result);
  }

  /** Whether the program waits for it. */
  #hold(holds) {
    for (const worker of this.#workers) worker.hold?.(holds);
  }

  /** Waits for more work. */
  #rest() {
    this.#hold(false);
    idle.add(this);
    this.#idle = setTimeout(() => this.end(), mostIdle);
    this.#idle.unref?.();
  }

  end() {
    if (this.threads > 0) count -= 1;
    for (const worker of this.#workers) worker.terminate();
    this.#workers = [];
    clearTimeout(this.#idle);
    idle.delete(this);
  }
}

/** What is loaded; if it cannot be, as without a connection, the next picture tries all again. */
async function loaded(load) {
  try {
    return await load();
  } catch (error) {
    [canStart, canHaveThreads] = [true, canShare];
    throw error;
  }
}

/** This thread, where there can be no worker: the page stands still meanwhile. */
const ownThread = {
  async run({ image, options }, _, onprogress, signal) {
    const { encode, load } = await loaded(() => import('./encoder-core.js'));
    await loaded(load);
    await new Promise((resolve) => setTimeout(resolve));
    signal?.throwIfAborted();
    return encode(image, { ...options, onprogress: (progress) => void onprogress?.(progress) });
  },
};

const idle = new Set();
/** Teams, and pictures that are not done. */
let [count, pictures] = [0, 0];
let [canStart, canHaveThreads] = [true, canShare];
/** Those who wait for a team. */
const waiting = [];

/** The workers of a new team; `null` if there can be none of so many threads. */
async function startedFor(threads) {
  if (threads > 1) {
    // A module of its own, which is loaded only where there can be threads.
    const workers = await import('./encoder-threads.js').then(({ teamOf }) => teamOf(threads), () => null);
    canHaveThreads &&= workers !== null;
    return workers;
  }
  const worker = await firstOf(starts, source);
  canStart &&= worker !== null;
  return worker && [worker];
}

/** A team for a picture: one that waits for work, a new one, or the first that has done its work. */
async function nextTeam(asked) {
  for (;;) {
    const share = Math.floor(cores / Math.min(pictures, mostPictures));
    const threads = canHaveThreads ? (asked ?? Math.min(share, usualThreads)) : 1;
    const [team = null] = [...idle].filter((team) => team.threads === threads);
    if (team) {
      idle.delete(team);
      return team;
    }
    if (!canStart) return ownThread;
    if (count >= mostPictures) {
      const [other] = idle;
      if (!other) await new Promise((resolve) => waiting.push(resolve));
      other?.end();
    } else {
      count += 1;
      const workers = await startedFor(threads);
      if (workers) return new Team(workers);
      count -= 1;
    }
  }
}

/** The arrays of a picture that nobody else needs. */
const buffersOf = (image, mayTake) => (mayTake && image?.data ? [image.data.buffer] : []);

async function work(picture, { signal, onprogress, transfer = false, colorSpace, threads, ...options }) {
  pictures += 1;
  try {
    const pixels = await pixelsOf(picture, colorSpace);
    signal?.throwIfAborted();
    // A worker may never hear of samples that are gone, as they are after they have been moved.
    checked(pixels);
    const { width, height, channels, data, colorSpace: space } = pixels;
    const image = { width, height, channels, data, colorSpace: space };
    const team = await nextTeam(threads);
    try {
      return await team.run({ image, options }, buffersOf(image, transfer || pixels !== picture), onprogress, signal);
    } finally {
      waiting.shift()?.();
    }
  } finally {
    pictures -= 1;
  }
}

/** Encodes a picture; see the declarations. */
export async function encode(picture, options = {}) {
  const { signal, threads, onprogress } = options;
  signal?.throwIfAborted();
  if (threads !== undefined) number(threads, 'threads', 1, 64);
  if (onprogress && typeof onprogress !== 'function') throw new TypeError('onprogress must be a function');
  // Whoever waits for a team hears at once that the signal is aborted.
  return abortable(work(picture, options), signal);
}
