// The viewer in the browser: what a person sees after what a person does.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { after, before, test } from 'node:test';

import { leastChunk, makePicture, texture } from '../../bindings/wasm/tests/picture.js';
import { swappedProfile } from '../../bindings/wasm/tests/profile.js';
import { assertShows, difference, drop, missing, openViewer, sampleBytes } from './viewer.js';
import { screenshot, settled, start, vectorBytes, viewOf } from './viewer.js';

const SAMPLE = { width: 576, height: 576 };
/** What the panel says of it. */
const SAMPLE_GAUSSIANS = '5,670';

let viewer;
let sample;
/** Its bytes, as the page writes the number. */
let sampleSize;

/** A picture whose texture comes after its layers. */
const LATE_LAYERS = [40, 160];
const lateFile = makePicture({ layers: LATE_LAYERS, later: [[LATE_LAYERS.length, 'tXTR', texture]] });
let openLate = () => {};

/** Sends the layers, and the rest when the test calls `openLate`. */
async function serveLate(response) {
  const opened = new Promise((resolve) => {
    openLate = resolve;
  });
  const layers = makePicture({ layers: LATE_LAYERS }).length - leastChunk;
  response.writeHead(200, { 'Content-Length': lateFile.length });
  response.write(lateFile.subarray(0, layers));
  await opened;
  response.end(lateFile.subarray(layers));
}

if (!missing) {
  before(async () => {
    sample = await sampleBytes();
    sampleSize = sample.length.toLocaleString('en');
    viewer = await start({
      routes: {
        '/missing.gip': (_, response) => response.writeHead(404).end(),
        '/100%.gip': async (_, response) => response.end(await vectorBytes('rgb8.gip')),
        '/%FF%20%C3%A4.gip': async (_, response) => response.end(await vectorBytes('rgb8.gip')),
        '/%C3%A4%20b%25.gip': async (_, response) => response.end(await vectorBytes('rgb8.gip')),
        '/late-texture.gip': (_, response) => serveLate(response),
        '/rgb.gip': async (_, response) => response.end(await vectorBytes('rgb8.gip')),
      },
    });
  });
  after(() => viewer?.stop());
}

/** A test on a page of its own, which must neither fail nor ask other servers. */
function onPage(name, { path = '/?src=sample/sumac.gip', ...options }, run) {
  test(name, { skip: missing, timeout: 60_000 }, async () => {
    const { page, problems, close } = await openViewer(viewer, path, { reducedMotion: 'reduce', ...options });
    try {
      if (path.includes('src=sample')) await settled(page);
      await run(page);
      assert.deepEqual(problems, []);
    } finally {
      await close();
    }
  });
}

const textOf = (page, selector) => page.locator(selector).textContent();

onPage('a file by URL shows whole, with its facts', {}, async (page) => {
  await assertShows(page, await viewOf(page, SAMPLE), sample);
  assert.equal(await page.title(), 'sumac.gip - gip viewer');
  const panel = await page.locator('#panel').innerText();
  const counts = [`${sampleSize} bytes`, '576 × 576 pixels', `${SAMPLE_GAUSSIANS} in 4 layers`, 'L × 4'];
  for (const fact of [...counts, 'header', 'Gaussians', 'texture', 'end', 'shape', 'position']) {
    assert.ok(panel.includes(fact), fact);
  }
});

onPage('a file by drop replaces the one before', {}, async (page) => {
  const bytes = await vectorBytes('rgb8.gip');
  await drop(page, { name: 'vector.gip', bytes });
  await page.waitForFunction(() => document.title.startsWith('vector.gip'));
  await settled(page);
  const panel = await page.locator('#panel').innerText();
  const [width, height] = panel.match(/(\d+) × (\d+) pixels/).slice(1).map(Number);
  await assertShows(page, await viewOf(page, { width, height }), bytes);
});

onPage('wheel and drag give a sharp part of the picture', {}, async (page) => {
  const view = await viewOf(page, SAMPLE);
  const stage = await page.locator('#stage').boundingBox();
  const at = { x: 300, y: 250 };
  await page.mouse.move(stage.x + at.x, stage.y + at.y);
  for (const notches of [-500, -300]) {
    await page.mouse.wheel(0, notches);
    await settled(page);
    view.zoomTo(view.scale * Math.exp(-notches * 0.002), at);
  }
  await page.mouse.down();
  await page.mouse.move(stage.x + 400, stage.y + 200, { steps: 5 });
  await page.mouse.up();
  view.panBy(100, -50);
  await settled(page);
  await assertShows(page, view, sample);
});

