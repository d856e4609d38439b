// A picture that is downloaded as far as it is needed, and decoded meanwhile.

import { Download } from './download.js';
import { GipError, NetworkError } from './errors.js';
import { StreamDecoder } from './index.js';

export class Loader {
  /** The latest progress of the decoder. */
  header = null;
  orientation = null;
  arrived = 0;
  complete = false;
  #download;
  #limits;
  #decoder;
  #abort = new AbortController();
  #wanted = 0;
  #fed = false;
  #running = false;
  #failed = false;
  #onprogress;
  #onerror;

  /**
   * `init` is that of `fetch`, `limits` those of the decoder. `onprogress` is called after every piece, and waited for: in it, `want`
   * can say how far to go on. `onerror` is called with the error that ends it.
   */
  constructor(url, init, limits, onprogress, onerror) {
    this.#download = new Download(url, init);
    this.#limits = limits;
    this.#decoder = new StreamDecoder({ limits });
    this.#onprogress = onprogress;
    this.#onerror = onerror;
  }

  /** The bytes that have arrived. */
  get received() {
    return this.#download.received;
  }

  /** Whether more is to arrive. */
  get lacking() {
    return !this.complete && (this.orientation === null || this.arrived < this.#wanted);
  }

  /** Goes on, or stops, when this many Gaussians have arrived, and at least header and orientation. */
  want(gaussians) {
    this.#wanted = gaussians;
    if (this.lacking && !this.#running && !this.#failed) void this.#run();
  }

  gaussiansFor(width, height) {
    return this.#decoder.gaussiansFor(width, height);
  }

  metadata() {
    return this.#decoder.metadata();
  }

  render(options) {
    return this.#decoder.render(options);
  }

  png(options) {
    return this.#decoder.png(options);
  }

  /** Ends the download, and frees the memory. */
  close() {
    this.#abort.abort();
    this.#decoder.close();
  }

  async #run() {
    this.#running = true;
    while (this.lacking && !this.#failed) {
      const resumed = this.received > 0;
      try {
        await this.#transfer();
      } catch (error) {
        if (this.#abort.signal.aborted) return;
        // The file may have been replaced since its beginning came.
        const replaced = resumed && error instanceof GipError && !(error instanceof NetworkError);
        if (replaced) {
          this.#download.restart();
        } else {
          this.#failed = true;
          this.#onerror(error);
        }
      }
    }
    this.#running = false;
  }

  async #transfer() {
    const { signal } = this.#abort;
    for await (const { bytes, first } of this.#download.pieces(signal)) {
      if (first && this.#fed) this.#begin();
      this.#fed = true;
      const { header, orientation, gaussians, complete } = await this.#decoder.feed(bytes);
      if (signal.aborted) return;
      this.header ??= header;
      Object.assign(this, { orientation, arrived: gaussians, complete });
      await this.#onprogress();
      if (!this.lacking) return;
    }
    await this.#decoder.finish();
  }

  /** A decoder for a file from its beginning. */
  #begin() {
    this.#decoder.close();
    this.#decoder = new StreamDecoder({ limits: this.#limits });
    Object.assign(this, { header: null, orientation: null, arrived: 0, complete: false });
  }
}
