// What the page of ten pictures is to those who visit it: measured, seen, printed, saved, and loaded with few bytes.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';

import { Decoder, load } from 'image-gip/core';

const axe = createRequire(import.meta.url).resolve('axe-core/axe.min.js');
const [width, height] = [480, 320];
const pictures = 11;

/** Visits the page, with a script that runs before its own. */
async function visit(browser, url, { before = () => {}, query = '' } = {}, run) {
  const context = await browser.newContext({ viewport: { width: 800, height: 600 } });
  try {
    const page = await context.newPage();
    const responses = [];
    page.on('response', (response) => response.url().endsWith('.gip') && responses.push(response));
    await page.addInitScript(before);
    await page.goto(`${url}?visit${query}`);
    await page.waitForFunction(() => document.title.startsWith('visited'));
    return await run(page, responses);
  } finally {
    await context.close();
  }
}

const pause = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));

/** Waits until images have taken the place of all canvases that are close to the screen. */
const isHandedOver = (page, count) =>
  page.waitForFunction((count) => {
    const all = [...document.querySelectorAll('gip-image')].filter(({ shadowRoot }) => shadowRoot.querySelector('img'));
    return all.length >= count;
  }, count);

/** The last candidate for the largest contentful paint, of which one has at least so many pixels. */
async function largestPaint(browser, url, query, least) {
  const before = () => {
    globalThis.paints = [];
    const add = (list) => globalThis.paints.push(...list.getEntries());
    new PerformanceObserver(add).observe({ type: 'largest-contentful-paint', buffered: true });
  };
  return visit(browser, url, { before, query }, async (page) => {
    // On a busy machine it takes some time.
    await page.waitForFunction((least) => globalThis.paints.at(-1)?.size >= least, least);
    await pause(800);
    return page.evaluate(() => {
      const { startTime, size, url: source, element } = globalThis.paints.at(-1);
      return { startTime, size, source, name: element?.localName ?? null };
    });
  });
}

const median = (values) => values.sort((a, b) => a - b)[values.length >> 1];

/** The largest contentful paint is text with canvases, and the picture with images in their place. */
async function checkPaint(browser, url) {
  const kinds = { '&canvas': null, '&original': '.jpg', '': 'blob:' };
  const times = { '&canvas': [], '&original': [], '': [] };
  for (let run = 0; run < 5; run += 1) {
    for (const [query, source] of Object.entries(kinds)) {
      const paint = await largestPaint(browser, url, query, source ? width * height : 0);
      if (source) {
        assert.ok(paint.source.includes(source), JSON.stringify(paint));
        assert.equal(paint.size, width * height);
      } else {
        assert.deepEqual([paint.source, paint.name], ['', 'h1']);
      }
      times[query].push(paint.startTime);
    }
  }
  const [canvas, original, image] = Object.values(times).map((all) => `${median(all).toFixed(0)} ms`);
  return `largest paint: ${image} for .gip as images, ${canvas} (the heading) for .gip on canvases, ${original} for JPEG and PNG`;
}

/** No rule of axe is broken, and all pictures are images with their names. */
function checkAccess(browser, url) {
  return visit(browser, url, {}, async (page) => {
    await isHandedOver(page, 2);
    await page.addScriptTag({ path: axe });
    const { violations, passes } = await page.evaluate(() => globalThis.axe.run());
    assert.deepEqual(violations.map(({ id, nodes }) => [id, nodes[0].html.slice(0, 200)]), []);
    const client = await page.context().newCDPSession(page);
    const { nodes } = await client.send('Accessibility.getFullAXTree');
    const images = nodes.filter(({ role, ignored }) => role?.value === 'image' && !ignored);
    assert.equal(images.length, pictures);
    for (const { name } of images) assert.match(name.value, /^(Hills, number \d|Once more)/);
    return `${passes.length} rules of axe, and the names of ${pictures} images`;
  });
}

/** What is under the pointer is an image, which can be saved. */
function checkSaving(browser, url) {
  return visit(browser, url, {}, async (page) => {
    await isHandedOver(page, 2);
    const { x, y } = await page.locator('gip-image').first().boundingBox();
    const client = await page.context().newCDPSession(page);
    await client.send('DOM.getDocument');
    const place = { x: Math.round(x) + 50, y: Math.round(y) + 50 };
    const { backendNodeId } = await client.send('DOM.getNodeForLocation', place);
    const { object } = await client.send('DOM.resolveNode', { backendNodeId });
    const functionDeclaration = `async function () {
      const saved = await createImageBitmap(await (await fetch(this.src)).blob());
      return [this.localName, saved.width, saved.height];
    }`;
    const call = { objectId: object.objectId, functionDeclaration, awaitPromise: true, returnByValue: true };
    const { result } = await client.send('Runtime.callFunctionOn', call);
    assert.deepEqual(result.value, ['img', width, height]);
    return 'an image of all pixels can be saved';
  });
}

