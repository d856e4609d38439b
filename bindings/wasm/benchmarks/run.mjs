// What the package costs and how fast it is. Not a test: prints figures.
//
//     npm run build && npm install --no-save sharp
//     cargo build --release --manifest-path benchmarks/Cargo.toml
//     node benchmarks/run.mjs FOLDER [COUNT]
//
// The first COUNT (6) pictures of FOLDER are encoded at 0.5 bits per pixel by the tool `gip` (the variable
// GIP, or ../../target/release/gip), and as WebP and AVIF with the most bytes that are not more. All
// decoders take turns in one run.

import { execFileSync, spawn } from 'node:child_process';
import { existsSync, mkdirSync, readFileSync, readdirSync } from 'node:fs';
import { join } from 'node:path';
import { createInterface } from 'node:readline';
import { fileURLToPath } from 'node:url';
import { brotliCompressSync, gzipSync } from 'node:zlib';

import sharp from 'sharp';

import { launch } from '../tests/browser.js';
import { serve, slow } from '../tests/server.js';

const root = fileURLToPath(new URL('..', import.meta.url));
const [folder, count = 6] = process.argv.slice(2);
if (folder === undefined) throw new Error('usage: node benchmarks/run.mjs FOLDER [COUNT]');
const rounds = 60;

function printSizes() {
  console.log('sizes in bytes         plain     gzip   brotli');
  const row = (name, bytes) => {
    const numbers = [bytes.length, gzipSync(bytes, { level: 9 }).length, brotliCompressSync(bytes).length];
    console.log(name.padEnd(20) + numbers.map((number) => String(number).padStart(9)).join(''));
    return numbers;
  };
  // What a page loads that shows pictures.
  const isLoaded = (file) => /\.(js|wasm)$/.test(file) && !/encoder|service-worker|transparent/.test(file);
  const files = readdirSync(join(root, 'dist')).filter(isLoaded);
  const all = files.map((file) => row(file, readFileSync(join(root, 'dist', file))));
  const sums = all.reduce((a, b) => a.map((value, at) => value + b[at]));
  console.log('all'.padEnd(20) + sums.map((number) => String(number).padStart(9)).join(''));
}

/** The file of a picture. It is kept for the next run. */
function encode(name) {
  const place = join(root, 'target', 'benchmark');
  mkdirSync(place, { recursive: true });
  const file = join(place, `${name}.gip`);
  if (!existsSync(file)) {
    const gip = process.env.GIP ?? join(root, '../../target/release/gip');
    execFileSync(gip, ['encode', '--bpp', '0.5', join(folder, name), file]);
  }
  return file;
}

/** The encoding of a picture with the most bytes that are at most `bytes`. */
async function ofSize(name, bytes, encoded) {
  let [low, high, best] = [1, 100, null];
  while (low <= high) {
    const quality = (low + high) >> 1;
    const found = await encoded(sharp(join(folder, name)), quality).toBuffer();
    if (found.length <= bytes) [best, low] = [found, quality + 1];
    else high = quality - 1;
  }
  return best;
}

/** A native decoder of a file on one thread: a function that gives milliseconds. */
function nativeDecoder(file) {
  const program = spawn(join(root, 'benchmarks/target/release/native'), [file]);
  const lines = createInterface({ input: program.stdout })[Symbol.asyncIterator]();
  return {
    async time() {
      program.stdin.write('\n');
      return Number((await lines.next()).value) / 1e6;
    },
    end: () => program.stdin.end(),
  };
}

const least = (times) => Math.min(...times);
const median = (times) => times.toSorted((a, b) => a - b)[times.length >> 1];