onPage('the keyboard zooms to 100 times and back, and moves', {}, async (page) => {
  const view = await viewOf(page, SAMPLE);
  for (let press = 0; press < 16; press += 1) await page.keyboard.press('+');
  await settled(page);
  assert.equal(await textOf(page, '#zoom'), '10,000 %');
  await page.keyboard.press('ArrowRight');
  view.zoomTo(100);
  view.panBy(-90, 0);
  await settled(page);
  await assertShows(page, view, sample);
  await page.keyboard.press('1');
  await settled(page);
  assert.equal(await textOf(page, '#zoom'), '100 %');
  await page.keyboard.press('0');
  await settled(page);
  view.fit();
  await assertShows(page, view, sample);
});

onPage('a screen of high density gets its own pixels', { deviceScaleFactor: 2 }, async (page) => {
  const view = await viewOf(page, SAMPLE);
  assert.equal(view.window.ratio, 2);
  await assertShows(page, view, sample);
});

onPage('an ICC profile is applied', { path: '/' }, async (page) => {
  // Red and green are exchanged.
  const bytes = makePicture({ chunks: [['iCCP', swappedProfile()]] });
  await drop(page, { name: 'profile.gip', bytes });
  await settled(page);
  const view = await viewOf(page, { width: 96, height: 64 });
  const shot = await screenshot(page);
  const asStored = await difference(page, shot, view, bytes);
  const exchanged = await difference(page, shot, view, bytes, { order: [1, 0, 2] });
  assert.ok(asStored.mean > 3 && exchanged.mean < 1.5, `${asStored.mean}, ${exchanged.mean}`);
});

onPage('texture is shown, and left out by its button', { path: '/' }, async (page) => {
  const bytes = makePicture({ chunks: [['tXTR', texture]] });
  await drop(page, { name: 'textured.gip', bytes });
  await settled(page);
  const view = await viewOf(page, { width: 96, height: 64 });
  const plain = makePicture();
  const button = page.locator('[data-action="texture"]');
  await assertShows(page, view, bytes);
  await button.click();
  await settled(page);
  assert.equal(await button.getAttribute('aria-pressed'), 'false');
  await assertShows(page, view, plain);
  await page.keyboard.press('t');
  await settled(page);
  await assertShows(page, view, bytes);
  assert.ok((await difference(page, await screenshot(page), view, plain)).mean > 2);
  assert.ok((await page.locator('#panel').innerText()).includes('tXTR'));
  // It is there for pictures with texture alone.
  await drop(page, { name: 'plain.gip', bytes: plain });
  await page.waitForFunction(() => document.title.startsWith('plain.gip'));
  await settled(page);
  assert.ok(await button.isHidden());
});

onPage('texture that comes after all Gaussians', { path: '/?src=late-texture.gip' }, async (page) => {
  await page.waitForSelector('body:not(.empty) #stage[aria-busy="false"]');
  const view = await viewOf(page, { width: 96, height: 64 });
  const plain = makePicture({ layers: LATE_LAYERS });
  const { mean } = await difference(page, await screenshot(page), view, plain);
  assert.ok(mean < 1.5, String(mean));
  openLate();
  await settled(page);
  const after = await screenshot(page);
  const [asWanted, asBefore] = [
    await difference(page, after, view, lateFile),
    await difference(page, after, view, plain),
  ];
  assert.ok(asWanted.mean < 1.5 && asBefore.mean > 2, `${asWanted.mean}, ${asBefore.mean}`);
});

onPage('a file of another version gives a message', { path: '/' }, async (page) => {
  const bytes = Buffer.from(makePicture());
  bytes[6] = 2;
  await drop(page, { name: 'later.gip', bytes });
  const says = (pattern) => new RegExp(pattern).test(document.querySelector('#message p').textContent);
  await page.waitForFunction(says, 'later\\.gip: .*H \\(header\\): unsupported: version 2');
});

