// One file over HTTP, as far as it is wanted.

import { NetworkError } from './errors.js';
import { fetchResponse, pieces } from './source.js';

/** What tells two versions of a file apart, as far as the server lets a script see it. */
const versionOf = ({ headers }) => `${headers.get('ETag')} ${headers.get('Last-Modified')}`;

/** Whether a response goes on with a file at this byte. */
function continues(response, start) {
  if (response.status !== 206) return false;
  // Other origins may hide this header; then the status has to be enough.
  const range = response.headers.get('Content-Range');
  return range === null || range.startsWith(`bytes ${start}-`);
}

export class Download {
  /** The bytes that have arrived. */
  received = 0;
  #url;
  #init;
  #version = null;

  /** `init` is that of `fetch`. */
  constructor(url, init) {
    this.#url = url;
    this.#init = init;
  }

  /** Forgets what has arrived: the next piece is the first of the file again. */
  restart() {
    this.received = 0;
  }

  /**
   * The next pieces of the file, each with whether it is the first one. Who stops early ends the
   * transfer; the next call goes on there, if the server has ranges, and else begins again.
   */
  async *pieces(signal) {
    const transfer = new AbortController();
    const end = () => transfer.abort(signal.reason);
    signal.addEventListener('abort', end, { once: true });
    try {
      const response = await this.#request(transfer.signal);
      this.#version = versionOf(response);
      if (!response.body) return;
      for await (const bytes of pieces(response.body, signal)) {
        const first = this.received === 0;
        this.received += bytes.length;
        yield { bytes, first };
      }
    } finally {
      signal.removeEventListener('abort', end);
      transfer.abort();
    }
  }

  async #request(signal) {
    if (this.received > 0) {
      const rest = await this.#rest(signal);
      if (rest) return rest;
      this.restart();
    }
    return fetchResponse(this.#url, { ...this.#init, signal });
  }

  /** The response with the rest of the file; `null` if there is none. */
  async #rest(signal) {
    const headers = { Range: `bytes=${this.received}-` };
    try {
      const response = await fetchResponse(this.#url, { ...this.#init, headers, signal });
      if (continues(response, this.received) && versionOf(response) === this.#version) return response;
      if (response.status !== 206) {
        this.restart();
        return response;
      }
      await response.body?.cancel();
    } catch (error) {
      // The range is not in the file any more, or this server refuses ranges.
      if (!(error instanceof NetworkError) || error.status === 0) throw error;
    }
    return null;
  }
}
