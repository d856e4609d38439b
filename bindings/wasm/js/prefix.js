// Small files that are the beginning of large ones: the first layers of a file are a picture, and so is a file of
// them (spec, section 4.4). Nothing is decoded for it, and no WebAssembly is loaded.

import { Cursor, Writer, chunkLength, chunksOf, fileLength } from './chunks.js';
import { malformed, numberBytes, types, unsupported } from './chunks.js';
import { GipError, UnexpectedEndError } from './errors.js';

export { GipError, MalformedError, SignatureError, UnexpectedEndError, UnsupportedError } from './errors.js';

const mostHeader = 255;
const mostSide = 2 ** 20;
const mostLayers = 65_535;

/** The bits of the first byte of the header. */
const sixteenBits = 0x04;
const entropyCoding = 0x08;
const quartic = 0x10;
const form = 0x60;
const reserved = 0x80;

/**
 * How many bytes of the header follow its numbers: base colour, cut-off, and quantizers or steps. The values are not
 * looked at but for the kinds of quantizers, which say how long they are.
 */
function lengthOfRest(format, hasGaussians, rest) {
  const channels = (format & 3) + 1;
  let length = channels * (format & sixteenBits ? 2 : 1) + (format & quartic ? 0 : 4);
  if (!hasGaussians) return length;
  if (format & entropyCoding) return length + 2 + (channels - 1) + (format & form ? 8 : 0);
  // Of position, shape and channels.
  for (let component = 0; component < 5 + channels; component += 1) length += rest[length] === 0 ? 2 : 10;
  return length;
}

/** The header: its numbers of Gaussians and layers, and the bytes before and after them. */
function readHeader(payload) {
  const cursor = new Cursor(payload, types.header, 1);
  const wrong = (reason) => malformed(types.header, reason);
  const field = () => {
    const value = cursor.number();
    if (value === null) throw wrong('is shorter than its fields');
    return value;
  };
  if (payload.length > mostHeader) throw unsupported(types.header, `length ${payload.length}`);
  const format = payload[0];
  const mostForm = format & entropyCoding ? 0x20 : 0x40;
  if (format & reserved || (format & form) > mostForm) throw unsupported(types.header, `format ${format}`);
  for (const side of ['width', 'height']) {
    const value = field();
    if (value === 0) throw wrong(`the ${side} is zero`);
    if (value > mostSide) throw unsupported(types.header, `${side} ${value}`);
  }
  const before = payload.subarray(0, cursor.at);
  const gaussians = field();
  const layers = gaussians === 0 ? 0 : field();
  if (gaussians > 0 && layers === 0) throw wrong('Gaussians, but no layer');
  if (layers > gaussians) throw wrong('more layers than Gaussians');
  if (layers > mostLayers) throw unsupported(types.header, `number of layers ${layers}`);
  const after = payload.subarray(cursor.at);
  const length = lengthOfRest(format, gaussians > 0, after);
  if (after.length !== length) throw wrong(`is ${after.length < length ? 'shorter' : 'longer'} than its fields`);
  return { gaussians, layers, before, after };
}

/** The orientation that Exif data say, 1 to 8; 1 if they say none (spec, section 5.5). */
function orientationOf(exif) {
  const view = new DataView(exif.buffer, exif.byteOffset, exif.byteLength);
  if (exif.length < 8) return 1;
  const isLittle = view.getUint32(0) === 0x49492a00;
  if (!isLittle && view.getUint32(0) !== 0x4d4d002a) return 1;
  const directory = view.getUint32(4, isLittle);
  if (directory + 2 > exif.length) return 1;
  const end = directory + 2 + 12 * view.getUint16(directory, isLittle);
  for (let at = directory + 2; at < end && at + 12 <= exif.length; at += 12) {
    const short = (offset) => view.getUint16(at + offset, isLittle);
    if (short(0) === 0x0112 && short(2) === 3 && view.getUint32(at + 4, isLittle) === 1) {
      return short(8) >= 1 && short(8) <= 8 ? short(8) : 1;
    }
  }
  return 1;
}

/** Exif data that say an orientation and nothing else: little-endian, a directory of one entry with one short number. */
const exifOf = (orientation) =>
  Uint8Array.of(0x49, 0x49, 42, 0, 8, 0, 0, 0, 1, 0, 0x12, 1, 3, 0, 1, 0, 0, 0, orientation, 0, 0, 0, 0, 0, 0, 0);

/** Whether a chunk that may say how the picture is shown, its colours or that it is turned, is not broken. */
function isSound(type, payload) {
  switch (type) {
    case types.colorSpace:
      // Without a matrix, in full range.
      return payload.length === 4 && payload[2] === 0 && payload[3] === 1;
    case types.masteringDisplay:
      return payload.length === 24;
    case types.contentLight:
      return payload.length === 8;
    default:
      return type === types.iccProfile || type === types.exif;
  }
}

/** The layers of a file, as far as they are sound, and what of the file the prefixes keep. */
class Layers {
  #header = null;
  #layers = [];
  /** Chunks to keep, all of which stand before the first layer. */
  #kept = [];
  /** The types of which a sound chunk has come, kept or not. */
  #seen = new Set();
  /** Where the file ends, if that has come. */
  #end = null;

