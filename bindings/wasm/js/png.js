// PNG files without compression. Browsers convert their colours by the colour space inside, so that this
// package needs no code for that.

import { crc32 } from './crc32.js';

const colorTypes = { gray: 0, 'gray-alpha': 4, rgb: 2, rgba: 6 };

function adler32(bytes) {
  let [a, b] = [1, 0];
  for (let at = 0; at < bytes.length; ) {
    // So many can be added before the sums leave the integers of 32 bits.
    const end = Math.min(bytes.length, at + 3800);
    for (; at < end; at += 1) b += a += bytes[at];
    a %= 65521;
    b %= 65521;
  }
  return b * 65536 + a;
}

/** A zlib stream of stored blocks. */
function stored(bytes) {
  const most = 65535;
  const blocks = Math.max(1, Math.ceil(bytes.length / most));
  const out = new Uint8Array(2 + 5 * blocks + bytes.length + 4);
  const view = new DataView(out.buffer);
  view.setUint16(0, 0x7801);
  let at = 2;
  for (let block = 0; block < blocks; block += 1) {
    const part = bytes.subarray(block * most, (block + 1) * most);
    out[at] = block === blocks - 1 ? 1 : 0;
    view.setUint16(at + 1, part.length, true);
    view.setUint16(at + 3, ~part.length, true);
    out.set(part, at + 5);
    at += 5 + part.length;
  }
  view.setUint32(at, adler32(bytes));
  return out;
}

function chunk(type, payload) {
  const out = new Uint8Array(12 + payload.length);
  const view = new DataView(out.buffer);
  view.setUint32(0, payload.length);
  for (let i = 0; i < 4; i += 1) out[4 + i] = type.charCodeAt(i);
  out.set(payload, 8);
  view.setUint32(8 + payload.length, crc32(out.subarray(4, 8 + payload.length)));
  return out;
}

function joined(parts) {
  const out = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    out.set(part, at);
    at += part.length;
  }
  return out;
}

/** A PNG file of 8-bit samples, as `Decoder.samples` gives them, with what the metadata say of their colours. */
export function encodePng({ width, height, channels, color, data }, metadata) {
  const { cicp, masteringDisplay, contentLight, iccProfile } = metadata;
  const header = new Uint8Array(13);
  const view = new DataView(header.buffer);
  view.setUint32(0, width);
  view.setUint32(4, height);
  header.set([8, colorTypes[color], 0, 0, 0], 8);

  // Each row begins with its filter: none.
  const row = width * channels;
  const rows = new Uint8Array(height * (row + 1));
  for (let y = 0; y < height; y += 1) {
    rows.set(data.subarray(y * row, (y + 1) * row), y * (row + 1) + 1);
  }

  const signature = Uint8Array.of(0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a);
  const parts = [signature, chunk('IHDR', header)];
  // Without a matrix, in full range.
  if (cicp) parts.push(chunk('cICP', [...cicp, 0, 1]));
  if (masteringDisplay) parts.push(chunk('mDCV', masteringDisplay));
  if (contentLight) parts.push(chunk('cLLI', contentLight));
  if (iccProfile) {
    // A name, its end, and the only method of compression.
    const name = Uint8Array.of(0x49, 0x43, 0x43, 0, 0);
    parts.push(chunk('iCCP', joined([name, stored(iccProfile)])));
  }
  parts.push(chunk('IDAT', stored(rows)), chunk('IEND', new Uint8Array()));
  return joined(parts);
}
