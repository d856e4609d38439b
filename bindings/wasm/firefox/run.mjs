// The main path of the package and of the viewer in Firefox: `npm run firefox`.
//
// It needs `npm run build`, and Firefox: Debian's `firefox-esr`, or the program that the variable FIREFOX names. The tests
// themselves run in Chromium.

import assert from 'node:assert/strict';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

import { assemble } from '../../../web/build.js';
import { serve as serveViewer } from '../../../web/serve.js';
import { makePicture, texture } from '../tests/picture.js';
import { swappedProfile } from '../tests/profile.js';
import { serve, slow } from '../tests/server.js';
import { launch } from './bidi.mjs';

const layers = [40, 160, 400];
const pictures = {
  '/picture.gip': makePicture({ width: 96, height: 72, layers }),
  '/textured.gip': makePicture({ layers: [40], chunks: [['tXTR', texture]] }),
  '/profile.gip': makePicture({ width: 96, height: 72, layers, chunks: [['iCCP', swappedProfile()]] }),
};
const large = slow(makePicture({ width: 1200, height: 800, layers: [400, 1600, 4000, 6000] }), { piece: 4096, interval: 15 });

const script = '<script type="module" src="/dist/gip-image.js"></script>';
const pages = {
  '/': script,
  '/policy': script,
  '/isolated': '',
  '/embedded': script.replace('/dist/', '/dist/embedded/'),
  '/extras': ['gip-image', 'img', 'print'].map((name) => script.replace('gip-image', name)).join(''),
};
const headersOf = {
  '/policy': { 'Content-Security-Policy': "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'" },
  '/isolated': { 'Cross-Origin-Opener-Policy': 'same-origin', 'Cross-Origin-Embedder-Policy': 'require-corp' },
};

/** What becomes of an element with this source: the size of its canvas, and its mean difference from the decoder's samples. */
const show = async (src) => {
  await customElements.whenDefined('gip-image');
  const image = document.createElement('gip-image');
  image.alt = 'A mountain';
  image.src = src;
  document.body.append(image);
  await new Promise((resolve, reject) => {
    image.addEventListener('load', resolve);
    image.addEventListener('error', ({ message }) => reject(new Error(message)));
  });
  const canvas = image.shadowRoot.querySelector('canvas');
  const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  const { decode } = await import('/dist/index.js');
  const wanted = await decode(src);
  const difference = wanted.data.reduce((sum, value, at) => sum + Math.abs(value - data[at]), 0) / data.length;
  return { width: canvas.width, height: canvas.height, difference, complete: image.complete };
};

