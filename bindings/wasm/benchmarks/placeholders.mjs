// What placeholders of a few hundred bytes show. Not a test: prints a table, and writes a sheet of all.
//
//     npm run build && npm install --no-save sharp thumbhash blurhash
//     cargo build --release --manifest-path benchmarks/Cargo.toml
//     node benchmarks/placeholders.mjs FOLDER [COUNT] [FOLDER [COUNT] ...]
//
// Each of the first COUNT (30) pictures of each FOLDER is encoded at 0.5 bits per pixel with a first layer of at most 300 bytes
// by the tool `gip` (the variable GIP, or ../../target/release/gip), whose placeholder is the beginning of that file. WebP and AVIF
// are the largest copies of the picture that take no more bytes. All are shown at an eighth of the picture's size, the
// small ones scaled by a cubic filter, and judged there by SSIMULACRA2. The time is that of the first contentful paint of a page
// with nothing else, in Chromium without a cache, from a server on this machine: what is shown is there at once, so it is
// that of the scripts.

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

import { launch } from '../tests/browser.js';
import { serve } from '../tests/server.js';

/** The pictures of folders, of which each may be followed by how many there are to be. */
function picturesOf(args) {
  const picturesIn = (folder) => {
    const names = readdirSync(folder).filter((name) => name.endsWith('.png'));
    return names.sort().map((name) => join(folder, name));
  };
  const isCount = (text) => /^\d+$/.test(text ?? '');
  return args.flatMap((folder, at) => {
    if (isCount(folder)) return [];
    return picturesIn(folder).slice(0, isCount(args[at + 1]) ? Number(args[at + 1]) : 30);
  });
}

const pictures = picturesOf(process.argv.slice(2));
if (pictures.length === 0) throw new Error('usage: node benchmarks/placeholders.mjs FOLDER [COUNT] [FOLDER [COUNT] ...]');
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

/** A placeholder, and the picture at a size. */
function shown(bytes, size) {
  const decoder = new Decoder();
  decoder.feed(bytes);
  const image = decoder.render(size);
  decoder.close();
  return { content: Buffer.from(bytes), png: scaled(image.data, { ...image, channels: 4 }, size) };
}

/** By kind: what stands in the page, and the picture at a size, of an original. */
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
    return { content: Buffer.from(hash), png: scaled(rgba, { width: w, height: h, channels: 4 }, size) };
  },
  async BlurHash(original, size) {
    const { data, info } = await sharp(original).resize(64, 64, { fit: 'inside' }).ensureAlpha().raw().toBuffer({ resolveWithObject: true });
    const hash = blurhash.encode(new Uint8ClampedArray(data), info.width, info.height, 4, 3);
    const pixels = blurhash.decode(hash, size.width, size.height);
    return { content: Buffer.from(hash), png: scaled(pixels, { ...size, channels: 4 }, size) };
  },
};
for (const format of ['webp', 'avif']) {
  kinds[format] = async (original, size, bytes) => {
    const copy = await smallCopy(original, format, bytes);
    if (!copy) return null;
    return { content: copy, png: sharp(copy).resize({ ...size, fit: 'fill' }).removeAlpha().png() };
  };
}

/** The functions that take a placeholder, its width and its height, and give pixels: a page has those of its kind. */
const decoders = {
  ThumbHash: `import { thumbHashToRGBA } from 'thumbhash';
    export const decode = (text) => thumbHashToRGBA(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)));`,
  BlurHash: `import { decode as pixels } from 'blurhash';
    export const decode = (text, w, h) => ({ w, h, rgba: pixels(atob(text), w, h) });`,
};
const scripts = {};
for (const [kind, contents] of Object.entries(decoders)) {
  const options = { bundle: true, minify: true, format: 'esm', write: false };
  const { outputFiles } = await build({ stdin: { contents, resolveDir: root }, ...options });
  scripts[kind] = outputFiles[0].text;
}

/** The bytes of JavaScript that a page needs, compressed. */
const scriptSize = (kind) => (scripts[kind] ? gzipSync(scripts[kind], { level: 9 }).length : 0);

/** A page of nothing but the placeholder. */
function pageOf(kind, content, { width, height }) {
  const text = content.toString('base64');
  const attributes = `width="${width}" height="${height}" alt=""`;
  if (kind.startsWith('gip')) {
    const script = '<script type="module" src="/dist/gip-image.js"></script>';
    return `${script}<gip-image placeholder="${text}" src="/never" ${attributes}></gip-image>`;
  }
  if (!scripts[kind]) return `<img src="data:image/${kind};base64,${text}" ${attributes}>`;
  return `<script type="module">
    import { decode } from '/${kind}.js';
    const { w, h, rgba } = decode('${text}', ${width}, ${height});
    const canvas = Object.assign(document.createElement('canvas'), { width: w, height: h });
    canvas.getContext('2d').putImageData(new ImageData(new Uint8ClampedArray(rgba), w, h), 0, 0);
    canvas.style.cssText = 'width: ${width}px; height: ${height}px';
    document.body.append(canvas);
  </script>`;
}