onPage('outlines are where the Gaussians are', { path: '/' }, async (page) => {
  const bytes = await vectorBytes('entropy-one.gip');
  await drop(page, { name: 'one.gip', bytes });
  await settled(page);
  await page.keyboard.press('o');
  await settled(page);
  assert.ok(await page.locator('#legend').isVisible());
  const found = await page.evaluate(async (file) => {
    const { Decoder, load } = await import('/decoder/core.js');
    const { View } = await import('/js/view.js');
    await load();
    const decoder = new Decoder();
    decoder.feed(Uint8Array.from(atob(file), (letter) => letter.charCodeAt(0)));
    const [x, y, l11, l21, l22] = decoder.gaussians();
    const view = new View();
    const { width, height } = document.querySelector('#stage').getBoundingClientRect();
    view.setWindow({ width, height, ratio: 1, device: document.querySelector('#outlines') });
    view.setPicture(decoder.header);
    const { frame } = view;
    const [sx, sy] = [frame.level.width / decoder.header.width, frame.level.height / decoder.header.height];
    const context = document.querySelector('#outlines').getContext('2d');
    const alpha = (distance, t) => {
      const px = frame.left + (x + distance * l11 * Math.cos(t)) * sx;
      const py = frame.top + (y + distance * (l21 * Math.cos(t) + l22 * Math.sin(t))) * sy;
      return context.getImageData(Math.floor(px), Math.floor(py), 1, 1).data[3];
    };
    const around = Array.from({ length: 12 }, (_, index) => (index * Math.PI) / 6);
    return { on: around.map((t) => alpha(1, t)), off: around.map((t) => alpha(0.5, t)) };
  }, bytes.toString('base64'));
  // Parts of the ellipse may be outside of the picture.
  assert.ok(found.on.filter((alpha) => alpha > 100).length >= 4, String(found.on));
  assert.ok(found.off.every((alpha) => alpha === 0), String(found.off));
  await page.keyboard.press('o');
  assert.ok(await page.locator('#outlines').isHidden());
});

onPage('the slider shows what the first bytes give', {}, async (page) => {
  const view = await viewOf(page, SAMPLE);
  for (const key of [',', ',', ',']) await page.keyboard.press(key);
  const output = page.locator('#shown');
  await page.waitForFunction(() => document.querySelector('#shown').textContent.includes('1 of 4 layers'));
  await settled(page);
  const text = await output.textContent();
  const gaussians = Number(text.match(/([\d,]+) Gaussians/)[1].replace(',', ''));
  assert.ok(gaussians > 100 && gaussians < 1000, text);
  await assertShows(page, view, sample, { gaussians });
  // In the middle of the next layer there is nothing more.
  await page.locator('#scrubber').fill('5000');
  // The counts come from a worker.
  await page.waitForFunction(() => document.querySelector('#shown').textContent.startsWith('5,000 of '));
  assert.match(await output.textContent(), / 1 of 4 layers/);
  await page.locator('#scrubber').fill(String(sample.length));
  await page.waitForFunction(() => document.querySelector('#shown').textContent.includes('4 of 4 layers'));
  await settled(page);
  await assertShows(page, view, sample);
  // The slider has the focus, but only its own keys.
  await page.keyboard.press('o');
  assert.ok(await page.locator('#outlines').isVisible());
  await page.keyboard.press('Home');
  await page.waitForFunction(() => document.querySelector('#shown').textContent.startsWith('0 of '));
});

onPage('the file plays from its first byte', {}, async (page) => {
  const label = () => page.locator('#play').getAttribute('aria-label');
  await page.keyboard.press(' ');
  await page.waitForFunction(() => Number(document.querySelector('#scrubber').value) < 13_000);
  assert.equal(await label(), 'Pause');
  await page.keyboard.press(' ');
  assert.notEqual(await label(), 'Pause');
  // From there to the end.
  await page.locator('#scrubber').fill('22000');
  await page.locator('#play').click();
  const isWhole = (size) => document.querySelector('#shown').textContent.startsWith(`${size} bytes`);
  await page.waitForFunction(isWhole, sampleSize);
  await settled(page);
  await assertShows(page, await viewOf(page, SAMPLE), sample);
});

