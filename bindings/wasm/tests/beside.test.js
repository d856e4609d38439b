// What a page may have beside the element: images in place of canvases, and sharp printing.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { file, harness, script, settled, until, withPage } from './harness.js';
import { exif, makePicture } from './picture.js';
import { swappedProfile } from './profile.js';

const layers = [40, 160, 400];
const picture = makePicture({ width: 96, height: 72, layers });
harness.routes['/picture.gip'] = file(picture);
harness.routes['/other.gip'] = file(makePicture({ width: 96, height: 72, layers: [40, 160], seed: 2 }));

const moduleOf = (name) => `<script type="module" src="/dist/${name}.js"></script>`;
const withImages = script + moduleOf('img');
const withPrinting = script + moduleOf('print');

/** What is in the window of the first element: names, the columns of the pixels, and the parts. */
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

/** The address of the image. */
const addressOf = (page) => page.evaluate(() => document.querySelector('gip-image').shadowRoot.querySelector('img')?.src);

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

test('an image has the samples and the place of the canvas, whose memory is freed, and is the largest paint', async () => {
  const watch = `<script>
    globalThis.paints = [];
    new PerformanceObserver((list) => globalThis.paints.push(...list.getEntries()))
      .observe({ type: 'largest-contentful-paint', buffered: true });
  </script><p>Text</p>`;
  const element = '<gip-image src="/picture.gip" alt="A mountain" style="width: 320px"></gip-image>';
  await withPage(watch + withImages + element, async (page) => {
    await handedOver(page, 320);
    assert.deepEqual(await inside(page), [['canvas', 0, ''], ['img', 320, 'picture']]);
    assert.equal(await isExact(page, '/picture.gip', { width: 320 }), true);
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
    const address = await addressOf(page);
    // In a shadow root it is not told which element it is.
    const isPainted = (address) => globalThis.paints.at(-1)?.url === address && globalThis.paints.at(-1).element === null;
    await until(() => page.evaluate(isPainted, address), 'the paint of the picture');
  });
});

test('it follows the size, the source and the distance of the element', async () => {
  const html = '<gip-image src="/picture.gip"></gip-image><div style="height: 5000px"></div><p>end</p>';
  await withPage(withImages + html, async (page) => {
    await handedOver(page, 96);
    const first = await addressOf(page);
    await page.evaluate(() => document.querySelector('gip-image').style.setProperty('width', '160px'));
    await handedOver(page, 160);
    assert.equal((await inside(page)).length, 2);
    await page.evaluate(() => (document.querySelector('gip-image').src = '/other.gip'));
    // The old one is not to be seen any more.
    assert.equal((await inside(page)).some(([name]) => name === 'img'), false);
    await handedOver(page, 160);
    assert.equal(await isExact(page, '/other.gip', { width: 160 }), true);
    assert.equal(await page.evaluate((url) => fetch(url).then(() => 'kept', () => 'revoked'), first), 'revoked');
    await page.evaluate(() => document.querySelector('p').scrollIntoView());
    await until(async () => JSON.stringify(await inside(page)) === '[["canvas",64,"picture"]]', 'a small canvas');
    await page.evaluate(() => scrollTo(0, 0));
    await handedOver(page, 160);
  }, { quiet: true });
});

test('a shadow root is watched when it is named; where a policy refuses images, the canvas stays', async () => {
  const headers = { 'Content-Security-Policy': "default-src 'self'; script-src 'self' 'unsafe-eval'" };
  for (const [options, name] of [[{}, 'img'], [{ headers, quiet: true }, 'canvas']]) {
    await withPage(`${script}<div></div>`, async (page) => {
      const found = await page.evaluate(async () => {
        await customElements.whenDefined('gip-image');
        const root = document.querySelector('div').attachShadow({ mode: 'open' });
        root.innerHTML = '<gip-image src="/picture.gip"></gip-image>';
        const element = root.querySelector('gip-image');
        await element.decode();
        const { watch } = await import('/dist/img.js');
        watch(root);
        for (let tries = 0; tries < 20 && !element.shadowRoot.querySelector('img'); tries += 1) {
          await new Promise((resolve) => setTimeout(resolve, 20));
        }
        const { localName, naturalWidth, width } = element.shadowRoot.querySelector('.window').lastChild;
        return [localName, naturalWidth ?? width];
      });
      assert.deepEqual(found, [name, 96]);
    }, options);
  }
});

const ready = (page) =>
  page.evaluate(async () => {
    await customElements.whenDefined('gip-image');
    await (await import('/dist/print.js')).ready;
  });

