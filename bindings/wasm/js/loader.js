// A picture that is downloaded as far as it is needed, and decoded meanwhile.

import { Download } from './download.js';
import { GipError, NetworkError } from './errors.js';
import { StreamDecoder } from './index.js';

export class Loader {
  /** The latest progress of the decoder. */
  header = null;
  orientation = null;
  arrived = 0;
  colorSpace = false;
  texture = false;
  complete = false;
  #download;
  #limits;
  #decoder;
  #abort = new AbortController();
  /** How many Gaussians are wanted, which is not known while the decoder is being asked. */
  #wanted = 0;
  #asking = 0;
  #fed = false;
  #running = false;
  #failed = false;
  #onprogress;
  #onerror;

  /**
   * `init` is that of `fetch`, `limits` those of the decoder. `onprogress` is called after every piece,
   * and waited for: in it, `want` can say how far to go on. `onerror` is called with the error that ends it.
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
    if (this.complete) return false;
    if (this.orientation === null || this.#asking > 0 || this.arrived < this.#wanted) return true;
    // What comes after all Gaussians, such as texture, is wanted with all of them.
    return this.#wanted === this.header.gaussians;
  }

  /** Begins, or goes on: until header and orientation are there, and what `want` asked for. */
  start() {
    const ended = this.#failed || this.#abort.signal.aborted;
    if (this.lacking && !this.#running && !ended) void this.#run();
  }

  /** Goes on, or stops, when the Gaussians have arrived that an output of this size needs. */
  async want(width, height) {
    this.#asking += 1;
    try {
      this.#wanted = await this.#decoder.gaussiansFor(width, height);
    } finally {
      this.#asking -= 1;
    }
    this.start();
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
      const { header, gaussians, ...progress } = await this.#decoder.feed(bytes);
      if (signal.aborted) return;
      this.header ??= header;
      Object.assign(this, progress, { arrived: gaussians });
      await this.#onprogress();
      if (!this.lacking) return;
    }
    await this.#decoder.finish();
  }

  /** A decoder for a file from its beginning. */
  #begin() {
    this.#decoder.close();
    this.#decoder = new StreamDecoder({ limits: this.#limits });
    const nothing = { colorSpace: false, texture: false, complete: false };
    Object.assign(this, { header: null, orientation: null, arrived: 0, ...nothing });
  }
}