/** A PNG file of one colour. */
async function flat(page, color) {
  const url = await page.evaluate((color) => {
    const canvas = Object.assign(document.createElement('canvas'), { width: 576, height: 576 });
    const context = canvas.getContext('2d');
    context.fillStyle = color;
    context.fillRect(0, 0, 576, 576);
    return canvas.toDataURL('image/png');
  }, color);
  return { name: 'original.png', type: 'image/png', bytes: Buffer.from(url.split(',')[1], 'base64') };
}

/** The colour of the stage at a share of its width, half-way down. */
async function colorAt(page, shot, share) {
  return page.evaluate(
    async ({ shot, share }) => {
      const bytes = Uint8Array.from(atob(shot), (letter) => letter.charCodeAt(0));
      const bitmap = await createImageBitmap(new Blob([bytes]));
      const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
      context.drawImage(bitmap, 0, 0);
      return [...context.getImageData(bitmap.width * share, bitmap.height * 0.4, 1, 1).data.slice(0, 3)];
    },
    { shot, share },
  );
}

onPage('the original is on the left of the divider', {}, async (page) => {
  await page.keyboard.press('c');
  assert.match(await textOf(page, '#message p'), /Drop the original/);
  await drop(page, await flat(page, '#00ff00'));
  const divider = page.locator('#divider');
  await divider.waitFor();
  await settled(page);
  let shot = await screenshot(page);
  assert.deepEqual(await colorAt(page, shot, 0.4), [0, 255, 0]);
  const { mean } = await difference(page, shot, await viewOf(page, SAMPLE), sample, { from: 0.6 });
  assert.ok(mean < 1, String(mean));

  const handle = await page.locator('#divider .handle').boundingBox();
  await page.mouse.move(handle.x + 20, handle.y + 20);
  await page.mouse.down();
  await page.mouse.move(handle.x - 200, handle.y, { steps: 4 });
  await page.mouse.up();
  shot = await screenshot(page);
  assert.notDeepEqual(await colorAt(page, shot, 0.4), [0, 255, 0]);

  await divider.press('End');
  assert.equal(await divider.getAttribute('aria-valuenow'), '100');
  shot = await screenshot(page);
  assert.deepEqual(await colorAt(page, shot, 0.7), [0, 255, 0]);
  await page.keyboard.press('c');
  assert.ok(await divider.isHidden());
});

onPage('damaged and other files give a message', { path: '/' }, async (page) => {
  const message = page.locator('#message p');
  const says = async (pattern) => {
    const isSaid = (source) => new RegExp(source).test(document.querySelector('#message p').textContent);
    await page.waitForFunction(isSaid, pattern.source);
    assert.ok(await message.isVisible());
  };
  await drop(page, { name: 'notes.txt', bytes: Buffer.from('not a picture') });
  await says(/neither a \.gip/);
  await drop(page, { name: 'header.gip', bytes: await vectorBytes('xcrc-header.gip') });
  await says(/header\.gip.*H \(header\)/);
  assert.ok(await page.locator('#welcome').isVisible());
  await drop(page, { name: 'tall.gip', bytes: makePicture({ width: 2, height: 65_537, layers: [3] }) });
  await says(/tall\.gip: limit exceeded: height: 65537 required, 65536 allowed\.$/);
  const half = sample.subarray(0, 13_000);
  await drop(page, { name: 'half.gip', bytes: half });
  await says(/half\.gip.*What is shown came before that: [\d,]+ of [\d,]+ Gaussians/);
  await settled(page);
  await page.locator('#message button').click();
  assert.ok(await message.isHidden());
  await assertShows(page, await viewOf(page, SAMPLE), half);
});

for (const [name, shown] of [
  ['100%.gip', '100%.gip'],
  ['%FF%20%C3%A4.gip', '%FF%20%C3%A4.gip'],
  ['%C3%A4%20b%25.gip', 'ä b%.gip'],
]) {
  onPage(`a name that is ${name} in its URL`, { path: `/?src=${encodeURIComponent(name)}` }, async (page) => {
    await settled(page);
    assert.equal(await page.title(), `${shown} - gip viewer`);
  });
}

