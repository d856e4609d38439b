// What the element makes of styles that change while it is shown, and of another document.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { file, harness, script, settled, until, withPage } from './harness.js';
import { exif, makePicture } from './picture.js';

harness.routes['/wide.gip'] = file(makePicture({ width: 90, height: 60, layers: [40] }));
harness.routes['/square.gip'] = file(makePicture({ width: 60, height: 60, layers: [40], chunks: [['eXIF', exif(6)]] }));
harness.routes['/tall.gip'] = file(makePicture({ width: 90, height: 60, layers: [40], chunks: [['eXIF', exif(6)]] }));

/** Where the canvas is in the element. */
const placeOf = (page) =>
  page.evaluate(() => {
    const image = document.querySelector('gip-image');
    const [outer, inner] = [image, image.shadowRoot.querySelector('canvas')].map((e) => e.getBoundingClientRect());
    return [inner.x - outer.x, inner.y - outer.y, inner.width, inner.height].map(Math.round).join();
  });

test('it is drawn anew when object-fit or object-position change, by any style', async () => {
  const css = `<style>
    gip-image { width: 120px; height: 120px; }
    .contain { object-fit: contain; }
    .top { object-position: 0 0; }
    gip-image:hover { object-fit: none; }
    @media (width < 500px) { gip-image { object-fit: scale-down; object-position: 100% 10px; } }
  </style>`;
  await withPage(`${css}${script}<gip-image src="/wide.gip"></gip-image>`, async (page) => {
    await settled(page);
    const place = (wanted) => until(async () => (await placeOf(page)) === wanted, wanted);
    const change = (run) => page.evaluate(`{ const image = document.querySelector('gip-image'); ${run} }`);
    await place('0,0,120,120');
    await change('image.className = "contain"');
    await place('0,20,120,80');
    await change('image.classList.add("top")');
    await place('0,0,120,80');
    await page.hover('gip-image');
    await place('0,0,90,60');
    await page.mouse.move(700, 500);
    await place('0,0,120,80');
    await change('image.style.cssText = "object-fit: none; object-position: right 5px bottom 0"');
    await place('25,60,90,60');
    // The page's own transition goes on as it does for others.
    await change('image.style.transition = "object-position 50ms"; image.style.objectPosition = "10px 20px"');
    await place('10,20,90,60');
    await change('image.removeAttribute("style"); image.removeAttribute("class")');
    await place('0,0,120,120');
    await page.setViewportSize({ width: 400, height: 300 });
    await place('30,10,90,60');
  });
});

for (const name of ['square', 'tall']) {
  test(`it is laid out and drawn anew when image-orientation changes: ${name}`, async () => {
    await withPage(`${script}<div><gip-image src="/${name}.gip"></gip-image></div>`, async (page) => {
      await settled(page);
      /** The element's size, and whether the pixels are those of a rendering. */
      const isAs = (orientation) =>
        page.evaluate(async ([src, orientation]) => {
          const { decode } = await import('/dist/index.js');
          const { width, height, data } = await decode(src, { orientation });
          const image = document.querySelector('gip-image');
          const canvas = image.shadowRoot.querySelector('canvas');
          if (canvas.width !== width || canvas.height !== height) return false;
          const found = canvas.getContext('2d').getImageData(0, 0, width, height).data;
          return image.clientWidth === width && found.every((sample, at) => sample === data[at]);
        }, [`/${name}.gip`, orientation]);
      assert.ok(await isAs('from-image'));
      // It is inherited.
      await page.evaluate(() => (document.querySelector('div').style.imageOrientation = 'none'));
      await until(() => isAs('none'), 'the picture as stored');
      await page.evaluate(() => (document.querySelector('div').style.imageOrientation = ''));
      await until(() => isAs('from-image'), 'the upright picture');
    });
  });
}

test('it can be moved to another document and back', async () => {
  await withPage(`<iframe></iframe>${script}<gip-image src="/wide.gip" alt="x"></gip-image>`, async (page) => {
    await settled(page);
    const states = await page.evaluate(async () => {
      const image = document.querySelector('gip-image');
      const frame = document.querySelector('iframe').contentDocument;
      const frames = async () => {
        for (let count = 0; count < 3; count += 1) await new Promise(requestAnimationFrame);
      };
      const states = [];
      for (const place of [frame.body, document.body, document.createElement('template').content, frame.body]) {
        place.append(image);
        if (!image.isConnected) continue;
        await image.decode();
        await frames();
        const { display } = image.ownerDocument.defaultView.getComputedStyle(image);
        const { width, height } = image.getBoundingClientRect();
        states.push([display, width, height, image.complete]);
      }
      return states;
    });
    assert.deepEqual(states, Array(3).fill(['inline-block', 90, 60, true]));
  });
});
