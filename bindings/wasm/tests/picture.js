// Pictures for the tests, in the packed coding with floats: what the specification says of it in a few
// lines, so that the tests need no encoder.

import { crc32 } from './vectors.js';

/** A number of one to five bytes (spec, section 2). */
function number(value) {
  const bytes = [];
  for (; value > 127; value = Math.floor(value / 128)) bytes.push((value % 128) + 128);
  return Buffer.from([...bytes, value]);
}

/** A chunk (spec, section 4.2). */
export function chunk(type, payload) {
  const out = Buffer.concat([Buffer.from(type, 'latin1'), number(payload.length), payload, Buffer.alloc(4)]);
  out.writeUInt32LE(crc32(out.subarray(0, -4)), out.length - 4);
  return out;
}

/** Exif data with an orientation, 1 to 8, as the chunk `['eXIF', exif(6)]`. */
export function exif(orientation) {
  const bytes = Buffer.from('4d4d002a00000008000101120003000000010000000000000000', 'hex');
  bytes.writeUInt16BE(orientation, 18);
  return bytes;
}

/**
 * A texture for pictures of 96 x 64 pixels, in all octaves and directions, as the chunk `['tXTR', texture]`
 * (spec, section 5.7).
 */
export const texture = Buffer.from('cd7c05073c01003cfb0c06a350f5cc05f66f8f1f9010e87f89cc587d9008fd25020f00acd0a7d15a348c85c560', 'hex');

/** By Exif's values: where a place of a picture of this size, as stored, is in the upright one. */
export const turns = (width, height) => ({
  1: ([x, y]) => [x, y],
  2: ([x, y]) => [width - x, y],
  3: ([x, y]) => [width - x, height - y],
  4: ([x, y]) => [x, height - y],
  5: ([x, y]) => [y, x],
  6: ([x, y]) => [height - y, x],
  7: ([x, y]) => [height - y, width - x],
  8: ([x, y]) => [y, width - x],
});

/** A PNG file with Exif data. */
export function withExif(png, exif) {
  const body = Buffer.concat([Buffer.from('eXIf'), exif]);
  const chunk = Buffer.alloc(4 + body.length + 4);
  chunk.writeUInt32BE(exif.length);
  body.copy(chunk, 4);
  chunk.writeUInt32BE(crc32(body), 4 + body.length);
  // After the signature and the header.
  return Buffer.concat([png.subarray(0, 33), chunk, png.subarray(33)]);
}

/** Random numbers from 0 to 1, the same in every run. */
function random(seed) {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}

/** The first eight bytes of a file. */
export const signature = Buffer.from([0xc7, 0x47, 0x49, 0x50, 0x0d, 0x0a, 0x01, 0x0a]);

/** The bytes of a chunk without payload, such as the last one of a file. */
export const leastChunk = chunk('E', Buffer.alloc(0)).length;

/**
 * A picture of random spots, in layers of `layers` Gaussians each: from large and faint to small.
 * `chunks` are ancillary chunks such as `['iCCP', bytes]`, and `later` those that stand after so many layers, such
 * as `[1, 'iCCP', bytes]`.
 */
export function makePicture(options = {}) {
  const { width = 96, height = 64, layers = [200], chunks = [], later = [], seed = 1 } = options;
  const next = random(seed);
  const count = layers.reduce((sum, layer) => sum + layer, 0);
  const numbers = [width, height, count, ...(count > 0 ? [layers.length] : [])];
  // RGB, the quartic kernel, and l11, l21, l22 in the packed coding.
  const format = 2 + 16 + 32;
  const base = [117, 125, 132];
  // Kind 0, of 32 bits.
  const floats = count > 0 ? Array(8).fill([0, 32]).flat() : [];
  const header = [Buffer.from([format]), ...numbers.map(number), Buffer.from([...base, ...floats])];

  const after = (layer) =>
    later.filter(([place]) => place === layer).map(([, type, payload]) => chunk(type, payload));
  const body = layers.flatMap((gaussians, layer) => {
    const side = (Math.max(width, height) / 4) * 0.6 ** layer;
    const codes = Buffer.alloc(gaussians * 32);
    for (let i = 0; i < gaussians; i += 1) {
      const size = () => 0.5 + next() * side;
      const color = () => (next() - 0.5) * 0.3;
      const values = [next() * width, next() * height, size(), (next() - 0.5) * side, size()];
      [...values, color(), color(), color()].forEach((value, component) => {
        codes.writeFloatLE(value, i * 32 + component * 4);
      });
    }
    const isLast = layer === layers.length - 1;
    const payload = isLast ? codes : Buffer.concat([number(gaussians), codes]);
    return [chunk('L', payload), ...after(layer + 1)];
  });
  return Buffer.concat([
    signature,
    chunk('H', Buffer.concat(header)),
    ...chunks.map(([type, payload]) => chunk(type, payload)),
    ...body,
    chunk('E', Buffer.alloc(0)),
  ]);
}
