// The encoder with threads, in Node and on pages that are isolated.

import assert from 'node:assert/strict';
import { existsSync } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { syncBuiltinESMExports } from 'node:module';
import { availableParallelism } from 'node:os';
import { test } from 'node:test';
import workerThreads from 'node:worker_threads';

import { encode } from 'image-gip/encoder';
import * as core from 'image-gip/encoder/core';

import { harness, until, withPage } from './harness.js';
import { sample } from './sample.js';

const module = new URL('../dist/image_gip_encoder_threads_bg.wasm', import.meta.url);
const skip = !existsSync(module) && 'the package was built without threads';

/** Workers that the package has started in Node. */
let started = 0;
workerThreads.Worker = class extends workerThreads.Worker {
  constructor(...args) {
    super(...args);
    started += 1;
  }
};
syncBuiltinESMExports();

/** The result of `work`, and how many workers it has started. */
async function counted(work) {
  started = 0;
  return [await work(), started];
}

const picture = sample({ width: 160, height: 120, channels: 3 });
const options = { bytes: 2500, effort: 1 };
/** The file without threads. */
async function expected(image = picture) {
  await core.load();
  return core.encode(image, options).file;
}

const isolated = { 'Cross-Origin-Opener-Policy': 'same-origin', 'Cross-Origin-Embedder-Policy': 'require-corp' };

/** Runs `run` on a page which has `encoded(options)` as a function, for the picture and as a plain array; `script` has the package. */
async function onPage(run, { headers = isolated, script = '/dist/encoder.js', quiet } = {}) {
  return withPage(
    '',
    async (page) => {
      const requests = [];
      page.on('request', (request) => requests.push(request.url()));
      await page.evaluate(
        async ([script, image, options]) => {
          const { encode } = await import(script);
          globalThis.encoded = async (more) => {
            const data = new Uint8Array(image.data);
            return [...(await encode({ ...image, data }, { ...options, ...more })).file];
          };
        },
        [script, { ...picture, data: [...picture.data] }, options],
      );
      return run(page, requests);
    },
    { headers, quiet },
  );
}

test('in Node, files are the same with any number of threads, each of which is a worker', { skip }, async () => {
  const file = await expected();
  for (const threads of [2, 3, 1]) {
    const [result, workers] = await counted(() => encode(picture, { ...options, threads }));
    assert.deepEqual(result.file, file);
    assert.equal(workers, threads);
  }
  // Those that wait for work are taken again.
  const [again, workers] = await counted(() => encode(picture, { ...options, threads: 3 }));
  assert.deepEqual(again.file, file);
  assert.equal(workers, 0);
});

test('a number of threads out of range is refused, with words', async () => {
  for (const threads of [0, 65, 1.5, '2', null]) {
    const message = `threads is ${threads}; it must be an integer from 1 to 64`;
    await assert.rejects(encode(picture, { threads }), { name: 'RangeError', message });
  }
});

test('an encoding with threads can be aborted, and the next one is none the worse', { skip }, async () => {
  const controller = new AbortController();
  const seen = [];
  const onprogress = ({ fraction }) => {
    seen.push(fraction);
    controller.abort();
  };
  const long = encode(sample({ width: 320, height: 240 }), { effort: 7, threads: 2, signal: controller.signal, onprogress });
  await assert.rejects(long, { name: 'AbortError' });
  assert.equal(seen.length, 1);
  assert.deepEqual((await encode(picture, { ...options, threads: 2 })).file, await expected());
});

test('pictures that are encoded at the same time share the cores', { skip }, async () => {
  const cores = availableParallelism();
  const other = sample({ width: 161, height: 120, channels: 3 });
  const files = [await expected(), await expected(other)];
  const both = (more) => Promise.all([picture, other].map((image) => encode(image, { ...options, ...more }).then(({ file }) => file)));
  assert.deepEqual(await both({ threads: 2 }), files);
  // Nothing waits that has this many threads.
  await new Promise((resolve) => setTimeout(resolve));
  const share = Math.min(16, Math.max(1, Math.floor(cores / 2)));
  const [result] = await counted(() => both());
  assert.deepEqual(result, files);
  // As many teams as above wait now, and are taken.
  const [, more] = await counted(() => both({ threads: share }));
  assert.equal(more, 0);
});

