// The decoder on this thread: no worker, and nothing to wait for once it is loaded.

import init, { Decoder as Native } from './image_gip.js';
import { GipError } from './errors.js';
import { allLimits } from './limits.js';
import { turnedSize, turnGaussians, Upright } from './orientation.js';
import { source as here } from './place.js';

// Decoders for other threads, for this package alone. With a file of its own, a page would load more.
export { Host } from './host.js';

const channelsOf = { gray: 1, 'gray-alpha': 2, rgb: 3, rgba: 4 };
const all = 2 ** 32 - 1;
/** What is asked for before the header has arrived is refused, whatever it is. */
const noHeader = { width: 1, height: 1, color: 'rgba', depth: 8 };
/** The largest width and height of an output. */
const mostSide = 2 ** 23;

let loading = null;
let memory = null;

/**
 * Loads the decoder, once per thread. Without an argument it comes from where this script is.
 */
export function load(source = undefined) {
  // Of nothing, it takes the file beside this script.
  loading ??= init({ module_or_path: source ?? here() }).catch((error) => {
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

/** Whether a picture is turned as its Exif says. */
function isTurned(orientation) {
  if (orientation !== 'from-image' && orientation !== 'none') {
    throw new RangeError(`orientation is ${orientation}; it must be from-image or none`);
  }
  return orientation === 'from-image';
}

/** The size of the whole output, with the picture's proportions where one side is missing. */
function outputSize(picture, { width, height }) {
  const other = (side, from, to) => Math.min(mostSide, Math.max(1, Math.round((side * to) / from)));
  if (width === undefined && height === undefined) return [picture.width, picture.height];
  if (width !== undefined) integer(width, 'width', 1, mostSide);
  if (height !== undefined) integer(height, 'height', 1, mostSide);
  return [
    width ?? other(height, picture.height, picture.width),
    height ?? other(width, picture.width, picture.height),
  ];
}

/** Decodes bytes as they arrive, and renders what has arrived. */
export class Decoder extends Upright {
  #native;
  #header = null;
  #orientation = null;

  constructor({ limits, statistics = false } = {}) {
    super();
    const numbers = Object.values(allLimits(limits));
    if (!memory) throw new GipError('the decoder is not loaded yet: wait for load() first');
    this.#native = new Native(statistics, ...numbers);
  }

  get #open() {
    if (!this.#native) throw new GipError('the decoder is closed');
    return this.#native;
  }

  /** Takes the next bytes of the file. Bytes after its end are ignored. */
  feed(bytes) {
    if (!(bytes instanceof Uint8Array)) throw new TypeError('the bytes must be a Uint8Array');
    this.#open.feed(bytes);
    return this.progress;
  }

  /** Says that no more bytes come: throws an `UnexpectedEndError` if the file is not complete. */
  finish() {
    this.#open.finish();
  }

  get header() {
    this.#header ??= this.#open.header() ?? null;
    return this.#header;
  }

  /** The value in the Exif, 1 to 8; `null` until it is known. */
  get orientation() {
    this.#orientation ??= this.#open.orientation() ?? null;
    return this.#orientation;
  }

  get metadata() {
    return this.#open.metadata();
  }

  /** What has arrived; see the declarations. */
  get progress() {
    const native = this.#open;
    return {
      header: this.header,
      orientation: this.orientation,
      gaussians: native.arrived(),
      colorSpace: native.hasColorSpace(),
      texture: native.hasTexture(),
      complete: native.complete(),
    };
  }

  /** How many Gaussians are enough for an output of this size in pixels. */
  gaussiansFor(width, height) {
    return this.#open.gaussiansFor(integer(width, 'width', 1), integer(height, 'height', 1));
  }

  /** How many Gaussians the first `bytes` of the file have, as far as the file has arrived. */
  gaussiansIn(bytes) {
    return this.#open.gaussiansIn(bytes);
  }

  /** Nine numbers for each Gaussian; see the declarations. */
  gaussians({ start = 0, end = all, orientation = 'none' } = {}) {
    const turned = isTurned(orientation);
    const numbers = this.#open.gaussians(integer(start, 'start', 0), integer(end, 'end', 0));
    return turned && this.orientation > 1 ? turnGaussians(numbers, this.header, this.orientation) : numbers;
  }

  /** The planes of the texture's map; see the declarations. `null` without texture. */
  textureMap() {
    return this.#open.textureMap() ?? null;
  }

  /** Chunks, layers, bits per attribute. */
  statistics() {
    return this.#open.statistics();
  }

  /** Renders 8-bit RGBA, upright by default: what an `ImageData` is made of. */
  render(options = {}) {
    const request = this.#request('from-image', { ...options, color: 'rgba' });
    const data = this.#open.render8(request);
    return { width: request[4], height: request[5], data };
  }

  /** Renders the samples as they are specified: by default as stored, in the file's colour model and depth. */
  samples(options = {}) {
    const request = this.#request('none', options);
    const header = this.header ?? noHeader;
    const { color = header.color, depth = header.depth } = options;
    if (depth !== 8 && depth !== 16) throw new RangeError(`depth is ${depth}; it must be 8 or 16`);
    const data = depth === 8 ? this.#open.render8(request) : this.#open.render16(request);
    return { width: request[4], height: request[5], color, channels: channelsOf[color], depth, data };
  }

  /** Renders a PNG file, upright by default, with the picture's colour space, which a browser then converts. */
  async png({ orientation = 'from-image', ...options } = {}) {
    const samples = this.samples({ ...options, orientation, depth: 8 });
    const { metadata } = this;
    const { encodePng } = await import('./png.js');
    return encodePng(samples, metadata);
  }

  /** Frees the memory. What is called after this throws a `GipError`. */
  close() {
    this.#native?.free();
    this.#native = null;
  }

  /** The numbers for a rendering, with the orientation that it has by default. */
  #request(
    byDefault,
    { width, height, region, gaussians = all, color, orientation = byDefault, texture = true },
  ) {
    if (color !== undefined && !Object.hasOwn(channelsOf, color)) {
      throw new RangeError(`color is ${color}; it must be one of ${Object.keys(channelsOf)}`);
    }
    const turned = isTurned(orientation);
    const picture = turnedSize(this.header ?? noHeader, turned ? this.orientation : 1);
    const size = outputSize(picture, { width, height });
    const part = region ?? { x: 0, y: 0, width: size[0], height: size[1] };
    return Uint32Array.of(
      ...size,
      integer(part.x, 'region.x', 0),
      integer(part.y, 'region.y', 0),
      integer(part.width, 'region.width', 1),
      integer(part.height, 'region.height', 1),
      integer(gaussians, 'gaussians', 0),
      channelsOf[color] ?? 0,
      Number(turned),
      Number(Boolean(texture)),
    );
  }
}