/** Pictures that were never scrolled to are printed with two pixels for each of CSS. */
function checkPrinting(browser, url) {
  return visit(browser, url, {}, async (page, responses) => {
    await page.waitForLoadState('networkidle');
    const before = responses.length;
    assert.ok(before < pictures, `${before} requests`);
    const still = await page.evaluate(() => {
      const start = performance.now();
      dispatchEvent(new Event('beforeprint'));
      const end = performance.now();
      dispatchEvent(new Event('afterprint'));
      return end - start;
    });
    // Skia writes the dictionaries of images as text.
    const pdf = (await page.pdf()).toString('latin1');
    const images = [...pdf.matchAll(/\/Width (\d+)\s+\/Height (\d+)/g)].map(([, ...size]) => size.join(' x '));
    assert.equal(images.filter((size) => size === `${2 * width} x ${2 * height}`).length, pictures, images.join());
    return `${pictures} pictures are printed, ${before} of which had been loaded; the page stands still for ${still.toFixed(0)} ms`;
  });
}

/** Those who want few bytes see the placeholders, and get the pictures that they click on, and all when the page asks for them. */
async function checkReducedData(browser, url) {
  const received = async (responses) => {
    const sizes = await Promise.all(responses.map(async (response) => (await response.request().sizes()).responseBodySize));
    return sizes.reduce((a, b) => a + b, 0);
  };
  const whole = await visit(browser, url, {}, async (page, responses) => {
    await page.waitForLoadState('networkidle');
    return received(responses);
  });
  const before = () => {
    Object.defineProperty(NetworkInformation.prototype, 'saveData', { get: () => true });
  };
  return visit(browser, url, { before }, async (page, responses) => {
    await page.waitForLoadState('networkidle');
    assert.equal(responses.length, 0);
    const shown = await page.evaluate(() => [...document.querySelectorAll('gip-image')].map(({ naturalWidth }) => naturalWidth));
    assert.deepEqual(shown, Array(pictures).fill(width), 'all have their placeholders');
    await page.locator('gip-image').first().click();
    await page.waitForFunction(() => document.querySelector('gip-image').complete);
    const one = await received(responses);
    assert.equal(responses.length, 1);
    await page.evaluate(() => {
      for (const image of document.querySelectorAll('gip-image')) image.detail = 'full';
    });
    await pause(300);
    await page.waitForLoadState('networkidle');
    assert.ok((await received(responses)) >= whole);
    return `for those who want few bytes, 0 in place of ${whole}, and ${one} for the first picture, on which they click`;
  });
}

/** The samples of a screenshot of an element: RGBA. */
async function samplesOf(page, element) {
  const shot = (await element.screenshot()).toString('base64');
  const text = await page.evaluate(async (shot) => {
    const bitmap = await createImageBitmap(await (await fetch(`data:image/png;base64,${shot}`)).blob());
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
    context.drawImage(bitmap, 0, 0);
    const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);
    let text = '';
    for (let at = 0; at < data.length; at += 8192) text += String.fromCharCode(...data.subarray(at, at + 8192));
    return btoa(text);
  }, shot);
  return Buffer.from(text, 'base64');
}

/** The page shows the samples that the decoder gives. */
async function checkLook(browser, url, folder) {
  await load();
  return visit(browser, url, {}, async (page) => {
    let most = 0;
    for (const element of await page.locator('gip-image').all()) {
      await element.scrollIntoViewIfNeeded();
      const src = await element.evaluate(async (image) => {
        await image.decode();
        return image.src;
      });
      await pause(100);
      const decoder = new Decoder();
      decoder.feed(readFileSync(join(folder, decodeURIComponent(new URL(src).pathname.slice(new URL(url).pathname.length)))));
      const { data } = decoder.render({ width, height });
      decoder.close();
      const seen = await samplesOf(page, element);
      assert.equal(seen.length, data.length);
      const difference = data.reduce((sum, value, at) => sum + Math.abs(value - seen[at]), 0) / data.length;
      assert.ok(difference < 0.5, `${src} differs by ${difference}`);
      most = Math.max(most, difference);
    }
    return `the page shows what the decoder gives, within ${most.toFixed(2)} of 255 in the mean`;
  });
}

/** Makes all checks of the page in a folder, which is served at an address; yields a line for each. */
export async function* checks(browser, url, folder) {
  for (const check of [checkPaint, checkAccess, checkSaving, checkPrinting, checkReducedData, checkLook]) {
    yield await check(browser, url, folder);
  }
}