onPage('a URL that is not there gives a message', { path: '/?src=missing.gip' }, async (page) => {
  await page.waitForFunction(() => document.querySelector('#message p').textContent.includes('404'));
  assert.ok(await page.locator('#welcome').isVisible());
  await page.getByRole('button', { name: 'Open a sample' }).click();
  await settled(page);
  assert.ok(await page.locator('#message').isHidden());
});

onPage('keys open and close help and details', {}, async (page) => {
  await page.keyboard.press('?');
  assert.ok(await page.locator('#help').isVisible());
  // The keys belong to the help now.
  await page.keyboard.press('i');
  await page.keyboard.press('Escape');
  assert.ok(await page.locator('#help').isHidden());
  const details = page.getByRole('button', { name: 'Details' });
  const shown = await page.locator('#panel').isVisible();
  await page.keyboard.press('i');
  assert.equal(await page.locator('#panel').isVisible(), !shown);
  assert.equal(await details.getAttribute('aria-pressed'), String(!shown));
});

const phone = { viewport: { width: 375, height: 667 }, deviceScaleFactor: 3, isMobile: true, hasTouch: true };

onPage('a phone has everything within reach', phone, async (page) => {
  const layout = await page.evaluate(() => {
    const outside = [...document.querySelectorAll('button, input, #stage')]
      .filter((element) => element.checkVisibility() && !element.closest('dialog'))
      .map((element) => [element.outerHTML.slice(0, 60), element.getBoundingClientRect()])
      .filter(([, { left, right, top, bottom }]) => left < 0 || top < 0 || right > innerWidth || bottom > innerHeight);
    const small = [...document.querySelectorAll('header button')]
      .filter((button) => button.checkVisibility() && button.getBoundingClientRect().height < 40);
    const { height } = document.querySelector('#stage').getBoundingClientRect();
    return { outside, small: small.length, share: height / innerHeight, width: document.scrollingElement.scrollWidth };
  });
  assert.deepEqual(layout.outside, []);
  assert.equal(layout.small, 0);
  assert.ok(layout.share > 0.6, String(layout.share));
  assert.equal(layout.width, 375);
  await page.getByRole('button', { name: 'Details' }).tap();
  assert.ok(await page.locator('#panel').isVisible());
});

onPage('two fingers zoom, one moves', phone, async (page) => {
  const view = await viewOf(page, SAMPLE);
  const stage = await page.locator('#stage').boundingBox();
  const client = await page.context().newCDPSession(page);
  const touch = (type, ...points) =>
    client.send('Input.dispatchTouchEvent', {
      type,
      touchPoints: points.map(([x, y], id) => ({ x: stage.x + x, y: stage.y + y, id })),
    });
  await touch('touchStart', [150, 200], [200, 200]);
  await touch('touchMove', [100, 200], [250, 200]);
  await touch('touchEnd');
  view.zoomTo(view.scale * 3, { x: 175, y: 200 });
  await settled(page);
  assert.equal(await textOf(page, '#zoom'), `${Math.round(view.scale * 100)} %`);
  await touch('touchStart', [150, 200]);
  await touch('touchMove', [110, 260]);
  await touch('touchEnd');
  view.panBy(-40, 60);
  await settled(page);
  await assertShows(page, view, sample);
});

onPage('the page follows the colour scheme', { path: '/', colorScheme: 'dark' }, async (page) => {
  const background = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  const dark = await background();
  await page.emulateMedia({ colorScheme: 'light' });
  const light = await background();
  const brightness = (color) => color.match(/\d+/g).map(Number).reduce((a, b) => a + b) / 3;
  assert.ok(brightness(dark) < 64 && brightness(light) > 192, `${dark} ${light}`);
});

onPage('no rule of accessibility is broken, by axe', {}, async (page) => {
  const path = createRequire(new URL('../../bindings/wasm/', import.meta.url)).resolve('axe-core/axe.min.js');
  // Unlike a script element, the page's policy lets it run.
  await page.evaluate(await readFile(path, 'utf8'));
  await page.keyboard.press('o');
  for (const colorScheme of ['light', 'dark']) {
    await page.emulateMedia({ colorScheme });
    const { violations, passes } = await page.evaluate(() => globalThis.axe.run());
    assert.deepEqual(violations.map(({ id, nodes }) => [id, nodes[0].html]), []);
    assert.ok(passes.some(({ id }) => id === 'color-contrast'));
  }
});
