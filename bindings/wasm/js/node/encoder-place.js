// Where the encoder is in Node: in this script, with workers of Node's own kind.

import { availableParallelism } from 'node:os';
import { Worker } from 'node:worker_threads';

import script from 'embedded:encoder-worker.js';
import module from 'embedded:image_gip_encoder_bg.wasm';

import { compiledOnce } from '../embedded/compile.js';

/** The WebAssembly, which is compiled once for all threads. */
export const source = compiledOnce(module);

/** A worker of Node with what of the browsers' interface is used. */
class NodeWorker {
  #worker = new Worker(script, { eval: true, name: 'image-gip' });

  set onmessage(listener) {
    this.#worker.removeAllListeners('message').on('message', (data) => listener({ data }));
  }

  set onerror(listener) {
    this.#worker.removeAllListeners('error').on('error', (error) => listener({ ...error, preventDefault() {} }));
  }

  postMessage(message, transfer) {
    this.#worker.postMessage(message, transfer);
  }

  terminate() {
    void this.#worker.terminate();
  }

  /** Whether the program waits for it. */
  hold(holds) {
    if (holds) this.#worker.ref();
    else this.#worker.unref();
  }
}

/** The ways to start a worker. */
export const starts = [() => new NodeWorker()];

/** Most workers: one for each core. Each takes some ten megabytes, and more for large pictures. */
export const mostWorkers = availableParallelism();