const checks = {
  async 'the element shows the samples of the decoder'(open) {
    for (const path of ['/', '/embedded', '/policy']) {
      const page = await open(path);
      for (const [src, [width, height]] of [['/picture.gip', [96, 72]], ['/textured.gip', [96, 64]]]) {
        assert.deepEqual(await page.evaluate(show, src), { width, height, difference: 0, complete: true }, path);
      }
    }
  },

  async 'an ICC profile is applied'(open) {
    const { difference } = await (await open('/')).evaluate(show, '/profile.gip');
    assert.ok(difference > 3, difference);
  },

  async 'the download stops when the size has what it needs, and goes on when it grows'(open) {
    const page = await open('/');
    await page.evaluate(async () => {
      document.body.innerHTML = '<gip-image src="/large.gip" width="60"></gip-image>';
      const image = document.querySelector('gip-image');
      await image.decode();
    });
    const ended = async (requests) => {
      const isOver = () => large.log.requests.length >= requests && large.log.open === 0;
      for (let tries = 0; tries < 500 && !isOver(); tries += 1) await new Promise((resolve) => setTimeout(resolve, 20));
    };
    await ended(1);
    const { sent } = large.log;
    await page.evaluate(async () => {
      document.querySelector('gip-image').width = 1200;
      const isLarge = () => document.querySelector('gip-image').shadowRoot.querySelector('canvas').width === 1200;
      for (let tries = 0; tries < 500 && !isLarge(); tries += 1) await new Promise((resolve) => setTimeout(resolve, 20));
    });
    // The pixels may be there before the last bytes.
    await ended(2);
    assert.match(large.log.requests[1], /^bytes=\d+-$/);
    assert.ok(large.log.sent > 2 * sent, `${sent} and ${large.log.sent} bytes`);
  },

  async 'an image takes the place of the canvas, and pages are printed sharply'(open) {
    const page = await open('/extras');
    const found = await page.evaluate(async () => {
      await (await import('/dist/print.js')).ready;
      const lazy = '<gip-image src="/picture.gip" loading="lazy" width="96" height="72"></gip-image>';
      document.body.innerHTML = `<gip-image src="/picture.gip"></gip-image><div style="height: 8000px"></div>${lazy}`;
      const [first, last] = document.querySelectorAll('gip-image');
      for (let tries = 0; tries < 200 && !first.shadowRoot.querySelector('img'); tries += 1) {
        await new Promise((resolve) => setTimeout(resolve, 20));
      }
      globalThis.printed = [];
      // After those of the package.
      addEventListener('beforeprint', () => {
        globalThis.printed = [first, last].map(({ shadowRoot }) => [...shadowRoot.querySelectorAll('canvas')].at(-1)?.width);
      });
      const { naturalWidth } = first.shadowRoot.querySelector('img');
      return naturalWidth;
    });
    assert.equal(found, 96);
    assert.equal((await page.print()).toString('latin1', 0, 4), '%PDF');
    // Firefox has the events where a person prints; not every version has them for a driver.
    const printed = await page.evaluate(() => {
      if (globalThis.printed.length === 0) dispatchEvent(new Event('beforeprint'));
      return globalThis.printed;
    });
    assert.deepEqual(printed, [192, 192]);
  },

  async 'a picture is encoded, and shown'(open) {
    const page = await open('/');
    const [width, bytes] = await page.evaluate(async () => {
      const { encode } = await import('/dist/encoder.js');
      const canvas = new OffscreenCanvas(96, 72);
      const context = canvas.getContext('2d');
      context.fillStyle = 'teal';
      context.fillRect(10, 10, 50, 40);
      const { file } = await encode(canvas, { bytes: 800, effort: 1 });
      const { decode } = await import('/dist/index.js');
      return [(await decode(file)).width, file.length];
    });
    assert.ok(width === 96 && bytes <= 800, `${width}, ${bytes}`);
  },

  async 'an isolated page encodes with threads, to the same file'(open) {
    const page = await open('/isolated');
    const [same, workers] = await page.evaluate(async () => {
      let workers = 0;
      globalThis.Worker = class extends Worker {
        constructor(...args) {
          super(...args);
          workers += 1;
        }
      };
      const data = new Uint8Array(96 * 72).map((_, at) => (at * at) % 251);
      const files = [];
      for (const script of ['/dist/encoder.js', '/dist/embedded/encoder.js']) {
        const { encode } = await import(script);
        for (const threads of [1, 3]) {
          files.push(String((await encode({ width: 96, height: 72, channels: 1, data }, { bytes: 800, effort: 1, threads })).file));
        }
      }
      return [new Set(files).size, workers];
    });
    assert.deepEqual([same, workers], [1, 8]);
  },

  async 'the viewer opens its sample, and makes a file'(_, openViewer) {
    let page = await openViewer('/?src=sample/sumac.gip');
    const settled = async () => {
      const isSettled = () => document.querySelector('body:not(.empty):not(.loading) #stage[aria-busy="false"]') !== null;
      for (let tries = 0; tries < 600 && !(await page.evaluate(isSettled)); tries += 1) {
        await new Promise((resolve) => setTimeout(resolve, 50));
      }
    };
    await settled();
    const text = (selector) => page.evaluate((selector) => document.querySelector(selector).textContent, selector);
    assert.equal(await text('#name'), 'sumac.gip');
    assert.match(await text('#shown'), /5,670 Gaussians/);
    const zoom = await text('#zoom');
    await page.evaluate(() => document.querySelector('[data-action="zoomIn"]').click());
    await settled();
    assert.notEqual(await text('#zoom'), zoom);
    // One beside an open .gip would be compared with it.
    page = await openViewer('/');
    await page.evaluate(async () => {
      const canvas = new OffscreenCanvas(96, 72);
      const context = canvas.getContext('2d');
      context.fillStyle = 'teal';
      context.fillRect(10, 10, 50, 40);
      const picker = document.querySelector('#picker');
      const data = new DataTransfer();
      data.items.add(new File([await canvas.convertToBlob()], 'evening.png', { type: 'image/png' }));
      picker.files = data.files;
      picker.dispatchEvent(new Event('change'));
      const isMade = () => document.querySelector('#maker[aria-busy="false"] [name="download"]:not(:disabled)') !== null;
      for (let tries = 0; tries < 600 && !isMade(); tries += 1) await new Promise((resolve) => setTimeout(resolve, 50));
    });
    await settled();
    assert.equal(await text('#name'), 'evening.gip');
  },
};

const routes = { '/large.gip': large.route };
for (const [path, bytes] of Object.entries(pictures)) {
  routes[path] = (_, response) => response.writeHead(200, { 'Content-Type': 'image/vnd.gip' }).end(bytes);
}
for (const [path, html] of Object.entries(pages)) {
  const headers = headersOf[path] ?? {};
  routes[path] = (_, response) =>
    response.writeHead(200, { 'Content-Type': 'text/html; charset=utf-8', ...headers }).end(`<!doctype html><title>test</title>${html}`);
}

const folder = mkdtempSync(join(tmpdir(), 'gip-viewer-'));
const server = await serve(routes);
const viewer = await serveViewer(assemble(folder), { routes: {} });
const browser = await launch(process.env.FIREFOX ?? 'firefox-esr');
console.log(`Firefox ${browser.version}`);
let failed = false;
for (const [name, check] of Object.entries(checks)) {
  const opened = [];
  const open = (origin) => async (path) => {
    const page = await browser.open();
    opened.push(page);
    await page.goto(origin + path);
    return page;
  };
  try {
    await check(open(server.origin), open(viewer.origin));
    assert.deepEqual(opened.flatMap(({ errors }) => errors), []);
    console.log(`ok: ${name}`);
  } catch (error) {
    failed = true;
    console.log(`failed: ${name}: ${error.stack}`);
  }
  for (const page of opened) await page.close();
}
await browser.close();
await server.close();
await viewer.close();
rmSync(folder, { recursive: true });
process.exit(failed ? 1 : 0);
