// Signature, chunks and numbers of a file, read and written (spec, sections 2 and 4).

import { crc32 } from './crc32.js';
import { MalformedError, SignatureError, UnsupportedError } from './errors.js';

/** The types of chunks that are known here. */
export const types = {
  header: 'H',
  layer: 'L',
  end: 'E',
  colorSpace: 'cICP',
  masteringDisplay: 'mDCV',
  contentLight: 'cLLI',
  iccProfile: 'iCCP',
  exif: 'eXIF',
};

const signature = Uint8Array.of(0xc7, 0x47, 0x49, 0x50, 0x0d, 0x0a, 0x01, 0x0a);
const versionAt = 6;
const crcLength = 4;
const mostPayload = 2 ** 31 - 1;

export const malformed = (type, reason) => new MalformedError(`chunk ${type}: ${reason}`, 'malformed', type);
export const unsupported = (type, what) =>
  new UnsupportedError(`chunk ${type}: unsupported: ${what}`, 'unsupported', type);

/** Takes numbers from bytes. The chunk is the one that errors name. */
export class Cursor {
  constructor(bytes, chunk, at = 0) {
    Object.assign(this, { bytes, chunk, at });
  }

  /** A number of one to five bytes; `null` if the bytes end before it does. */
  number() {
    let value = 0;
    for (let unit = 1; this.at < this.bytes.length; unit *= 128) {
      const byte = this.bytes[this.at];
      this.at += 1;
      // The fifth byte has the four highest bits.
      if (unit === 2 ** 28 && byte > 15) throw malformed(this.chunk, 'a number of more than 32 bits');
      if (unit > 1 && byte === 0) throw malformed(this.chunk, 'a number with more bytes than it needs');
      value += (byte % 128) * unit;
      if (byte < 128) return value;
    }
    return null;
  }
}

/** A number in one to five bytes. */
export function numberBytes(value) {
  const bytes = [];
  for (; value > 127; value = Math.floor(value / 128)) bytes.push((value % 128) + 128);
  return [...bytes, value];
}

/** The bytes of a chunk with a payload of this length. */
export const chunkLength = (type, length) =>
  type.length + numberBytes(length).length + length + crcLength;

/** The bytes of a file whose chunks between the header and the end have so many. */
export const fileLength = (header, others) =>
  signature.length + chunkLength(types.header, header) + others + chunkLength(types.end, 0);

function checkSignature(bytes) {
  const wrong = signature.findIndex((byte, at) => at < bytes.length && byte !== bytes[at]);
  if (wrong === versionAt) throw unsupported(types.header, `version ${bytes[versionAt]}`);
  if (wrong >= 0) throw new SignatureError('not a .gip file: the signature does not match', 'signature');
}

/** The type of the chunk that begins here; `null` if the bytes end before it does. */
function typeAt(bytes, at) {
  const isAncillary = bytes[at] >= 0x61 && bytes[at] <= 0x7a;
  const letters = bytes.subarray(at, at + (isAncillary ? 4 : 1));
  if (letters.length < (isAncillary ? 4 : 1)) return null;
  const type = String.fromCharCode(...letters);
  const hexadecimal = (letter) => `\\x${letter.charCodeAt(0).toString(16).padStart(2, '0')}`;
  const shown = type.replace(/[^A-Za-z]/g, hexadecimal);
  if (shown !== type) throw malformed(shown, 'the type is not of letters');
  return type;
}

/**
 * The chunks of a file, or of the beginning of one, that are complete: type, payload, and where the chunk ends. The
 * last one is the end of the file, if that is there.
 */
export function* chunksOf(bytes) {
  checkSignature(bytes);
  for (let at = signature.length; ; ) {
    const type = typeAt(bytes, at);
    if (type === null) return;
    const cursor = new Cursor(bytes, type, at + type.length);
    const length = cursor.number();
    if (length === null) return;
    if (length > mostPayload) throw malformed(type, 'the length is over 2^31 - 1');
    const payloadEnd = cursor.at + length;
    const end = payloadEnd + crcLength;
    if (end > bytes.length) return;
    const stored = new DataView(bytes.buffer, bytes.byteOffset + payloadEnd).getUint32(0, true);
    if (stored !== crc32(bytes.subarray(at, payloadEnd))) throw malformed(type, 'the CRC does not match');
    yield { type, payload: bytes.subarray(cursor.at, payloadEnd), end };
    if (type === types.end) return;
    at = end;
  }
}

/** Writes a file of a known length chunk by chunk. */
export class Writer {
  #at = 0;

  constructor(length) {
    this.file = new Uint8Array(length);
    this.#append(signature);
  }

  /** Appends a chunk, whose payload is these parts. */
  chunk(type, ...parts) {
    const start = this.#at;
    const length = parts.reduce((sum, part) => sum + part.length, 0);
    this.#append([...type].map((letter) => letter.charCodeAt(0)));
    for (const part of [numberBytes(length), ...parts]) this.#append(part);
    const crc = crc32(this.file.subarray(start, this.#at));
    new DataView(this.file.buffer).setUint32(this.#at, crc, true);
    this.#at += crcLength;
  }

  #append(bytes) {
    this.file.set(bytes, this.#at);
    this.#at += bytes.length;
  }
}
