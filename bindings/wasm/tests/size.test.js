// What a page loads.

import assert from 'node:assert/strict';
import { readFileSync, readdirSync } from 'node:fs';
import { test } from 'node:test';
import { gzipSync } from 'node:zlib';

const dist = new URL('../dist/', import.meta.url);

test('all scripts and the decoder are at most 106 kB, compressed', () => {
  const files = readdirSync(dist).filter((file) => /\.(js|wasm)$/.test(file));
  const sizes = files.map((file) => gzipSync(readFileSync(new URL(file, dist)), { level: 9 }).length);
  const sum = sizes.reduce((a, b) => a + b, 0);
  assert.ok(files.includes('image_gip_bg.wasm') && files.includes('gip-image.js'));
  assert.ok(sum <= 106_000, files.map((file, at) => `${file}: ${sizes[at]}`).join(', '));
});
