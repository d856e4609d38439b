// What a page loads, and what a program loads that cuts files.

import assert from 'node:assert/strict';
import { existsSync, readFileSync, readdirSync } from 'node:fs';
import { test } from 'node:test';
import { gzipSync } from 'node:zlib';

const dist = new URL('../dist/', import.meta.url);
const compressed = (file) => gzipSync(readFileSync(new URL(file, dist)), { level: 9 }).length;

/** The files of a part of the package, and their sizes. */
function sizesOf(isPart) {
  const files = readdirSync(dist).filter((file) => /\.(js|wasm)$/.test(file) && isPart(file));
  const sizes = files.map((file) => [file, compressed(file)]);
  return { files, sum: sizes.reduce((sum, [, size]) => sum + size, 0), text: sizes.join(' ') };
}
const isOfThreads = (file) => /encoder.threads/.test(file);
const isOfEncoder = (file) => file.includes('encoder') && !isOfThreads(file);
/** What only those pages load that ask for it. */
const others = ['img.js', 'prefix.js', 'print.js', 'service-worker.js', 'transparent.js'];
const isOfDecoder = (file) => !isOfEncoder(file) && !isOfThreads(file) && !others.includes(file);

test('the scripts that show pictures, and the decoder, are at most 107 kB, compressed', () => {
  const { files, sum, text } = sizesOf(isOfDecoder);
  assert.ok(files.includes('image_gip_bg.wasm') && files.includes('gip-image.js'));
  assert.ok(sum <= 107_000, `${sum}: ${text}`);
});

test('what makes pictures is at most 450 kB, compressed', () => {
  const { files, sum, text } = sizesOf(isOfEncoder);
  assert.ok(files.includes('image_gip_encoder_bg.wasm') && files.includes('encoder.js'));
  assert.ok(sum <= 450_000, `${sum}: ${text}`);
});

const skip = !existsSync(new URL('encoder-threads.js', dist)) && 'the package was built without threads';
test('what pages take in its place that have threads is at most 450 kB, compressed', { skip }, () => {
  const { files, sum, text } = sizesOf(isOfThreads);
  assert.ok(files.includes('image_gip_encoder_threads_bg.wasm') && files.includes('encoder-threads-worker.js'));
  assert.ok(sum <= 450_000, `${sum}: ${text}`);
});

test('for bundlers, decoder and element take at most 6 % more than in files', () => {
  // The worker is there once more, with what it shares with the page.
  const all = new Set();
  const follow = (file) => {
    if (all.has(file)) return;
    all.add(file);
    const script = readFileSync(new URL(file, dist), 'utf8');
    for (const [, name] of script.matchAll(/(?:from|import)\(?"\.\/([\w-]+\.js)"/g)) follow(`embedded/${name}`);
  };
  follow('embedded/gip-image.js');
  const embedded = [...all].map(compressed).reduce((a, b) => a + b);
  const { sum } = sizesOf(isOfDecoder);
  assert.ok(all.size > 3 && embedded > 100_000, [...all].join());
  assert.ok(embedded <= 1.06 * sum, `${embedded} of ${sum}`);
});

test('the module for prefixes is at most 3.2 kB, compressed, and all of it', () => {
  const size = compressed('prefix.js');
  assert.ok(size <= 3_200, size);
  assert.ok(!/\bimport\b|\bfrom ?["']/.test(readFileSync(new URL('prefix.js', dist), 'utf8')));
});
