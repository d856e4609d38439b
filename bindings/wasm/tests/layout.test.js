// Where the element draws, as numbers; and its size on a page beside that of `<img>`.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { moved, plan } from '../js/layout.js';
import { file, harness, script, settled, until, withPage } from './harness.js';
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

/** Attributes and styles, in a block. */
const inBlocks = [
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

/** Containers, and the styles that each of their items is tried with. */
const containers = [
  'display: flex',
  'display: flex; height: 150px',
  'display: flex; width: 60px; align-items: center',
  'display: flex; flex-direction: column',
  'display: flex; flex-direction: column; height: 40px',
  'display: flex; flex-direction: column; align-items: flex-start',
  'display: flex; flex-direction: column; direction: rtl',
  'display: flex; height: 100px; writing-mode: vertical-rl',
  'display: inline-grid',
  'display: grid; height: 200px',
  'display: grid; place-items: stretch',
  'display: grid; place-items: center; height: 200px',
  'display: grid; grid-template-columns: 1fr 1fr; width: 150px',
  'display: grid; grid-template: 50px / 50px; justify-items: stretch',
  'float: left; width: auto; max-width: 60px',
];
const items = [
  '',
  'width: 50px',
  'height: 50%',
  'width: 50%; height: auto',
  'max-width: 100%',
  'max-width: 100%; height: auto',
  'max-height: 20px',
  'min-width: 150px',
  'flex: 1',
  'flex: 0 0 50px',
  'place-self: stretch; min-height: 100px',
  'place-self: start',
  'margin: auto',
  'padding: 5px; border: 2px solid',
  'aspect-ratio: 1',
];
const absolute = [
  'left: 5px; right: 5px',
  'top: 5px; bottom: 5px',
  'inset: 0; margin: auto',
  'inset: 0; width: 100%; height: 100%',
  'inset: 0; width: 50%',
  'inset: 0; height: 30px',
  'inset: 0; max-width: 100%',
  'inset: 0; min-width: 150px',
  'inset: 0; place-self: stretch',
  'inset: 0; place-self: center',
  'right: 0; bottom: 0',
];
/** The style of the container, attributes and style. */
const cases = [
  ...inBlocks.map(([attributes, style]) => ['', attributes, style]),
  ...containers.flatMap((container) => [
    ...items.map((style) => [container, '', style]),
    ...['width="48"', 'height="32"'].map((attributes) => [container, attributes, '']),
  ]),
  ...['', 'display: flex;', 'display: grid;'].flatMap((container) =>
    absolute.map((style) => [`${container} height: 200px`, '', `position: absolute; ${style}`])),
];

test('it is laid out like <img>', async () => {
  harness.routes['/layout.gip'] = file(makePicture({ width: 96, height: 64 }));
  const svg = encodeURIComponent('<svg xmlns="http://www.w3.org/2000/svg" width="96" height="64"/>');
  const html = cases.map(([container, attributes, style]) =>
    [`<img src="data:image/svg+xml,${svg}"`, '<gip-image src="/layout.gip"'].map((tag) =>
      `<section><div class="case" style="${container}">text
        ${tag} class="x" alt="" ${attributes} style="${style}"></gip-image> <i>text</i></div></section>`).join(''));
  const css = `<style>
    section { height: 500px; overflow: hidden; }
    .case { width: 250px; position: relative; display: flow-root; font: 16px/20px sans-serif }
  </style>`;
  await withPage(script + css + html.join(''), async (page) => {
    const boxes = await page.evaluate(async () => {
      await customElements.whenDefined('gip-image');
      await Promise.all([...document.querySelectorAll('.x')].map((image) => image.decode()));
      return [...document.querySelectorAll('.case')].map((box) => {
        const [outer, inner, text] = [box, ...box.querySelectorAll('.x, i')].map((e) => e.getBoundingClientRect());
        const numbers = [outer.width, outer.height, inner.width, inner.height];
        for (const { x, y } of [inner, text]) numbers.push(x - outer.x, y - outer.y);
        return numbers.map((value) => Math.round(value * 4) / 4);
      });
    });
    for (const [index, layout] of cases.entries()) {
      assert.deepEqual(boxes[2 * index + 1], boxes[2 * index], layout.join(' | '));
    }
  });
});

test('it follows a container that becomes another one', async () => {
  const html = `${script}<style>
    div { width: 250px; display: flex; flex-direction: column; }
    @media (width < 500px) { div { width: 240px; display: block; } gip-image { display: block; } }
  </style><div><gip-image src="/layout.gip"></gip-image></div>`;
  await withPage(html, async (page) => {
    await settled(page);
    const sizes = await page.evaluate(async () => {
      globalThis.errors = [];
      addEventListener('error', ({ message }) => errors.push(message));
      const sizes = [];
      const image = document.querySelector('gip-image');
      const grid = document.createElement('div');
      grid.style.cssText = 'display: grid; justify-items: start';
      for (const parent of [image.parentElement, document.body.appendChild(grid), document.body, image.parentElement]) {
        parent.append(image);
        sizes.push(image.clientWidth);
      }
      return sizes;
    });
    assert.deepEqual(sizes, [250, 96, 96, 250]);
    const width = () => page.evaluate(() => document.querySelector('gip-image').clientWidth);
    await page.setViewportSize({ width: 400, height: 300 });
    await until(async () => (await width()) === 96, 'a block as wide as the picture');
    assert.deepEqual(await page.evaluate(() => errors), []);
  });
});
