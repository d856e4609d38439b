// What placeholders of a few hundred bytes show. Not a test: prints a table, and writes a sheet of all.
//
//     npm run build && npm install --no-save sharp thumbhash blurhash
//     cargo build --release --manifest-path benchmarks/Cargo.toml
//     node benchmarks/placeholders.mjs FOLDER [COUNT]
//
// Each of the first COUNT (30) pictures of FOLDER is encoded at 0.5 bits per pixel with a first layer of at most 300 bytes by the
// tool `gip` (the variable GIP, or ../../target/release/gip), whose placeholder is the beginning of that file. WebP and AVIF
// are the largest copies of the picture that take no more bytes. All are shown at an eighth of the picture's size, the
// small ones scaled by a cubic filter, and judged there by SSIMULACRA2.

import { execFileSync } from 'node:child_process';
import { mkdirSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { gzipSync } from 'node:zlib';

import * as blurhash from 'blurhash';
import { build } from 'esbuild';
import sharp from 'sharp';
import * as thumbhash from 'thumbhash';

import { Decoder, load } from 'image-gip/core';
import { placeholder } from 'image-gip/prefix';

const [folder, count = 30] = process.argv.slice(2);
if (folder === undefined) throw new Error('usage: node benchmarks/placeholders.mjs FOLDER [COUNT]');
const root = fileURLToPath(new URL('..', import.meta.url));
const gip = process.env.GIP ?? join(root, '../../target/release/gip');
const judge = join(root, 'benchmarks/target/release/quality');
const scratch = mkdtempSync(join(tmpdir(), 'image-gip-'));
const most = 400;

/** Pixels of a raw picture as PNG, scaled to a size. */
const scaled = (data, { width, height, channels }, size) =>
  sharp(Buffer.from(data), { raw: { width, height, channels } }).resize({ ...size, fit: 'fill' }).removeAlpha().png();

/** The largest copy of a picture that takes at most so many bytes. */
async function smallCopy(original, format, bytes) {
  let best = null;
  for (const side of [6, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48]) {
    for (const quality of [20, 40, 60]) {
      const copy = await sharp(original).resize(side, side, { fit: 'inside' }).toFormat(format, { quality, effort: 4 }).toBuffer();
      if (copy.length <= bytes) best = copy;
    }
  }
  return best;
}

/** What the tool encodes with some options. */
function encoded(original, ...options) {
  const file = join(scratch, 'picture.gip');
  execFileSync(gip, ['encode', original, file, ...options]);
  return new Uint8Array(readFileSync(file));
}

/** The bytes of a placeholder, and the picture at a size. */
function shown(bytes, size) {
  const decoder = new Decoder();
  decoder.feed(bytes);
  const image = decoder.render(size);
  decoder.close();
  return { bytes: bytes.length, png: scaled(image.data, { ...image, channels: 4 }, size) };
}

/** By kind: the bytes that stand in the page, and the picture at a size, of an original. */
const kinds = {
  'gip, beginning': async (original, size) => {
    const file = encoded(original, '--bpp', '0.5', '--effort', '2', '--first-layer', '300');
    return shown(new Uint8Array(Buffer.from(placeholder(file, most), 'base64')), size);
  },
  'gip, own file': async (original, size, bytes) => shown(encoded(original, '--bytes', String(bytes)), size),
  async ThumbHash(original, size) {
    const { data, info } = await sharp(original).resize(100, 100, { fit: 'inside' }).ensureAlpha().raw().toBuffer({ resolveWithObject: true });
    const hash = thumbhash.rgbaToThumbHash(info.width, info.height, data);
    const { w, h, rgba } = thumbhash.thumbHashToRGBA(hash);
    return { bytes: hash.length, png: scaled(rgba, { width: w, height: h, channels: 4 }, size) };
  },
  async BlurHash(original, size) {
    const { data, info } = await sharp(original).resize(64, 64, { fit: 'inside' }).ensureAlpha().raw().toBuffer({ resolveWithObject: true });
    const hash = blurhash.encode(new Uint8ClampedArray(data), info.width, info.height, 4, 3);
    const pixels = blurhash.decode(hash, size.width, size.height);
    return { bytes: hash.length, png: scaled(pixels, { ...size, channels: 4 }, size) };
  },
};
for (const format of ['webp', 'avif']) {
  kinds[format] = async (original, size, bytes) => {
    const copy = await smallCopy(original, format, bytes);
    if (!copy) return null;
    return { bytes: copy.length, png: sharp(copy).resize({ ...size, fit: 'fill' }).removeAlpha().png() };
  };
}

/** The bytes of JavaScript that a page needs, compressed. */
async function scriptOf(name) {
  const modules = { ThumbHash: 'export { thumbHashToRGBA } from "thumbhash"', BlurHash: 'export { decode } from "blurhash"' };
  if (!modules[name]) return 0;
  const stdin = { contents: modules[name], resolveDir: root };
  const { outputFiles } = await build({ stdin, bundle: true, minify: true, format: 'esm', write: false });
  return gzipSync(outputFiles[0].contents, { level: 9 }).length;
}

await load();
const rows = [];
const scores = Object.fromEntries(Object.keys(kinds).map((name) => [name, { bytes: [], quality: [], missing: 0 }]));
for (const name of readdirSync(folder).filter((name) => name.endsWith('.png')).slice(0, Number(count))) {
  const original = join(folder, name);
  const { width, height } = await sharp(original).metadata();
  const size = { width: Math.round(width / 8), height: Math.round(height / 8) };
  const [wanted, found] = ['wanted', 'found'].map((file) => join(scratch, file));
  const small = await sharp(original).resize({ ...size, fit: 'fill' }).removeAlpha().png().toBuffer();
  writeFileSync(wanted, await sharp(small).raw().toBuffer());
  const row = [small];
  let allowed = 0;
  for (const [kind, make] of Object.entries(kinds)) {
    const made = await make(original, size, allowed);
    if (kind === 'gip, beginning') allowed = made.bytes;
    if (!made) {
      scores[kind].missing += 1;
      row.push(null);
      continue;
    }
    const png = await made.png.toBuffer();
    writeFileSync(found, await sharp(png).raw().toBuffer());
    scores[kind].bytes.push(made.bytes);
    scores[kind].quality.push(Number(execFileSync(judge, [size.width, size.height, wanted, found])));
    row.push(png);
  }
  rows.push(row);
}

const mean = (values) => values.reduce((a, b) => a + b, 0) / values.length;
console.log('placeholder        bytes  in base64  script  SSIMULACRA2  pictures');
for (const [kind, { bytes, quality, missing }] of Object.entries(scores)) {
  const cells = bytes.length === 0 ? ['-', '-', '-', '-'] : [
    mean(bytes).toFixed(0).padStart(9),
    mean(bytes.map((size) => 4 * Math.ceil(size / 3))).toFixed(0).padStart(10),
    String(kind.startsWith('gip') ? 'decoder' : await scriptOf(kind)).padStart(7),
    mean(quality).toFixed(1).padStart(12),
  ];
  console.log(`${kind.padEnd(15)}${cells.join(' ')} ${String(rows.length - missing).padStart(9)}`);
}

// The originals and all kinds, a row for each picture.
const cell = { width: 192, height: 128 };
const parts = [];
for (const [y, row] of rows.entries()) {
  for (const [x, png] of row.entries()) {
    if (!png) continue;
    const input = await sharp(png).resize({ ...cell, fit: 'contain', background: '#888' }).toBuffer();
    parts.push({ input, left: x * cell.width, top: y * cell.height });
  }
}
const sheet = join(root, 'target', 'placeholders.png');
mkdirSync(join(root, 'target'), { recursive: true });
const background = { width: cell.width * (1 + Object.keys(kinds).length), height: cell.height * rows.length, channels: 3, background: '#888' };
await sharp({ create: background }).composite(parts).png().toFile(sheet);
console.log(`the originals, ${Object.keys(kinds).join(', ')}: ${sheet}`);
rmSync(scratch, { recursive: true });