test('pictures that were never on the screen are on paper, with two pixels for each of CSS', async () => {
  let requests = 0;
  harness.routes['/lazy.gip'] = (request, response) => {
    requests += 1;
    return file(picture)(request, response);
  };
  const lazy = '<gip-image src="/lazy.gip" loading="lazy" width="96" height="72"></gip-image>';
  const html = `<gip-image src="/picture.gip"></gip-image><div style="height: 8000px"></div>${lazy}<gip-image src="/other.gip"></gip-image>`;
  await withPage(withImages + moduleOf('print') + html, async (page) => {
    await ready(page);
    await handedOver(page, 96);
    const address = await addressOf(page);
    // Skia writes the dictionaries of images as text.
    const pdf = (await page.pdf()).toString('latin1');
    const images = [...pdf.matchAll(/\/Width (\d+)\s+\/Height (\d+)/g)].map(([, width, height]) => `${width} x ${height}`);
    assert.equal(images.filter((size) => size === '192 x 144').length, 3, images.join());
    assert.equal(requests, 1);
    // Afterwards the page is as it was, also when pixels have rested as long as the images wait for.
    await page.evaluate(() => new Promise((resolve) => setTimeout(resolve, 300)));
    const canvases = await page.evaluate(() =>
      [...document.querySelectorAll('gip-image')].map(({ shadowRoot }) => [...shadowRoot.querySelectorAll('canvas')].map(({ width }) => width)));
    assert.deepEqual(canvases, [[0], [], [64]]);
    assert.equal(await addressOf(page), address);
  });
});

/**
 * For each element the canvases that are to be seen between the two events: columns, place in the element in CSS pixels, and
 * whether they have the samples that the decoder gives for a file and options.
 */
const prepared = (page, pictures) =>
  page.evaluate(async (pictures) => {
    const { decode } = await import('/dist/index.js');
    const wanted = await Promise.all(pictures.map(async ([src, options]) => (await decode(src, options)).data));
    dispatchEvent(new Event('beforeprint'));
    const found = [...document.querySelectorAll('gip-image')].map((element, which) => {
      const { x, y } = element.getBoundingClientRect();
      const all = [...element.shadowRoot.querySelectorAll('canvas')].filter((canvas) => canvas.checkVisibility());
      return all.map((canvas) => {
        const box = canvas.getBoundingClientRect();
        const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
        const isExact = data.length === wanted[which]?.length && data.every((value, at) => value === wanted[which][at]);
        return { width: canvas.width, box: [box.x - x, box.y - y, box.width, box.height], isExact };
      });
    });
    dispatchEvent(new Event('afterprint'));
    return found;
  }, pictures);

test('they are printed as the decoder and the styles have them; what cannot be had at once, as it is on the page', async () => {
  harness.routes['/turned.gip'] = file(makePicture({ width: 96, height: 72, layers, chunks: [['eXIF', exif(6)]] }));
  harness.routes['/profile.gip'] = file(makePicture({ width: 96, height: 72, layers, chunks: [['iCCP', swappedProfile()]] }));
  harness.routes['/gone.gip'] = file(picture);
  const cases = [
    ['/picture.gip', '', { width: 192, height: 144 }, [0, 0, 96, 72]],
    ['/turned.gip', 'width: 36px', { width: 72, height: 96 }, [0, 0, 36, 48]],
    ['/turned.gip', 'image-orientation: none; width: 48px', { width: 96, height: 72, orientation: 'none' }, [0, 0, 48, 36]],
    ['/picture.gip', 'width: 96px; height: 96px; object-fit: contain; padding: 5px', { width: 192, height: 144 }, [5, 17, 96, 72]],
    [
      '/picture.gip',
      'width: 36px; height: 36px; object-fit: cover; object-position: 0 0',
      { width: 96, height: 72, region: { x: 0, y: 0, width: 72, height: 72 } },
      [0, 0, 36, 36],
    ],
  ];
  const others = ['/profile.gip', '/gone.gip'];
  const element = ([src, style = '']) => `<gip-image src="${src}" style="${style}"></gip-image>`;
  await withPage(withPrinting + [...cases, ...others.map((src) => [src])].map(element).join(''), async (page) => {
    await ready(page);
    await until(async () => (await page.locator('gip-image canvas').count()) === cases.length + others.length, 'all pictures');
    delete harness.routes['/gone.gip'];
    const found = await prepared(page, cases.map(([src, , options]) => [src, options]));
    for (const [at, [, style, { width, region }, box]] of cases.entries()) {
      assert.deepEqual(found[at], [{ width: region?.width ?? width, box, isExact: true }], style);
    }
    assert.deepEqual(found.slice(cases.length).map((all) => all.map(({ width }) => width)), [[96], [96]]);
  }, { quiet: true });
});
