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
  /** Why the file is not complete, though nothing more arrives; `null` if nothing is wrong. */
  error = null;
  /** Whether nothing may be fetched yet. */
  held = true;
  #download;
  #limits;
  /** Whether what has arrived is a small file in place of this one, which has not begun yet. */
  preliminary = false;
  /** What is here without a request: what the file begins with, or a small file; `null` when it has been taken. */
  #placeholder;
  #decoder;
  #abort = new AbortController();
  /** How many Gaussians are wanted, which is not known while the decoder is being asked. */
  #wanted = 0;
  #asking = 0;
  #fed = false;
  #running = false;
  #onprogress;
  #onerror;

  /**
   * `init` is that of `fetch`, `limits` those of the decoder, `placeholder` is what to show at once, or
   * `null`. `onprogress` is called after every piece, and waited for: in it, `want` can say how far to go on.
   * `onerror` is called when an `error` ends it.
   */
  constructor(url, { init, limits, placeholder }, onprogress, onerror) {
    this.#download = new Download(url, init);
    this.#limits = limits;
    this.#placeholder = placeholder;
    this.#decoder = new StreamDecoder({ limits });
    this.#onprogress = onprogress;
    this.#onerror = onerror;
  }

  /** The bytes that have arrived. */
  get received() {
    return this.#download.received;
  }

  /** Whether there is something to show. */
  get showable() {
    return this.orientation !== null && this.arrived > 0;
  }

  /** Whether more is to arrive. */
  get lacking() {
    if (this.complete || this.error) return false;
    if (this.preliminary || this.orientation === null || this.#asking > 0 || this.arrived < this.#wanted) return true;
    // What comes after all Gaussians, such as texture, is wanted with all of them.
    return this.#wanted === this.header.gaussians;
  }

  /** Allows that the file is fetched. */
  release() {
    this.held = false;
    this.start();
  }

  /** Begins, or goes on: until header and orientation are there, and what `want` asked for. */
  start() {
    if (this.lacking && !this.#running && !this.#abort.signal.aborted) void this.#run();
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
    if (this.#placeholder) await this.#showPlaceholder();
    while (this.lacking && !this.held) {
      if (this.#abort.signal.aborted) return;
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
          this.error = error;
          this.#take(this.#decoder.progress);
          this.#onerror();
        }
      }
    }
    this.#running = false;
  }

  async #transfer() {
    const { signal } = this.#abort;
    for await (const { bytes, first } of this.#download.pieces(signal)) {
      if (first && this.#fed) this.#begin();
      await this.#feed(bytes);
      if (signal.aborted || !this.lacking) return;
    }
    await this.#decoder.finish();
  }

  async #feed(bytes, isPlaceholder = false) {
    this.#fed = true;
    const progress = await this.#decoder.feed(bytes);
    if (this.#abort.signal.aborted) return;
    this.#take(progress);
    if (isPlaceholder && this.complete) {
      this.preliminary = true;
      this.complete = false;
      this.#download.restart();
    }
    await this.#onprogress();
  }

  #take({ header, gaussians, ...progress }) {
    this.header ??= header;
    Object.assign(this, progress, { arrived: gaussians });
  }

  /** Decodes what is to be shown at once. If it is no beginning of a picture, the file tells all. */
  async #showPlaceholder() {
    const bytes = this.#placeholder;
    this.#placeholder = null;
    this.#download.beginWith(bytes);
    try {
      await this.#feed(bytes, true);
    } catch {
      this.#download.restart();
    }
  }

  /** A decoder for a file from its beginning. */
  #begin() {
    this.#decoder.close();
    this.#decoder = new StreamDecoder({ limits: this.#limits });
    const nothing = { preliminary: false, colorSpace: false, texture: false, complete: false };
    Object.assign(this, { header: null, orientation: null, arrived: 0, ...nothing });
  }
}
