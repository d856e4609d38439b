// Where the element draws, as numbers; and its size on a page beside that of `<img>`.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { moved, plan } from '../js/layout.js';
import { file, harness, script, settled, withPage } from './harness.js';
import { makePicture } from './picture.js';

const natural = { width: 300, height: 200 };
const box = (width, height, density = 1) => ({
  css: { width, height },
  device: { width: width * density, height: height * density },
});

test('a box is filled with pixels of the screen', () => {
  assert.deepEqual(plan({ ...box(100, 50, 2), natural }), {
    width: 200,
    height: 100,
    region: { x: 0, y: 0, width: 200, height: 100 },
    place: { left: 0, top: 0, width: 100, height: 50 },
  });
});

test('contain leaves space, cover cuts', () => {
  const contain = plan({ ...box(300, 300), natural, fit: 'contain' });
  assert.deepEqual(contain.place, { left: 0, top: 50, width: 300, height: 200 });
  const cover = plan({ ...box(100, 100), natural, fit: 'cover' });
  assert.deepEqual([cover.width, cover.height], [150, 100]);
  assert.deepEqual(cover.region, { x: 25, y: 0, width: 100, height: 100 });
  assert.deepEqual(cover.place, { left: 0, top: 0, width: 100, height: 100 });
});

test('positions are parts of the space and lengths', () => {
  const at = (position) => plan({ ...box(400, 300), natural, fit: 'none', position }).place;
  assert.deepEqual([at('0% 0%').left, at('0% 0%').top], [0, 0]);
  assert.deepEqual([at('100% 50%').left, at('100% 50%').top], [100, 50]);
  assert.deepEqual([at('10px 20px').left, at('10px 20px').top], [10, 20]);
  assert.deepEqual([at('calc(100% - 30px) 0%').left, at('-50px 0%').left], [70, 0]);
  const cut = plan({ ...box(400, 300), natural, fit: 'none', position: '-50px 0%' });
  assert.deepEqual(cut.region, { x: 50, y: 0, width: 250, height: 200 });
});

test('scale-down never enlarges', () => {
  assert.equal(plan({ ...box(1000, 1000), natural, fit: 'scale-down' }).width, 300);
  assert.equal(plan({ ...box(150, 1000), natural, fit: 'scale-down' }).width, 150);
});

test('what cannot be seen is not rendered', () => {
  assert.equal(plan({ ...box(0, 100), natural }), null);
  assert.equal(plan({ ...box(100, 100), natural, fit: 'none', position: '500px 0px' }), null);
});

test('a huge box is rendered coarser, and fills its place', () => {
  const { width, height, region, place } = plan({ ...box(20_000, 10_000), natural });
  assert.ok(width * height <= 2 ** 24 && width * height > 2 ** 23);
  assert.deepEqual(region, { x: 0, y: 0, width, height });
  assert.deepEqual(place, { left: 0, top: 0, width: 20_000, height: 10_000 });
});

test('a drawn region moves to its place in another layout', () => {
  const before = plan({ ...box(100, 100), natural, fit: 'cover' });
  const after = plan({ ...box(200, 200), natural, fit: 'cover' });
  assert.deepEqual(moved(before, after), { left: 0, top: 0, width: 200, height: 200 });
  const contain = plan({ ...box(300, 300), natural, fit: 'contain' });
  const place = moved(before, contain);
  // The middle 200 columns of the 300.
  assert.ok(Math.abs(place.left - 50) < 1e-9 && Math.abs(place.width - 200) < 1e-9);
  assert.ok(Math.abs(place.top - 50) < 1e-9 && Math.abs(place.height - 200) < 1e-9);
});

const styles = [
  ['', ''],
  ['width="48"', ''],
  ['height="32"', ''],
  ['width="50" height="80"', ''],
  ['width="50%"', ''],
  ['width="200" height="10"', 'height: auto'],
  ['', 'width: 200px'],
  ['', 'height: 200px'],
  ['', 'width: 50%'],
  ['', 'max-width: 40px'],
  ['', 'max-height: 20px'],
  ['', 'max-width: 100%; height: auto'],
  ['', 'min-width: 150px'],
  ['', 'width: 100%; height: 30px; object-fit: cover'],
  ['', 'display: block; margin: auto'],
  ['', 'display: block; width: 100%'],
  ['', 'width: 120px; padding: 10px; border: 3px solid'],
  ['', 'width: 120px; padding: 10px; border: 3px solid; box-sizing: border-box'],
  ['', 'float: right; width: 33.3%'],
  ['', 'position: absolute; left: 5px; width: 60px'],
  ['', 'aspect-ratio: 1; width: 50px'],
  ['', 'writing-mode: vertical-rl; height: 100px'],
];

test('it is laid out like <img>', async () => {
  harness.routes['/layout.gip'] = file(makePicture({ width: 96, height: 64 }));
  const svg = encodeURIComponent('<svg xmlns="http://www.w3.org/2000/svg" width="96" height="64"/>');
  const cases = styles.map(([attributes, style], index) => {
    const both = [`<img src="data:image/svg+xml,${svg}"`, '<gip-image src="/layout.gip"'];
    const [img, gip] = both.map(
      (tag) => `<div class="case">text ${tag} id="x" alt="" ${attributes} style="${style}">`,
    );
    return `<section id="case-${index}">${img} text</div>${gip}</gip-image> text</div></section>`;
  });
  const css = '<style>.case { width: 250px; position: relative; display: flow-root; font: 16px/20px sans-serif }</style>';
  await withPage(script + css + cases.join(''), async (page) => {
    await page.evaluate(async () => {
      await customElements.whenDefined('gip-image');
      await Promise.all([...document.querySelectorAll('gip-image')].map((image) => image.decode()));
    });
    for (const [index, style] of styles.entries()) {
      const [img, gip] = await page.evaluate((index) => {
        const numbers = (box) => {
          const [outer, inner] = [box, box.querySelector('#x')].map((e) => e.getBoundingClientRect());
          return [inner.x - outer.x, inner.y - outer.y, inner.width, inner.height, outer.height]
            .map((value) => Math.round(value * 4) / 4);
        };
        return [...document.querySelectorAll(`#case-${index} .case`)].map(numbers);
      }, index);
      assert.deepEqual(gip, img, `attributes ${style[0]}, style ${style[1]}`);
    }
  });
});