  constructor(bytes) {
    if (!(bytes instanceof Uint8Array)) throw new TypeError('the bytes must be a Uint8Array');
    try {
      for (const chunk of chunksOf(bytes)) this.#add(chunk);
    } catch (error) {
      // What comes after the first layer does not take it away.
      if (this.#layers.length === 0) throw error;
    }
    if (this.#header === null) {
      throw new UnexpectedEndError('unexpected end of the file before its header ends', 'unexpected-end');
    }
  }

  #add({ type, payload, end }) {
    if ((this.#header === null) !== (type === types.header)) {
      throw malformed(type, 'the header does not stand at the beginning, and only there');
    }
    if (type === types.header) this.#header = readHeader(payload);
    else if (type === types.layer) this.#addLayer(payload, end);
    else if (type.length === 4) this.#addAncillary(type, payload);
    else if (type === types.end) this.#end = end;
    else throw unsupported(type, 'critical chunk of an unknown type');
  }

  #addLayer(payload, end) {
    const wrong = (reason) => malformed(types.layer, reason);
    const later = this.#header.layers - this.#layers.length - 1;
    if (later < 0) throw wrong('more layers than the header declares');
    const before = this.#layers.at(-1) ?? { allGaussians: 0, allBytes: 0 };
    const left = this.#header.gaussians - before.allGaussians;
    const cursor = new Cursor(payload, types.layer);
    // The last layer has the rest.
    const gaussians = later === 0 ? left : cursor.number();
    if (gaussians === null) throw wrong('too short for a number of Gaussians');
    if (gaussians === 0) throw wrong('no Gaussians');
    if (gaussians > left - later) throw wrong('more Gaussians than the header declares');
    const data = payload.subarray(cursor.at);
    const count = numberBytes(gaussians);
    this.#layers.push({
      count,
      data,
      end,
      allGaussians: before.allGaussians + gaussians,
      bytesBefore: before.allBytes,
      // In a file that does not end with it.
      allBytes: before.allBytes + chunkLength(types.layer, count.length + data.length),
    });
  }

  #addAncillary(type, payload) {
    // Others break a rule, and decoders skip them.
    const mayStandHere = this.#layers.length === 0 && !this.#seen.has(type);
    if (!mayStandHere || !isSound(type, payload)) return;
    this.#seen.add(type);
    if (type !== types.exif) this.#kept.push({ type, payload });
    else if (orientationOf(payload) > 1) this.#kept.push({ type, payload: exifOf(orientationOf(payload)) });
  }

  /** The parts of the header of so many of the layers. */
  #headerOf(layers) {
    const { before, after } = this.#header;
    if (layers === 0) return [before, numberBytes(0), after];
    const gaussians = this.#layers[layers - 1].allGaussians;
    return [before, numberBytes(gaussians), numberBytes(layers), after];
  }

  /** All prefixes: first that of the first layer. */
  get prefixes() {
    const kept = this.#kept.reduce((sum, { type, payload }) => sum + chunkLength(type, payload.length), 0);
    const headerLength = (layers) => this.#headerOf(layers).reduce((sum, part) => sum + part.length, 0);
    if (this.#header.layers === 0 && this.#end !== null) {
      return [{ layers: 0, gaussians: 0, bytes: fileLength(headerLength(0), kept), end: this.#end }];
    }
    return this.#layers.map(({ data, end, allGaussians, bytesBefore }, index) => {
      const header = headerLength(index + 1);
      const layers = bytesBefore + chunkLength(types.layer, data.length);
      return { layers: index + 1, gaussians: allGaussians, bytes: fileLength(header, kept + layers), end };
    });
  }

  /** The file of a prefix. */
  file({ layers, bytes }) {
    const writer = new Writer(bytes);
    writer.chunk(types.header, ...this.#headerOf(layers));
    for (const { type, payload } of this.#kept) writer.chunk(type, payload);
    this.#layers.slice(0, layers).forEach(({ count, data }, index) => {
      const isLast = index === layers - 1;
      writer.chunk(types.layer, isLast ? [] : count, data);
    });
    writer.chunk(types.end);
    return writer.file;
  }
}

/** The small files that the first layers of a file make; see the declarations. */
export function prefixes(bytes) {
  return new Layers(bytes).prefixes;
}

function checkMost(maxBytes) {
  if (typeof maxBytes === 'number' && maxBytes >= 0) return;
  throw new RangeError(`maxBytes is ${String(maxBytes)}; it must be a number from 0 on`);
}

/** The longest of the prefixes of which `count` is at most so many, and says how many `what` has otherwise. */
function longestOf(layers, maxBytes, count, what) {
  const all = layers.prefixes;
  if (all.length === 0) throw new GipError('the file has no complete layer');
  const longest = all.filter((prefix) => prefix[count] <= maxBytes).at(-1);
  if (longest) return longest;
  const least = all[0][count];
  throw new RangeError(`${what} has ${least} bytes; maxBytes is ${maxBytes}, and must be ${least} at least`);
}

/** The longest small file of first layers that fits a number of bytes; see the declarations. */
export function prefix(bytes, maxBytes) {
  checkMost(maxBytes);
  const layers = new Layers(bytes);
  return layers.file(longestOf(layers, maxBytes, 'bytes', 'the file of the first layer'));
}

/** What of a file an element shows before it is fetched; see the declarations. */
export function placeholder(bytes, maxBytes = 400) {
  checkMost(maxBytes);
  const { end } = longestOf(new Layers(bytes), maxBytes, 'end', 'the file up to the first layer');
  return btoa(Array.from(bytes.subarray(0, end), (byte) => String.fromCharCode(byte)).join(''));
}
