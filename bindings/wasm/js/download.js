// One file over HTTP, as far as it is wanted.

import { GipError, NetworkError } from './errors.js';
import { fetchResponse, pieces } from './source.js';

/** What tells two versions of a file apart, as far as the server lets a script see it. */
const versionOf = ({ headers }) => `${headers.get('ETag')} ${headers.get('Last-Modified')}`;

/** So many bytes before the rest are asked for again, to see that it is the rest: the CRC of a layer. */
const overlap = 4;

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
  /** What the file is said to begin with, until it was seen to. */
  #claimed = null;

  /** `init` is that of `fetch`. */
  constructor(url, init) {
    this.#url = url;
    this.#init = init;
  }

  /** Forgets what has arrived: the next piece is the first of the file again. */
  restart() {
    this.received = 0;
    this.#claimed = null;
  }

  /** Goes on after bytes with which the file is said to begin. */
  beginWith(bytes) {
    this.received = bytes.length;
    this.#claimed = bytes;
  }

  /**
   * The next pieces of the file, each with whether it is the first one. Who stops early ends the
   * transfer; the next call goes on there, if the server has ranges, and else begins again. What the file was
   * said to begin with does not come once more; if it does not, that is an error.
   */
  async *pieces(signal) {
    const transfer = new AbortController();
    const end = () => transfer.abort(signal.reason);
    signal.addEventListener('abort', end, { once: true });
    try {
      const response = await this.#request(transfer.signal);
      this.#version = versionOf(response);
      if (!response.body) return;
      let expected = this.#expected(response);
      for await (const piece of pieces(response.body, signal)) {
        const seen = piece.subarray(0, expected.length);
        // Another file: nobody sees this error.
        if (seen.some((byte, at) => byte !== expected[at])) throw new GipError();
        expected = expected.subarray(seen.length);
        const bytes = piece.subarray(seen.length);
        if (bytes.length === 0) continue;
        this.#claimed = null;
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

  /** The bytes at the beginning of a response that are here already. */
  #expected({ status }) {
    if (!this.#claimed) return new Uint8Array();
    return status === 206 ? this.#claimed.subarray(-overlap) : this.#claimed;
  }

  /** The response with the rest of the file; `null` if there is none. */
  async #rest(signal) {
    const start = this.received - (this.#claimed?.subarray(-overlap).length ?? 0);
    const headers = { Range: `bytes=${start}-` };
    try {
      const response = await fetchResponse(this.#url, { ...this.#init, headers, signal });
      const isSame = this.#version === null || versionOf(response) === this.#version;
      if (continues(response, start) && isSame) return response;
      if (response.status !== 206) {
        if (!this.#claimed) this.restart();
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
