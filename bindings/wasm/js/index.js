// The package's interface for scripts. It works in a worker of its own, and never blocks the page.

import { abortable } from './abortable.js';
import { allLimits } from './limits.js';
import { Upright } from './orientation.js';
import { RemoteDecoder } from './remote.js';
import { read } from './source.js';

export {
  GipError,
  LimitError,
  MalformedError,
  NetworkError,
  SignatureError,
  UnexpectedEndError,
  UnsupportedError,
} from './errors.js';
export { defaultLimits } from './limits.js';

/** Decodes bytes as they arrive, and renders what has arrived. */
export class StreamDecoder extends Upright {
  #remote;
  #progress = { header: null, orientation: null, gaussians: 0, colorSpace: false, texture: false, complete: false };

  constructor({ limits, statistics } = {}) {
    super();
    this.#remote = new RemoteDecoder({ limits: allLimits(limits), statistics });
  }

  get header() {
    return this.#progress.header;
  }

  get orientation() {
    return this.#progress.orientation;
  }

  get complete() {
    return this.#progress.complete;
  }

  get progress() {
    return this.#progress;
  }

  get arrived() {
    return this.#progress.gaussians;
  }

  async feed(bytes) {
    if (bytes?.[Symbol.toStringTag] !== 'Uint8Array') throw new TypeError('the bytes must be a Uint8Array');
    // The caller may write to its own meanwhile.
    const copy = new Uint8Array(bytes);
    try {
      this.#progress = await this.#remote.call('feed', copy, [copy.buffer]);
    } catch (error) {
      // What came before the damage is there.
      this.#progress = await this.#remote.call('progress').catch(() => this.#progress);
      throw error;
    }
    return this.#progress;
  }

  finish() {
    return this.#remote.call('finish');
  }

  metadata() {
    return this.#remote.call('metadata');
  }

  statistics() {
    return this.#remote.call('statistics');
  }

  gaussiansIn(bytes) {
    return this.#remote.call('gaussiansIn', bytes);
  }

  gaussians({ start, end, orientation } = {}) {
    return this.#remote.call('gaussians', { start, end, orientation });
  }

  textureMap() {
    return this.#remote.call('textureMap');
  }

  gaussiansFor(width, height) {
    return this.#remote.call('gaussiansFor', [width, height]);
  }

  async render({ signal, ...options } = {}) {
    const { width, height, data } = await abortable(this.#remote.call('render', options), signal);
    return new ImageData(data, width, height);
  }

  samples({ signal, ...options } = {}) {
    return abortable(this.#remote.call('samples', options), signal);
  }

  async png({ signal, ...options } = {}) {
    const file = await abortable(this.#remote.call('png', options), signal);
    return new Blob([file], { type: 'image/png' });
  }

  close() {
    this.#remote.close();
  }
}

/** Reads a whole file. */
export async function open(source, { signal, limits, statistics } = {}) {
  const decoder = new StreamDecoder({ limits, statistics });
  try {
    for await (const bytes of read(source, signal)) {
      const { complete } = await abortable(decoder.feed(bytes), signal);
      if (complete) return decoder;
    }
    await abortable(decoder.finish(), signal);
    return decoder;
  } catch (error) {
    decoder.close();
    throw error;
  }
}

/** Reads a file, and renders it once. */
export async function decode(source, { signal, limits, ...options } = {}) {
  const picture = await open(source, { signal, limits });
  try {
    return await picture.render({ ...options, signal });
  } finally {
    picture.close();
  }
}