test('isolated pages have threads, from files and from one script, and the files are the same', { skip }, async () => {
  const file = [...(await expected())];
  for (const script of ['/dist/encoder.js', '/dist/embedded/encoder.js']) {
    await onPage(
      async (page, requests) => {
        const found = await page.evaluate(() => globalThis.encoded({ threads: 3 }));
        assert.deepEqual(found, file);
        assert.equal(page.workers().length, 3);
        assert.ok(!requests.some((url) => url.endsWith('image_gip_encoder_bg.wasm')), requests);
      },
      { script },
    );
  }
});

test('on an isolated page two pictures are encoded at once, one is aborted, and idle workers end', { skip }, async () => {
  await onPage(async (page) => {
    await page.clock.install();
    const found = await page.evaluate(async () => {
      const controller = new AbortController();
      const aborted = globalThis.encoded({ threads: 2, effort: 7, signal: controller.signal, onprogress: () => controller.abort() });
      const files = Promise.all([globalThis.encoded({ threads: 2 }), globalThis.encoded({ threads: 2 })]);
      const reason = await aborted.catch((error) => error.name);
      return [reason, ...(await files)];
    });
    const file = [...(await expected())];
    assert.deepEqual(found, ['AbortError', file, file]);
    await until(() => page.workers().length <= 4, 'the end of the workers that were aborted');
    await page.clock.fastForward(10_001);
    await until(() => page.workers().length === 0, 'the end of the workers');
  });
});

test('pages that are not isolated load nothing of threads', async () => {
  await onPage(
    async (page, requests) => {
      const found = await page.evaluate(() => globalThis.encoded({ threads: 3 }));
      assert.deepEqual(found, [...(await expected())]);
      assert.equal(page.workers().length, 1);
      assert.ok(requests.some((url) => url.endsWith('image_gip_encoder_bg.wasm')), requests);
      assert.ok(!requests.some((url) => url.includes('threads')), requests);
    },
    { headers: {} },
  );
});

test('where the workers of threads cannot be had, an isolated page encodes with one', { skip }, async () => {
  harness.routes['/dist/image_gip_encoder_threads_bg.wasm'] = (_, response) => response.writeHead(404).end();
  try {
    await onPage(
      async (page) => {
        const found = await page.evaluate(() => globalThis.encoded({ threads: 3 }));
        assert.deepEqual(found, [...(await expected())]);
        await until(() => page.workers().length === 1, 'the end of the other workers');
      },
      { quiet: true },
    );
  } finally {
    delete harness.routes['/dist/image_gip_encoder_threads_bg.wasm'];
  }
});

test('a thread that fails rejects, and the next encoding has new ones', { skip }, async () => {
  // The memory of the first team is too small for the work.
  const path = '/dist/encoder-threads-worker.js';
  const script = await readFile(new URL(`..${path}`, import.meta.url), 'utf8');
  const limit = `WebAssembly.Memory = class extends WebAssembly.Memory {
    constructor(limits) { super({ ...limits, maximum: limits.initial + 40 }); }
  };`;
  let count = 0;
  harness.routes[path] = (_, response) => {
    count += 1;
    const isolation = { 'Cross-Origin-Embedder-Policy': 'require-corp', 'Cache-Control': 'no-store' };
    response.writeHead(200, { 'Content-Type': 'text/javascript', ...isolation });
    response.end(count <= 2 ? `${limit}\n${script}` : script);
  };
  try {
    await onPage(async (page) => {
      const [reason, file] = await page.evaluate(async () => {
        const failed = await globalThis.encoded({ threads: 2 }).catch(({ name, message }) => `${name}: ${message}`);
        return [failed, await globalThis.encoded({ threads: 2 })];
      });
      assert.match(String(reason), /^GipError: the encoder failed/);
      assert.deepEqual(file, [...(await expected())]);
      assert.equal(count, 4);
    });
  } finally {
    delete harness.routes[path];
  }
});
