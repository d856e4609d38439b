// The decoder on this thread: no worker, and nothing to wait for once it is loaded.

import init, { Decoder as Native } from './image_gip.js';
import { defaultLimits } from './limits.js';

const channelsOf = { gray: 1, 'gray-alpha': 2, rgb: 3, rgba: 4 };
const all = 2 ** 32 - 1;
/** The largest width and height of an output. */
const mostSide = 2 ** 23;

let loading = null;
let memory = null;

/**
 * Loads the decoder, once per thread. Without an argument it is fetched from beside this script.
 */
export function load(source = undefined) {
  loading ??= init(source === undefined ? undefined : { module_or_path: source }).catch((error) => {
    loading = null;
    throw error;
  });
  return loading.then((exports) => {
    memory = exports.memory;
  });
}

/** The bytes that all decoders of this thread take. They are used again, but never given back. */
export const memorySize = () => memory?.buffer.byteLength ?? 0;

function integer(value, name, least, most = all) {
  if (!Number.isInteger(value) || value < least || value > most) {
    throw new RangeError(`${name} is ${value}; it must be an integer from ${least} to ${most}`);
  }
  return value;
}

/** The size of the whole output, with the picture's proportions where one side is missing. */
function outputSize(header, { width, height } = {}) {
  const other = (side, from, to) => Math.min(mostSide, Math.max(1, Math.round((side * to) / from)));
  if (width === undefined && height === undefined) return [header.width, header.height];
  if (width !== undefined) integer(width, 'width', 1, mostSide);
  if (height !== undefined) integer(height, 'height', 1, mostSide);
  return [
    width ?? other(height, header.height, header.width),
    height ?? other(width, header.width, header.height),
  ];
}

/** Decodes bytes as they arrive, and renders what has arrived. */
export class Decoder {
  #native;
  #header = null;

  constructor({ limits = {}, statistics = false } = {}) {
    const { pixels, outputPixels, gaussians, memory, work } = { ...defaultLimits, ...limits };
    this.#native = new Native(statistics, pixels, outputPixels, gaussians, memory, work);
  }

  /** Takes the next bytes of the file. Bytes after its end are ignored. */
  feed(bytes) {
    if (!(bytes instanceof Uint8Array)) throw new TypeError('the bytes must be a Uint8Array');
    this.#native.feed(bytes);
    return this.progress;
  }

  /** Says that no more bytes come: throws an `UnexpectedEndError` if the file is not complete. */
  finish() {
    this.#native.finish();
  }

  get header() {
    this.#header ??= this.#native.header() ?? null;
    return this.#header;
  }

  get metadata() {
    return this.#native.metadata();
  }

  /** Header, number of Gaussians that have arrived, and whether the file is complete. */
  get progress() {
    const native = this.#native;
    return { header: this.header, gaussians: native.arrived(), complete: native.complete() };
  }

  /** How many Gaussians are enough for an output of this size in pixels. */
  gaussiansFor(width, height) {
    return this.#native.gaussiansFor(integer(width, 'width', 1), integer(height, 'height', 1));
  }

  /** How many Gaussians the first `bytes` of the file have, as far as the file has arrived. */
  gaussiansIn(bytes) {
    let count = 0;
    for (const { gaussians, start, end } of this.#native.statistics().layers) {
      if (bytes >= end) count += gaussians;
      else if (this.header.coding === 'packed' && bytes > start) {
        // Twelve bytes before them, four after them, and all have the same number of bits.
        count += Math.floor((gaussians * Math.max(0, bytes - start - 12)) / (end - start - 16));
      }
    }
    return count;
  }

  /** Nine numbers for each Gaussian; see the declarations. */
  gaussians({ start = 0, end = all } = {}) {
    return this.#native.gaussians(integer(start, 'start', 0), integer(end, 'end', 0));
  }

  /** Chunks, layers, bits per attribute. */
  statistics() {
    return this.#native.statistics();
  }

  /** Renders 8-bit RGBA: what an `ImageData` is made of. */
  render(options = {}) {
    const request = this.#request({ ...options, color: 'rgba' });
    const data = this.#native.render8(request);
    return { width: request[4], height: request[5], data };
  }

  /** Renders the samples as they are specified, in the file's colour model and depth by default. */
  samples(options = {}) {
    const request = this.#request(options);
    const color = options.color ?? this.header.color;
    const depth = options.depth ?? this.header.depth;
    if (depth !== 8 && depth !== 16) throw new RangeError(`depth is ${depth}; it must be 8 or 16`);
    const data = depth === 8 ? this.#native.render8(request) : this.#native.render16(request);
    return { width: request[4], height: request[5], color, channels: channelsOf[color], depth, data };
  }

  /** Renders a PNG file with the picture's ICC profile, which a browser then converts. */
  async png(options = {}) {
    const { encodePng } = await import('./png.js');
    return encodePng(this.samples({ ...options, depth: 8 }), this.metadata.iccProfile);
  }

  /** Frees the memory. Nothing else may be called after this. */
  close() {
    this.#native?.free();
    this.#native = null;
  }

  #request({ width, height, region, gaussians = all, color }) {
    if (color !== undefined && !(color in channelsOf)) {
      throw new RangeError(`color is ${color}; it must be one of ${Object.keys(channelsOf)}`);
    }
    // Before the header, the decoder refuses whatever it is asked for.
    const size = outputSize(this.header ?? { width: 1, height: 1 }, { width, height });
    const part = region ?? { x: 0, y: 0, width: size[0], height: size[1] };
    return Uint32Array.of(
      ...size,
      integer(part.x, 'region.x', 0),
      integer(part.y, 'region.y', 0),
      integer(part.width, 'region.width', 1),
      integer(part.height, 'region.height', 1),
      integer(gaussians, 'gaussians', 0),
      channelsOf[color] ?? 0,
    );
  }
}
