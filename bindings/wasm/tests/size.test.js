// What a page loads, and what a program loads that cuts files.

import assert from 'node:assert/strict';
import { readFileSync, readdirSync } from 'node:fs';
import { test } from 'node:test';
import { gzipSync } from 'node:zlib';

const dist = new URL('../dist/', import.meta.url);
const compressed = (file) => gzipSync(readFileSync(new URL(file, dist)), { level: 9 }).length;

test('the scripts that show pictures, and the decoder, are at most 107 kB, compressed', () => {
  const files = readdirSync(dist).filter((file) => /\.(js|wasm)$/.test(file) && file !== 'prefix.js');
  const sizes = files.map(compressed);
  const sum = sizes.reduce((a, b) => a + b, 0);
  assert.ok(files.includes('image_gip_bg.wasm') && files.includes('gip-image.js'));
  assert.ok(sum <= 107_000, files.map((file, at) => `${file}: ${sizes[at]}`).join(', '));
});

test('the module for prefixes is at most 3.2 kB, compressed, and all of it', () => {
  const size = compressed('prefix.js');
  assert.ok(size <= 3_200, size);
  assert.ok(!/\bimport\b|\bfrom ?["']/.test(readFileSync(new URL('prefix.js', dist), 'utf8')));
});
