// `decode`, `open` and `StreamDecoder` in the browser.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { file, harness, inPage, slow, until } from './harness.js';
import { makePicture } from './picture.js';

test('every line of the test vectors, in a worker', async () => {
  const { lines, wrong } = await inPage(async ({ StreamDecoder }) => {
    const { parseIndex, resultOf, unlimited } = await import('/tests/vectors.js');
    const lines = parseIndex(await (await fetch('/vectors/index.tsv')).text());
    const wrong = [];
    for (const line of lines) {
      const bytes = new Uint8Array(await (await fetch(`/vectors/${line.file}`)).arrayBuffer());
      const found = await resultOf(new StreamDecoder({ limits: unlimited }), bytes, line);
      if (found !== line.result) wrong.push({ ...line, found });
    }
    return { lines: lines.length, wrong };
  });
  assert.ok(lines > 150);
  assert.deepEqual(wrong, []);
});
