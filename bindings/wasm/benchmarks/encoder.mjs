// How fast the encoder is, and how good its files are, against the tool `gip` on one thread. Not a test: prints figures.
//
//     npm run build && npm install --no-save sharp
//     node benchmarks/encoder.mjs FOLDER [COUNT] [EFFORT...]
//
// The first COUNT (6) pictures of FOLDER are encoded at 0.5 bits per pixel at each EFFORT (1 and 2), by turns by the tool (the
// variable GIP, or ../../target/release/gip) and in Node.js, whose WebAssembly is that of Chromium.

import { execFileSync } from 'node:child_process';
import { mkdtempSync, readdirSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';

import sharp from 'sharp';

import { encode, load } from 'image-gip/encoder/core';

const [folder, count = 6, ...given] = process.argv.slice(2);
if (folder === undefined) throw new Error('usage: node benchmarks/encoder.mjs FOLDER [COUNT] [EFFORT...]');
const efforts = given.length > 0 ? given.map(Number) : [1, 2];
const gip = process.env.GIP ?? fileURLToPath(new URL('../../../target/release/gip', import.meta.url));
const rounds = 3;

await load();
const scratch = mkdtempSync(join(tmpdir(), 'image-gip-'));
const output = join(scratch, 'picture.gip');
const mean = (values) => values.reduce((a, b) => a + b, 0) / values.length;

for (const effort of efforts) {
  console.log(`effort ${effort}      native       wasm  ratio  PSNR, native  wasm less by  quality, native  wasm less by`);
  const all = [];
  for (const name of readdirSync(folder).filter((name) => name.endsWith('.png')).slice(0, Number(count))) {
    const { data, info } = await sharp(join(folder, name)).raw().toBuffer({ resolveWithObject: true });
    const image = { width: info.width, height: info.height, channels: info.channels, data: new Uint8Array(data) };
    let best = { native: Infinity, wasm: Infinity };
    for (let round = 0; round < rounds; round += 1) {
      const options = ['encode', join(folder, name), output, '--bpp', '0.5', '--effort', String(effort)];
      const report = JSON.parse(execFileSync(gip, [...options, '--threads', '1', '--json']));
      const start = performance.now();
      const other = encode(image, { bpp: 0.5, effort });
      const wasm = (performance.now() - start) / 1000;
      best = { report, other: other.report, native: Math.min(best.native, report.seconds), wasm: Math.min(best.wasm, wasm) };
    }
    const facts = {
      ratio: best.wasm / best.native,
      psnr: best.report.psnr - best.other.psnr,
      quality: best.report.quality - best.other.quality,
    };
    all.push(facts);
    const cells = [
      `${best.native.toFixed(2)} s`.padStart(10),
      `${best.wasm.toFixed(2)} s`.padStart(10),
      facts.ratio.toFixed(2).padStart(6),
      best.report.psnr.toFixed(2).padStart(13),
      facts.psnr.toFixed(3).padStart(13),
      best.report.quality.toFixed(1).padStart(16),
      facts.quality.toFixed(2).padStart(13),
    ];
    console.log(name.padEnd(14) + cells.join(' '));
  }
  const means = Object.keys(all[0]).map((name) => `${name} ${mean(all.map((facts) => facts[name])).toFixed(3)}`);
  console.log(`means: ${means.join(', ')}; largest ratio ${Math.max(...all.map(({ ratio }) => ratio)).toFixed(2)}`);
}
rmSync(scratch, { recursive: true });
