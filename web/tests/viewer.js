// What the tests of the viewer share: a browser on the built page, and pictures.

import assert from 'node:assert/strict';
import { mkdtemp, readFile, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

import { launch } from '../../bindings/wasm/tests/browser.js';
import { assemble } from '../build.js';
import { View } from '../js/view.js';
import { serve } from '../serve.js';

export { missing } from '../../bindings/wasm/tests/browser.js';

const vector = (name) => new URL(`../../spec/vectors/${name}`, import.meta.url);

/** Bytes of a test vector of the specification. */
export const vectorBytes = (name) => readFile(vector(name));

/** The bytes of the sample. */
export const sampleBytes = () => readFile(new URL('../sample/sumac.gip', import.meta.url));

/** Starts a server and a browser. */
export async function start({ routes = {}, flags = [] } = {}) {
  // A folder of its own: other tests run beside this one.
  const site = await mkdtemp(join(tmpdir(), 'gip-viewer-'));
  const server = await serve(assemble(site), { routes });
  const browser = await launch(...flags);
  return {
    browser,
    origin: server.origin,
    async stop() {
      await browser.close();
      await server.close();
      await rm(site, { recursive: true });
    },
  };
}

/**
 * A page with the viewer. `problems` collects errors of its scripts, and requests to other places.
 */
export async function openViewer({ browser, origin }, path = '/', options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 800 }, ...options });
  const page = await context.newPage();
  const problems = [];
  page.on('pageerror', (error) => problems.push(error.message));
  page.on('request', (request) => {
    const url = request.url();
    if (!url.startsWith(origin) && !url.startsWith('blob:')) problems.push(url);
  });
  await page.goto(origin + path);
  return { page, problems, close: () => context.close() };
}

/** Drops files on the page: { name, type, bytes } each. */
export async function drop(page, ...files) {
  const encoded = files.map(({ name, type = '', bytes }) => ({ name, type, text: bytes.toString('base64') }));
  await page.evaluate((encoded) => {
    const data = new DataTransfer();
    for (const { name, type, text } of encoded) {
      const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
      data.items.add(new File([bytes], name, { type }));
    }
    for (const name of ['dragenter', 'dragover', 'drop']) {
      document.body.dispatchEvent(new DragEvent(name, { dataTransfer: data, bubbles: true, cancelable: true }));
    }
  }, encoded);
}

/** Waits until the picture is sharp and at rest. */
export async function settled(page) {
  await page.waitForSelector('body:not(.empty):not(.loading) #stage[aria-busy="false"]');
}

/** The view of a page that has just opened a picture, to be moved as the page is. */
export async function viewOf(page, picture) {
  const view = new View();
  view.setWindow(
    await page.evaluate(() => {
      const { width, height } = document.querySelector('#stage').getBoundingClientRect();
      const device = document.querySelector('#picture');
      return { width, height, ratio: devicePixelRatio, device: { width: device.width, height: device.height } };
    }),
  );
  view.setPicture(picture);
  return view;
}

/** A screenshot of the stage in device pixels. */
export async function screenshot(page) {
  return (await page.locator('#stage').screenshot({ scale: 'device' })).toString('base64');
}

/**
 * How far a screenshot is from what the decoder renders for a view: the mean difference of the
 * samples, and the share of the picture's pixels in which a sample differs by more than 16. Pixels
 * before the share `from` of the window do not count; `order` has the decoder's channel for each.
 */
export function difference(page, shot, view, bytes, { gaussians, from = 0, order = [0, 1, 2] } = {}) {
  const file = bytes.toString('base64');
  return page.evaluate(
    async ({ shot, frame, file, gaussians, from, order }) => {
      const { Decoder, load } = await import('/decoder/core.js');
      const { visibleRegion } = await import('/js/view.js');
      const bytesOf = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
      await load();
      const decoder = new Decoder();
      decoder.feed(bytesOf(file));
      const region = visibleRegion(frame);
      const { data: wanted } = decoder.render({ ...frame.level, region, gaussians });
      decoder.close();
      const bitmap = await createImageBitmap(new Blob([bytesOf(shot)]));
      const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
      context.drawImage(bitmap, 0, 0);
      const [left, top] = [frame.left + region.x, frame.top + region.y];
      const { data: found } = context.getImageData(left, top, region.width, region.height);
      let [sum, far, count] = [0, 0, 0];
      for (let at = 0; at < wanted.length; at += 4) {
        if (left + ((at / 4) % region.width) < from * bitmap.width) continue;
        let most = 0;
        for (let channel = 0; channel < 3; channel += 1) {
          const difference = Math.abs(wanted[at + order[channel]] - found[at + channel]);
          sum += difference;
          most = Math.max(most, difference);
        }
        far += most > 16;
        count += 1;
      }
      return { mean: sum / 3 / count, far: far / count };
    },
    { shot, frame: view.frame, file, gaussians, from, order },
  );
}

/** The page shows what the decoder renders for a view; `options` are those of `difference`. */
export async function assertShows(page, view, bytes, options) {
  const { mean, far } = await difference(page, await screenshot(page), view, bytes, options);
  assert.ok(mean < 0.5 && far < 0.01, `mean ${mean}, far ${far}`);
}
