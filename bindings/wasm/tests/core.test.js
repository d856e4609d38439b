// The decoder on one thread, in Node.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { before, test } from 'node:test';

import { Decoder, load } from '../dist/core.js';
import { parseIndex, resultOf, unlimited } from './vectors.js';

const vectors = new URL('../../../spec/vectors/', import.meta.url);
const read = (file) => new Uint8Array(readFileSync(new URL(file, vectors)));

before(() => load(readFileSync(new URL('../dist/image_gip_bg.wasm', import.meta.url))));

test('every line of the test vectors', async () => {
  const lines = parseIndex(readFileSync(new URL('index.tsv', vectors), 'utf8'));
  assert.ok(lines.length > 150);
  for (const line of lines) {
    const found = await resultOf(new Decoder({ limits: unlimited }), read(line.file), line);
    assert.equal(found, line.result, `${line.file}, ${line.rendering}`);
  }
});
