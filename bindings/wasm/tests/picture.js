// Pictures for the tests, in the packed coding with floats: what the specification says of it in a few
// lines, so that the tests need no encoder.

import { crc32 } from './vectors.js';

function chunk(type, payload) {
  const body = Buffer.concat([Buffer.from(type, 'latin1'), payload]);
  const out = Buffer.alloc(body.length + 8);
  out.writeUInt32LE(payload.length, 0);
  body.copy(out, 4);
  out.writeUInt32LE(crc32(body), out.length - 4);
  return out;
}

/** Exif data with an orientation, 1 to 8, as the chunk `['eXIf', exif(6)]`. */
export function exif(orientation) {
  const bytes = Buffer.from('4d4d002a00000008000101120003000000010000000000000000', 'hex');
  bytes.writeUInt16BE(orientation, 18);
  return bytes;
}

/**
 * A texture for pictures of 96 x 64 pixels, in all octaves and directions, as the chunk `['tXTR', texture]`
 * (spec, section 5.7).
 */
export const texture = Buffer.from('cdcc4c3d0500000016cf390289de2efaff32b0f962893d665ac3fc6f284695d15f64d4820c80c6b1a77bb2d580dec560', 'hex');

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

/**
 * A picture of random spots, in layers of `layers` Gaussians each: from large and faint to small.
 * `chunks` are ancillary chunks such as `['iCCP', bytes]`.
 */
export function makePicture({ width = 96, height = 64, layers = [200], chunks = [], seed = 1 } = {}) {
  const next = random(seed);
  const count = layers.reduce((sum, layer) => sum + layer, 0);
  const header = Buffer.alloc(36);
  header.set([1, 0, 2, 8]);
  header.writeUInt32LE(width, 4);
  header.writeUInt32LE(height, 8);
  header.writeUInt32LE(count, 12);
  header.writeUInt16LE(layers.length, 16);
  header.set([1, 1], 18);
  header.writeFloatLE(4, 20);
  header.writeUInt16LE(30000, 28);
  header.writeUInt16LE(32000, 30);
  header.writeUInt16LE(34000, 32);

  const float = Buffer.alloc(12);
  float.set([0, 32]);
  float.writeFloatLE(1, 4);

  const gaus = layers.map((gaussians, layer) => {
    const side = (Math.max(width, height) / 4) * 0.6 ** layer;
    const payload = Buffer.alloc(4 + gaussians * 32);
    payload.writeUInt32LE(gaussians);
    for (let i = 0; i < gaussians; i += 1) {
      const size = () => 0.5 + next() * side;
      const color = () => (next() - 0.5) * 0.3;
      const values = [next() * width, next() * height, size(), (next() - 0.5) * side, size()];
      [...values, color(), color(), color()].forEach((value, component) => {
        payload.writeFloatLE(value, 4 + i * 32 + component * 4);
      });
    }
    return chunk('GAUS', payload);
  });
  return Buffer.concat([
    Buffer.from([0xc7, 0x47, 0x49, 0x50, 0x0d, 0x0a, 0x1a, 0x0a]),
    chunk('GHDR', header),
    ...chunks.map(([type, payload]) => chunk(type, payload)),
    chunk('QNTZ', Buffer.concat(Array(8).fill(float))),
    ...gaus,
    chunk('GEND', Buffer.alloc(0)),
  ]);
}