const routes = { '/never': () => {} };
for (const [kind, text] of Object.entries(scripts)) {
  routes[`/${kind}.js`] = (_, response) => response.writeHead(200, { 'Content-Type': 'text/javascript' }).end(text);
}
const server = await serve(routes);
const browser = await launch();

/** The time from the request for a page to the first paint of something, in milliseconds. */
async function paintTime(html) {
  routes['/page'] = (_, response) => response.writeHead(200, { 'Content-Type': 'text/html' }).end(`<!doctype html>${html}`);
  const context = await browser.newContext();
  try {
    const page = await context.newPage();
    await page.goto(`${server.origin}/page`, { waitUntil: 'commit' });
    return await page.evaluate(
      () =>
        new Promise((resolve) => {
          const tell = (list) => list.getEntriesByName('first-contentful-paint').forEach(({ startTime }) => resolve(startTime));
          new PerformanceObserver(tell).observe({ type: 'paint', buffered: true });
        }),
    );
  } finally {
    await context.close();
  }
}

await load();
const rows = [];
const scores = Object.fromEntries(Object.keys(kinds).map((name) => [name, { bytes: [], quality: [], time: [], missing: 0 }]));
for (const original of pictures) {
  const { width, height } = await sharp(original).metadata();
  const size = { width: Math.round(width / 8), height: Math.round(height / 8) };
  const [wanted, found] = ['wanted', 'found'].map((file) => join(scratch, file));
  const small = await sharp(original).resize({ ...size, fit: 'fill' }).removeAlpha().png().toBuffer();
  writeFileSync(wanted, await sharp(small).raw().toBuffer());
  const row = [small];
  let allowed = 0;
  for (const [kind, make] of Object.entries(kinds)) {
    const made = await make(original, size, allowed);
    if (kind === 'gip, beginning') allowed = made.content.length;
    if (!made) {
      scores[kind].missing += 1;
      row.push(null);
      continue;
    }
    const png = await made.png.toBuffer();
    writeFileSync(found, await sharp(png).raw().toBuffer());
    scores[kind].bytes.push(made.content.length);
    scores[kind].time.push(await paintTime(pageOf(kind, made.content, size)));
    scores[kind].quality.push(Number(execFileSync(judge, [size.width, size.height, wanted, found])));
    row.push(png);
  }
  rows.push(row);
}
await browser.close();
await server.close();

const mean = (values) => values.reduce((a, b) => a + b, 0) / values.length;
const median = (values) => values.sort((a, b) => a - b)[values.length >> 1];
console.log('placeholder        bytes  in base64  script  paint, ms  SSIMULACRA2  pictures');
for (const [kind, { bytes, quality, time, missing }] of Object.entries(scores)) {
  const cells = bytes.length === 0 ? ['-', '-', '-', '-', '-'] : [
    mean(bytes).toFixed(0).padStart(9),
    mean(bytes.map((size) => 4 * Math.ceil(size / 3))).toFixed(0).padStart(10),
    String(kind.startsWith('gip') ? 'decoder' : scriptSize(kind)).padStart(7),
    median(time).toFixed(0).padStart(10),
    mean(quality).toFixed(1).padStart(12),
  ];
  console.log(`${kind.padEnd(15)}${cells.join(' ')} ${String(rows.length - missing).padStart(9)}`);
}

// The originals and all kinds, a row for each picture, in two columns of rows.
const cell = { width: 96, height: 64 };
const columns = 1 + Object.keys(kinds).length;
const half = Math.ceil(rows.length / 2);
const parts = [];
for (const [at, row] of rows.entries()) {
  for (const [x, png] of row.entries()) {
    if (!png) continue;
    const input = await sharp(png).resize({ ...cell, fit: 'contain', background: '#888' }).toBuffer();
    parts.push({ input, left: (x + (at < half ? 0 : columns)) * cell.width, top: (at % half) * cell.height });
  }
}
const sheet = join(root, 'target', 'placeholders.jpg');
mkdirSync(join(root, 'target'), { recursive: true });
const background = { width: 2 * columns * cell.width, height: half * cell.height, channels: 3, background: '#888' };
await sharp({ create: background }).composite(parts).jpeg({ quality: 70 }).toFile(sheet);
console.log(`the originals, ${Object.keys(kinds).join(', ')}: ${sheet}`);
rmSync(scratch, { recursive: true });
