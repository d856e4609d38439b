// `decode`, `open` and `StreamDecoder` in the browser.

import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { launch } from './browser.js';
import { page, serve } from './server.js';

let browser;
let server;

before(async () => {
  server = await serve({ '/': page('') });
  browser = await launch();
});
after(async () => {
  await browser?.close();
  await server?.close();
});

/** Runs a function on a new page, with the package as its first argument. */
async function inPage(run, argument, path = '/') {
  const context = await browser.newContext();
  try {
    const tab = await context.newPage();
    await tab.goto(server.origin + path);
    return await tab.evaluate(
      async ([source, argument]) => {
        const gip = await import('/dist/index.js');
        return await eval(`(${source})`)(gip, argument);
      },
      [String(run), argument],
    );
  } finally {
    await context.close();
  }
}

test('every line of the test vectors, in a worker', async () => {
  const { lines, wrong } = await inPage(async ({ StreamDecoder }) => {
    const { parseIndex, resultOf } = await import('/tests/vectors.js');
    const limits = { pixels: 2 ** 40, outputPixels: 2 ** 40, gaussians: 2 ** 32, memory: 2 ** 40, work: 2 ** 60 };
    const lines = parseIndex(await (await fetch('/vectors/index.tsv')).text());
    const wrong = [];
    for (const line of lines) {
      const bytes = new Uint8Array(await (await fetch(`/vectors/${line.file}`)).arrayBuffer());
      const found = await resultOf(new StreamDecoder({ limits }), bytes, line);
      if (found !== line.result) wrong.push({ ...line, found });
    }
    return { lines: lines.length, wrong };
  });
  assert.ok(lines > 150);
  assert.deepEqual(wrong, []);
});
