// Printed pages.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { exif, makePicture } from './picture.js';
import { file, harness, script, settled, until, withPage } from './harness.js';
import { swappedProfile } from './profile.js';

const layers = [40, 160, 400];
const picture = makePicture({ width: 96, height: 72, layers });
harness.routes['/picture.gip'] = file(picture);

const scripts = `${script}<script type="module" src="/dist/print.js"></script>`;

/** The sizes in pixels of the images in a PDF. Skia writes their dictionaries as text. */
const imagesIn = (pdf) =>
  [...pdf.toString('latin1').matchAll(/\/Width (\d+)\s+\/Height (\d+)/g)].map(([, width, height]) => `${width} x ${height}`);

const ready = (page) =>
  page.evaluate(async () => {
    await customElements.whenDefined('gip-image');
    await (await import('/dist/print.js')).ready;
  });

/**
 * For each element the canvases that are to be seen between the two events: columns, place in the element in CSS pixels, and
 * whether they have the samples that the decoder gives for a file and options.
 */
const prepared = (page, pictures = []) =>
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

test('pictures that were never on the screen are on paper, with two pixels for each of CSS', async () => {
  const far = '<div style="height: 8000px"></div>';
  const lazy = '<gip-image src="/picture.gip" loading="lazy" width="96" height="72"></gip-image>';
  let requests = 0;
  harness.routes['/lazy.gip'] = (request, response) => {
    requests += 1;
    return file(picture)(request, response);
  };
  const html = `<gip-image src="/picture.gip"></gip-image>${far}${lazy.replace('picture', 'lazy')}<gip-image src="/picture.gip"></gip-image>`;
  await withPage(script + html, async (page) => {
    await settled(page);
    const images = imagesIn(await page.pdf());
    assert.equal(images.filter((size) => size === '192 x 144').length, 0, images.join());
    assert.equal(requests, 0);
  });
  await withPage(scripts + html, async (page) => {
    await ready(page);
    await settled(page);
    const images = imagesIn(await page.pdf());
    assert.equal(images.filter((size) => size === '192 x 144').length, 3, images.join());
    assert.equal(requests, 1);
    // Afterwards the page is as it was.
    const canvases = await page.evaluate(() =>
      [...document.querySelectorAll('gip-image')].map(({ shadowRoot }) => [...shadowRoot.querySelectorAll('canvas')].map(({ width }) => width)));
    assert.deepEqual(canvases, [[96], [], [64]]);
  });
});

test('they have the pixels of the decoder, and the place that styles give them', async () => {
  harness.routes['/turned.gip'] = file(makePicture({ width: 96, height: 72, layers, chunks: [['eXIF', exif(6)]] }));
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
  const elements = cases.map(([src, style]) => `<gip-image src="${src}" style="${style}"></gip-image>`);
  await withPage(scripts + elements.join(''), async (page) => {
    await ready(page);
    await page.evaluate(() => Promise.all([...document.querySelectorAll('gip-image')].map((image) => image.decode())));
    const found = await prepared(page, cases.map(([src, , options]) => [src, options]));
    for (const [at, [, style, { width, region }, box]] of cases.entries()) {
      assert.deepEqual(found[at], [{ width: region?.width ?? width, box, isExact: true }], style);
    }
  });
});

test('what cannot be had at once is printed as it is on the page', async () => {
  harness.routes['/profile.gip'] = file(makePicture({ width: 96, height: 72, layers, chunks: [['iCCP', swappedProfile()]] }));
  harness.routes['/gone.gip'] = file(picture);
  const elements = ['/profile.gip', '/gone.gip'].map((src) => `<gip-image src="${src}"></gip-image>`);
  await withPage(scripts + elements.join(''), async (page) => {
    await ready(page);
    await until(async () => (await page.locator('gip-image canvas').count()) === 2, 'both pictures');
    delete harness.routes['/gone.gip'];
    assert.deepEqual((await prepared(page)).map((all) => all.map(({ width }) => width)), [[96], [96]]);
  }, { quiet: true });
});
