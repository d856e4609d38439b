// How much threads speed up the encoder, as WebAssembly and in the tool `gip`. Not a test: prints figures.
//
//     npm run build && npm install --no-save sharp
//     node benchmarks/threads.mjs FOLDER [COUNT] [EFFORT...]
//
// The first COUNT (6) pictures of FOLDER are encoded at 0.5 bits per pixel at each EFFORT (1, 2 and 4) with 1, 2, 4, ... threads,
// as many as there are cores, by turns by the tool (the variable GIP, or ../../target/release/gip) and in Node.js. The times are
// medians of three rounds.

import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readdirSync, rmSync } from 'node:fs';
import { availableParallelism, tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';

import sharp from 'sharp';

import { encode } from 'image-gip/encoder';

const [folder, most = 6, ...given] = process.argv.slice(2);
if (folder === undefined) throw new Error('usage: node benchmarks/threads.mjs FOLDER [COUNT] [EFFORT...]');
const efforts = given.length > 0 ? given.map(Number) : [1, 2, 4];
const gip = process.env.GIP ?? fileURLToPath(new URL('../../../target/release/gip', import.meta.url));
const rounds = 3;
const counts = [1];
while (2 * counts.at(-1) <= availableParallelism()) counts.push(2 * counts.at(-1));

const scratch = mkdtempSync(join(tmpdir(), 'image-gip-'));
const output = join(scratch, 'picture.gip');
const mean = (values) => values.reduce((a, b) => a + b, 0) / values.length;
const median = (values) => values.sort((a, b) => a - b)[values.length >> 1];
const seconds = (value) => `${value.toFixed(2)} s`.padStart(10);

function native(name, effort, threads) {
  const options = ['encode', join(folder, name), output, '--bpp', '0.5', '--effort', String(effort)];
  return JSON.parse(execFileSync(gip, [...options, '--threads', String(threads), '--json'])).seconds;
}

async function wasm(image, effort, threads, files) {
  const start = performance.now();
  const { file } = await encode(image, { bpp: 0.5, effort, threads });
  files.push(file);
  return (performance.now() - start) / 1000;
}

for (const effort of efforts) {
  const columns = ['gip', 'wasm'].flatMap((kind) => counts.map((threads) => ({ kind, threads, times: [], all: [] })));
  console.log(`effort ${effort}`.padEnd(14) + columns.map(({ kind, threads }) => `${kind} ${threads}`.padStart(10)).join(''));
  for (const name of readdirSync(folder).filter((name) => name.endsWith('.png')).slice(0, Number(most))) {
    const { data, info } = await sharp(join(folder, name)).raw().toBuffer({ resolveWithObject: true });
    const image = { width: info.width, height: info.height, channels: info.channels, data: new Uint8Array(data) };
    const files = [];
    // Workers that are there already are those that a page has after its first picture.
    for (const threads of counts) await wasm({ ...image, height: 16, data: image.data.subarray(0, 16 * info.width * info.channels) }, 1, threads, []);
    for (let round = 0; round < rounds; round += 1) {
      for (const { kind, threads, times } of columns) {
        times.push(kind === 'gip' ? native(name, effort, threads) : await wasm(image, effort, threads, files));
      }
    }
    for (const file of files) assert.deepEqual(file, files[0]);
    for (const column of columns) {
      column.all.push(median(column.times));
      column.times = [];
    }
    console.log(name.padEnd(14) + columns.map(({ all }) => seconds(all.at(-1))).join(''));
  }
  console.log('mean'.padEnd(14) + columns.map(({ all }) => seconds(mean(all))).join(''));
  const first = (kind) => columns.find((column) => column.kind === kind);
  const speedups = columns.map(({ kind, all }) => mean(all.map((time, at) => first(kind).all[at] / time)).toFixed(2).padStart(10));
  console.log('times as fast'.padEnd(14) + speedups.join(''));
}
rmSync(scratch, { recursive: true });
