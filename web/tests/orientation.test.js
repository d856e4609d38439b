// Pictures whose Exif turns them: the viewer shows them upright, with all that it draws over them.

import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { exif, makePicture, turns, withExif } from '../../bindings/wasm/tests/picture.js';
import { assertShows, drop, missing, openViewer, settled, start, viewOf } from './viewer.js';

const [WIDTH, HEIGHT] = [96, 64];
const TURNS = turns(WIDTH, HEIGHT);

let viewer;

if (!missing) {
  before(async () => {
    viewer = await start();
  });
  after(() => viewer?.stop());
}

/** Opens a file of the picture, and returns its bytes and the view of it. */
async function openTurned(page, orientation, layers) {
  const bytes = makePicture({ width: WIDTH, height: HEIGHT, layers, chunks: [['eXIF', exif(orientation)]] });
  const name = `turned-${orientation}.gip`;
  await drop(page, { name, bytes });
  await page.waitForFunction((name) => document.title.startsWith(name), name);
  await settled(page);
  const [width, height] = orientation > 4 ? [HEIGHT, WIDTH] : [WIDTH, HEIGHT];
  return { bytes, width, height, view: await viewOf(page, { width, height }) };
}

/** In the page: the file as PNG, as it is stored. */
async function storedPng(file) {
  const { Decoder, load } = await import('/decoder/core.js');
  await load();
  const decoder = new Decoder();
  decoder.feed(Uint8Array.from(atob(file), (letter) => letter.charCodeAt(0)));
  return [...(await decoder.png({ orientation: 'none' }))];
}

/** In the page: where the first Gaussian is as stored, as points on its outline and half-way to it. */
async function outlineOf(file) {
  const { Decoder, load } = await import('/decoder/core.js');
  await load();
  const decoder = new Decoder();
  decoder.feed(Uint8Array.from(atob(file), (letter) => letter.charCodeAt(0)));
  const [x, y, l11, l21, l22] = decoder.gaussians();
  const at = (distance) => (_, index) => {
    const [cos, sin] = [Math.cos((index * Math.PI) / 6), Math.sin((index * Math.PI) / 6)];
    return [x + distance * l11 * cos, y + distance * (l21 * cos + l22 * sin)];
  };
  return { on: Array.from({ length: 12 }, at(1)), off: Array.from({ length: 12 }, at(0.5)) };
}

for (const orientation of Object.keys(TURNS).map(Number)) {
  test(`orientation ${orientation}`, { skip: missing, timeout: 60_000 }, async () => {
    const { page, problems, close } = await openViewer(viewer, '/', { reducedMotion: 'reduce' });
    try {
      const { bytes, width, height, view } = await openTurned(page, orientation, [40, 160]);
      await assertShows(page, view, bytes);
      const label = await page.locator('#stage').getAttribute('aria-label');
      assert.ok(label.endsWith(`${width} by ${height} pixels`), label);
      const panel = await page.locator('#panel').innerText();
      assert.ok(panel.includes(`${width} × ${height} pixels`), panel);
      assert.equal(panel.includes('Orientation'), orientation > 1);

      // A part of it, and what the first bytes give.
      for (const key of ['+', '+', 'ArrowRight']) await page.keyboard.press(key);
      view.zoomTo(view.scale * 1.5 ** 2);
      view.panBy(-90, 0);
      await page.keyboard.press(',');
      await page.waitForFunction(() => document.querySelector('#shown').textContent.includes('1 of 2 layers'));
      await settled(page);
      await assertShows(page, view, bytes, { gaussians: 40 });
      await page.keyboard.press('.');
      await page.waitForFunction(() => document.querySelector('#shown').textContent.includes('2 of 2 layers'));

      // The original that lies over it has the same Exif.
      const png = Buffer.from(await page.evaluate(storedPng, bytes.toString('base64')));
      await drop(page, { name: 'original.png', type: 'image/png', bytes: withExif(png, exif(orientation)) });
      await page.locator('#divider').waitFor();
      assert.ok(await page.locator('#message').isHidden());
      await page.locator('#divider').press('End');
      await page.locator('#stage').focus();
      await page.keyboard.press('1');
      view.zoomTo(1);
      await settled(page);
      await assertShows(page, view, bytes);
      assert.deepEqual(problems, []);
    } finally {
      await close();
    }
  });

  test(`outlines with orientation ${orientation}`, { skip: missing, timeout: 60_000 }, async () => {
    const { page, close } = await openViewer(viewer, '/', { reducedMotion: 'reduce' });
    try {
      const { bytes, width, height, view } = await openTurned(page, orientation, [1]);
      await page.keyboard.press('o');
      await settled(page);
      const { on, off } = await page.evaluate(outlineOf, bytes.toString('base64'));
      const { level, left, top } = view.frame;
      const alphas = (points) => {
        const places = points.map(TURNS[orientation]).map(([x, y]) => [
          Math.floor(left + (x * level.width) / width),
          Math.floor(top + (y * level.height) / height),
        ]);
        return page.evaluate((places) => {
          const context = document.querySelector('#outlines').getContext('2d');
          return places.map(([x, y]) => context.getImageData(x, y, 1, 1).data[3]);
        }, places);
      };
      const [onOutline, beside] = [await alphas(on), await alphas(off)];
      // Parts of the ellipse may be outside of the picture.
      assert.ok(onOutline.filter((alpha) => alpha > 100).length >= 4, String(onOutline));
      assert.ok(beside.every((alpha) => alpha === 0), String(beside));
    } finally {
      await close();
    }
  });
}