async function printTimes(page, server, names) {
  console.log(`\nleast of ${rounds} times in ms, and in parentheses the first one of the page`);
  console.log('picture            bytes   native   same thread     in a worker     WebP     AVIF   ratio');
  const all = [];
  for (const name of names) {
    const file = encode(name);
    const gip = readFileSync(file);
    const webp = await ofSize(name, gip.length, (image, quality) => image.webp({ quality, effort: 6 }));
    const avif = await ofSize(name, gip.length, (image, quality) => image.avif({ quality, effort: 4 }));
    const files = { gip, webp, avif };
    for (const [kind, bytes] of Object.entries(files)) {
      server.routes[`/file.${kind}`] = (_, response) => response.end(bytes);
    }
    await page.goto(`${server.origin}/page`);
    await page.evaluate(async () => {
      const { Decoder, load } = await import('/dist/core.js');
      const { decode } = await import('/dist/index.js');
      await load();
      const bytes = async (kind) => new Uint8Array(await (await fetch(`/file.${kind}`)).arrayBuffer());
      const gip = await bytes('gip');
      const blobs = {
        webp: new Blob([await bytes('webp')], { type: 'image/webp' }),
        avif: new Blob([await bytes('avif')], { type: 'image/avif' }),
      };
      const timed = async (run) => {
        const start = performance.now();
        await run();
        return performance.now() - start;
      };
      const browser = async (blob) => (await createImageBitmap(blob)).close();
      globalThis.round = async () => ({
        same: await timed(() => {
          const decoder = new Decoder();
          decoder.feed(gip);
          decoder.render();
          decoder.close();
        }),
        worker: await timed(() => decode(gip)),
        webp: await timed(() => browser(blobs.webp)),
        avif: await timed(() => browser(blobs.avif)),
      });
    });
    const native = nativeDecoder(file);
    const times = { native: [], same: [], worker: [], webp: [], avif: [] };
    for (let round = 0; round < rounds; round += 1) {
      times.native.push(await native.time());
      for (const [kind, time] of Object.entries(await page.evaluate(() => globalThis.round()))) {
        times[kind].push(time);
      }
    }
    native.end();
    const best = Object.fromEntries(Object.entries(times).map(([kind, list]) => [kind, least(list)]));
    const cell = (value, width = 9) => value.toFixed(2).padStart(width);
    const first = (kind) => `${cell(best[kind], 8)} (${times[kind][0].toFixed(0)})`.padStart(16);
    const ratio = best.same / best.native;
    all.push({ ...best, ratio });
    console.log(
      `${name.padEnd(16)}${String(gip.length).padStart(8)}${cell(best.native)}${first('same')}` +
        `${first('worker')}${cell(best.webp)}${cell(best.avif)}${cell(ratio, 8)}`,
    );
  }
  const ratios = all.map(({ ratio }) => ratio);
  console.log(
    `same thread / native: median ${median(ratios).toFixed(2)}, ` +
      `${Math.min(...ratios).toFixed(2)} to ${Math.max(...ratios).toFixed(2)}`,
  );
  for (const kind of ['webp', 'avif']) {
    const others = all.map((times) => times.same / times[kind]);
    console.log(`same thread / ${kind}: median ${median(others).toFixed(2)}`);
  }
}

async function printTransfers(page, server, names) {
  console.log('\nbytes sent for a display, of a server that sends 1460 bytes each 20 ms');
  console.log('picture            bytes      1/8      1/4      1/1');
  for (const name of names) {
    const bytes = readFileSync(encode(name));
    const cells = [];
    for (const part of [8, 4, 1]) {
      const { route, log } = slow(bytes, { piece: 1460, interval: 20 });
      server.routes['/slow.gip'] = route;
      await page.goto(`${server.origin}/page`);
      await page.evaluate(async (part) => {
        await import('/dist/gip-image.js');
        const { width } = (await (await import('/dist/index.js')).open('/file.gip')).header;
        const image = document.createElement('gip-image');
        image.width = Math.round(width / part);
        image.src = '/slow.gip';
        document.body.append(image);
        await image.decode();
      }, part);
      while (log.open > 0) await new Promise((resolve) => setTimeout(resolve, 20));
      cells.push(log.sent);
    }
    const shown = cells.map((sent) => `${((100 * sent) / bytes.length).toFixed(0)} %`.padStart(9));
    console.log(`${name.padEnd(16)}${String(bytes.length).padStart(8)}${shown.join('')}`);
  }
}

printSizes();
const names = readdirSync(folder).filter((name) => name.endsWith('.png')).slice(0, count);
const server = await serve();
// With these, the clock of a page counts in steps of 5 microseconds.
const isolated = {
  'Content-Type': 'text/html',
  'Cross-Origin-Opener-Policy': 'same-origin',
  'Cross-Origin-Embedder-Policy': 'require-corp',
};
server.routes['/page'] = (_, response) => {
  response.writeHead(200, isolated);
  response.end('<!doctype html><title>benchmark</title>');
};
const browser = await launch();
const page = await browser.newPage();
await printTimes(page, server, names);
server.routes['/file.gip'] = (_, response) => response.end(readFileSync(encode(names[0])));
await printTransfers(page, server, names);
await browser.close();
await server.close();
