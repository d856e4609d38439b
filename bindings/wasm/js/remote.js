// Decoders in workers, or on this thread where there can be none.

import { GipError, unpack } from './errors.js';
import { source, starts } from './place.js';
import { firstOf } from './start.js';

/** Most workers; each takes a few megabytes. */
const mostWorkers = Math.max(1, Math.min(4, (globalThis.navigator?.hardwareConcurrency ?? 2) - 1));

/** A worker with decoders. */
class WorkerThread {
  decoders = 0;
  #worker;
  #calls = new Map();
  #last = 0;
  #ended = false;

  constructor(worker) {
    this.#worker = worker;
    worker.onmessage = ({ data: { call, result, error } }) => {
      const { resolve, reject } = this.#calls.get(call);
      this.#calls.delete(call);
      if (error) reject(unpack(error));
      else resolve(result);
    };
    worker.onerror = () => this.#end();
  }

  async call(id, method, argument, transfer) {
    if (this.#ended) throw new GipError('the worker has ended');
    const call = (this.#last += 1);
    return new Promise((resolve, reject) => {
      this.#worker.postMessage({ call, id, method, argument }, transfer);
      this.#calls.set(call, { resolve, reject });
    });
  }

  #end() {
    this.#ended = true;
    this.#worker.terminate();
    threads.delete(this);
    for (const { reject } of this.#calls.values()) reject(new GipError('the worker has ended'));
    this.#calls.clear();
  }
}

/** This thread. Each call is a task of its own, so that the page can do other things in between. */
class OwnThread {
  decoders = 0;
  #host = import('./core.js').then(async ({ Decoder, Host, load }) => {
    await load();
    return new Host(Decoder);
  });

  constructor() {
    // Without a connection, no worker started either: the next decoder tries all again.
    this.#host.catch(() => {
      own = null;
      canStart = true;
    });
  }

  async call(id, method, argument) {
    const host = await this.#host;
    await new Promise((resolve) => setTimeout(resolve));
    const [result] = await host.call(id, method, argument);
    return result;
  }
}

const threads = new Set();
let canStart = true;
let starting = null;
let own = null;

async function startWorker() {
  const worker = await firstOf(starts, source);
  if (worker) threads.add(new WorkerThread(worker));
  else canStart = false;
}

/** The thread for the next decoder: the one with the fewest. */
async function nextThread() {
  for (;;) {
    const least = [...threads].reduce((a, b) => (a && a.decoders <= b.decoders ? a : b), null);
    const mayStart = canStart && threads.size < mostWorkers;
    if (least?.decoders === 0 || !mayStart) {
      const thread = least ?? (own ??= new OwnThread());
      thread.decoders += 1;
      return thread;
    }
    starting ??= startWorker().finally(() => {
      starting = null;
    });
    await starting;
  }
}

let lastId = 0;

/** Frees decoders whose owners were forgotten without `close`. */
const forgotten = new FinalizationRegistry((close) => close());

/** A function that closes a decoder. It does not hold the object that is forgotten. */
function closeOf(thread, id) {
  return async () => {
    try {
      const running = await thread;
      running.decoders -= 1;
      await running.call(id, 'close');
    } catch {
      // There is no decoder then.
    }
  };
}

/** A decoder on one of the threads. All calls give promises, and are answered in their order. */
export class RemoteDecoder {
  #thread;
  #id = ++lastId;
  #close;
  #closed = false;

  constructor(options) {
    const id = this.#id;
    const thread = nextThread().then(async (thread) => {
      await thread.call(id, 'create', options);
      return thread;
    });
    thread.catch(() => {});
    this.#thread = thread;
    this.#close = closeOf(thread, id);
    forgotten.register(this, this.#close, this);
  }

  async call(method, argument, transfer) {
    if (this.#closed) throw new GipError('the decoder is closed');
    const thread = await this.#thread;
    return thread.call(this.#id, method, argument, transfer);
  }

  close() {
    this.#closed = true;
    if (forgotten.unregister(this)) void this.#close();
  }
}
