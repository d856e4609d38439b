// `<img>` in place of the canvases of `<gip-image>`.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { file, harness, script, settled, until, withPage } from './harness.js';
import { makePicture } from './picture.js';

const picture = makePicture({ width: 96, height: 72, layers: [40, 160, 400] });
harness.routes['/picture.gip'] = file(picture);
harness.routes['/other.gip'] = file(makePicture({ width: 96, height: 72, layers: [40, 160], seed: 2 }));

const scripts = `${script}<script type="module" src="/dist/img.js"></script>`;

/** What is in the window of the first element: names, the sizes of the pixels, and the parts. */
const inside = (page) =>
  page.evaluate(() =>
    [...(document.querySelector('gip-image').shadowRoot?.querySelectorAll('canvas, img') ?? [])].map((node) => [
      node.localName,
      node.localName === 'img' ? node.naturalWidth : node.width,
      node.part.value,
    ]));

/** Waits for an image of so many columns. */
const handedOver = (page, width) =>
  until(async () => (await inside(page)).some(([name, columns]) => name === 'img' && columns === width), `an image of ${width} columns`);

/** Whether the image has the samples that the decoder gives. */
const isExact = (page, src, options = {}) =>
  page.evaluate(async ([src, options]) => {
    const { decode } = await import('/dist/index.js');
    const image = document.querySelector('gip-image').shadowRoot.querySelector('img');
    const context = new OffscreenCanvas(image.naturalWidth, image.naturalHeight).getContext('2d');
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.naturalWidth, image.naturalHeight);
    const wanted = (await decode(src, options)).data;
    return data.length === wanted.length && data.every((value, at) => value === wanted[at]);
  }, [src, options]);

test('it has the samples and the place of the canvas, whose memory is freed', async () => {
  await withPage(`${scripts}<gip-image src="/picture.gip" alt="A mountain"></gip-image>`, async (page) => {
    await handedOver(page, 96);
    assert.deepEqual(await inside(page), [['canvas', 0, ''], ['img', 96, 'picture']]);
    assert.equal(await isExact(page, '/picture.gip'), true);
    const boxes = await page.evaluate(() => {
      const element = document.querySelector('gip-image');
      return [element, element.shadowRoot.querySelector('img')].map((node) => JSON.stringify(node.getBoundingClientRect()));
    });
    assert.equal(boxes[0], boxes[1]);
    // It has no name of its own beside that of the element.
    const client = await page.context().newCDPSession(page);
    const { nodes } = await client.send('Accessibility.getFullAXTree');
    const images = nodes.filter(({ role, ignored }) => role?.value === 'image' && !ignored);
    assert.deepEqual(images.map(({ name }) => name.value), ['A mountain']);
  });
});

test('the largest contentful paint is the picture', async () => {
  const watch = `<script>
    globalThis.paints = [];
    new PerformanceObserver((list) => globalThis.paints.push(...list.getEntries()))
      .observe({ type: 'largest-contentful-paint', buffered: true });
  </script><p>Text</p>`;
  const element = '<gip-image src="/picture.gip" style="width: 320px"></gip-image>';
  for (const [html, url] of [[script, ''], [scripts, 'blob:']]) {
    await withPage(watch + html + element, async (page) => {
      await settled(page);
      // In a shadow root it is not told which element it is.
      const last = () => page.evaluate(() => globalThis.paints.at(-1)?.url + (globalThis.paints.at(-1)?.element?.localName ?? ''));
      if (url) await until(async () => (await last())?.startsWith(url), 'the paint of the picture');
      else await page.evaluate(() => new Promise((resolve) => setTimeout(resolve, 300)));
      assert.match(await last(), url ? /^blob:.*[\da-f]$/ : /^p$/);
    });
  }
});

test('it follows the size, the place and the source of the element', async () => {
  await withPage(`${scripts}<gip-image src="/picture.gip" style="width: 96px"></gip-image>`, async (page) => {
    await handedOver(page, 96);
    const first = await page.evaluate(() => document.querySelector('gip-image').shadowRoot.querySelector('img').src);
    await page.evaluate(() => document.querySelector('gip-image').style.setProperty('width', '160px'));
    await handedOver(page, 160);
    assert.equal((await inside(page)).length, 2);
    assert.equal(await isExact(page, '/picture.gip', { width: 160 }), true);
    await page.evaluate(() => (document.querySelector('gip-image').src = '/other.gip'));
    // The old one is not to be seen any more.
    assert.equal((await inside(page)).some(([name]) => name === 'img'), false);
    await handedOver(page, 160);
    assert.equal(await isExact(page, '/other.gip', { width: 160 }), true);
    const isRevoked = (url) => page.evaluate((url) => fetch(url).then(() => false, () => true), url);
    assert.equal(await isRevoked(first), true);
  }, { quiet: true });
});

test('it is still there after printing', async () => {
  const html = `${scripts}<script type="module" src="/dist/print.js"></script><gip-image src="/picture.gip"></gip-image>`;
  await withPage(html, async (page) => {
    await handedOver(page, 96);
    const before = await page.evaluate(async () => {
      await (await import('/dist/print.js')).ready;
      return document.querySelector('gip-image').shadowRoot.querySelector('img').src;
    });
    await page.pdf();
    const after = await page.evaluate(async () => {
      // Longer than the pixels have to rest.
      await new Promise((resolve) => setTimeout(resolve, 300));
      return [...document.querySelector('gip-image').shadowRoot.querySelectorAll('img')].map(({ src }) => src);
    });
    assert.deepEqual(after, [before]);
  });
});

test('far from the screen there is no image, and again when it comes close', async () => {
  const html = `${scripts}<gip-image src="/picture.gip"></gip-image><div style="height: 5000px"></div><p>end</p>`;
  await withPage(html, async (page) => {
    await handedOver(page, 96);
    await page.evaluate(() => document.querySelector('p').scrollIntoView());
    await until(async () => JSON.stringify(await inside(page)) === '[["canvas",64,"picture"]]', 'a small canvas');
    await page.evaluate(() => scrollTo(0, 0));
    await handedOver(page, 96);
  });
});

test('where the policy of the page refuses it, the canvas stays', async () => {
  const headers = { 'Content-Security-Policy': "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'" };
  await withPage(`${scripts}<gip-image src="/picture.gip"></gip-image>`, async (page) => {
    await settled(page);
    await page.evaluate(() => new Promise((resolve) => setTimeout(resolve, 300)));
    assert.deepEqual(await inside(page), [['canvas', 96, 'picture']]);
  }, { headers, quiet: true });
});

test('a shadow root is watched when it is named, with what is complete in it already', async () => {
  await withPage(`${script}<div></div>`, async (page) => {
    const found = await page.evaluate(async () => {
      await customElements.whenDefined('gip-image');
      const root = document.querySelector('div').attachShadow({ mode: 'open' });
      root.innerHTML = '<gip-image src="/picture.gip"></gip-image>';
      const element = root.querySelector('gip-image');
      await element.decode();
      const { watch } = await import('/dist/img.js');
      watch(root);
      for (let tries = 0; tries < 100 && !element.shadowRoot.querySelector('img'); tries += 1) {
        await new Promise((resolve) => setTimeout(resolve, 20));
      }
      return element.shadowRoot.querySelector('img')?.naturalWidth;
    });
    assert.equal(found, 96);
  });
});
