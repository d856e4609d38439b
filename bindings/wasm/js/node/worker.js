// Workers of Node's own kind, with what of the browsers' interface is used.

import { Worker } from 'node:worker_threads';

export class NodeWorker {
  #worker;

  /** `script` is a text. */
  constructor(script) {
    this.#worker = new Worker(script, { eval: true, name: 'image-gip' });
  }

  set onmessage(listener) {
    this.#worker.removeAllListeners('message').on('message', (data) => listener({ data }));
  }

  set onerror(listener) {
    this.#worker.removeAllListeners('error').on('error', ({ message }) => listener({ message, preventDefault() {} }));
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
