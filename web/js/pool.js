// Workers that each have a decoder with the whole file. Calls to one worker are answered in order.

/** Leaves one core to the page. */
const WORKERS = Math.max(1, Math.min(4, (navigator.hardwareConcurrency ?? 2) - 1));

class Thread {
  /** Whether it has a tile to render. */
  isBusy = false;
  #worker = new Worker(new URL('./worker.js', import.meta.url), { type: 'module', name: 'tiles' });
  #calls = new Map();
  #last = 0;

  constructor(onFailure) {
    this.#worker.onmessage = ({ data: { call, result, error } }) => {
      const { resolve, reject } = this.#calls.get(call);
      this.#calls.delete(call);
      if (error) reject(new Error(error));
      else resolve(result);
    };
    this.#worker.onerror = (event) => {
      const error = new Error(event.message || 'The workers that render the picture cannot start.');
      for (const { reject } of this.#calls.values()) reject(error);
      this.#calls.clear();
      onFailure(error);
    };
  }

  call(method, argument) {
    const call = ++this.#last;
    return new Promise((resolve, reject) => {
      this.#calls.set(call, { resolve, reject });
      this.#worker.postMessage({ call, method, argument });
    });
  }
}

export class Pool {
  #threads;

  constructor(onFailure) {
    this.#threads = Array.from({ length: WORKERS }, () => new Thread(onFailure));
  }

  get size() {
    return this.#threads.length;
  }

  /** A thread without a tile to render. */
  get idle() {
    return this.#threads.find((thread) => !thread.isBusy);
  }

  /** Asks one thread. */
  ask(method, argument) {
    return this.#threads[0].call(method, argument);
  }

  /** Tells all threads, and gives the answer of the one that is asked. */
  tell(method, argument) {
    const [answer, ...others] = this.#threads.map((thread) => thread.call(method, argument));
    // They fail as the first does.
    for (const other of others) other.catch(() => {});
    return answer;
  }
}
