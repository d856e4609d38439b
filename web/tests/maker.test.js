// A picture that the page makes a .gip of.

import assert from 'node:assert/strict';
import { existsSync } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { after, before, test } from 'node:test';

import { drop, missing, openViewer, settled, start } from './viewer.js';

let viewer;

if (!missing) {
  before(async () => {
    viewer = await start();
  });
  after(() => viewer?.stop());
}

/** A PNG of a disc on a gradient, made in the page. */
async function picture(page, { width = 160, height = 120 } = {}) {
  const text = await page.evaluate(async ([width, height]) => {
    const canvas = new OffscreenCanvas(width, height);
    const context = canvas.getContext('2d');
    const gradient = context.createLinearGradient(0, 0, width, height);
    gradient.addColorStop(0, 'rgb(30 60 140)');
    gradient.addColorStop(1, 'rgb(240 180 90)');
    context.fillStyle = gradient;
    context.fillRect(0, 0, width, height);
    context.fillStyle = 'rgb(250 240 220)';
    context.arc(width / 3, height / 2, height / 4, 0, 7);
    context.fill();
    const bytes = new Uint8Array(await (await canvas.convertToBlob()).arrayBuffer());
    return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(''));
  }, [width, height]);
  return { name: 'evening.png', type: 'image/png', bytes: Buffer.from(text, 'base64') };
}

/** Waits until the file is made, and its picture is at rest. */
async function made(page) {
  await page.waitForSelector('#maker[aria-busy="false"] [name="download"]:not(:disabled)');
  await settled(page);
}

const download = async (page) => {
  const [file] = await Promise.all([page.waitForEvent('download'), page.click('#maker [name="download"]')]);
  return { name: file.suggestedFilename(), bytes: await readFile(await file.path()) };
};

function onPage(name, options, run) {
  test(name, { skip: missing, timeout: 90_000 }, async () => {
    const { page, problems, close } = await openViewer(viewer, '/', { reducedMotion: 'reduce', ...options });
    try {
      await run(page);
      assert.deepEqual(problems, []);
    } finally {
      await close();
    }
  });
}

onPage('a picture that is dropped becomes a .gip, with the original beside it', {}, async (page) => {
  await drop(page, await picture(page));
  await made(page);
  assert.equal(await page.title(), 'evening.gip - gip viewer');
  assert.equal(await page.textContent('#beside'), 'original');
  assert.equal(await page.getAttribute('[data-action="compare"]', 'aria-pressed'), 'true');
  assert.match(await page.textContent('#maker [name="size"]'), /^original: [\d,]+ bytes; \.gip: [\d,]+ bytes$/);
  const { name, bytes } = await download(page);
  assert.equal(name, 'evening.gip');
  assert.deepEqual([...bytes.subarray(0, 4)], [0xc7, 0x47, 0x49, 0x50]);
  // Half a bit for each of 160 x 120 pixels.
  assert.ok(bytes.length <= 1200 && bytes.length > 600, bytes.length);
});

const animated = { reducedMotion: 'no-preference' };

onPage('while it is made, Gaussians and PSNR are told, and the first file arrives layer by layer', animated, async (page) => {
  await page.evaluate(() => {
    globalThis.texts = [];
    for (const place of document.querySelectorAll('#maker [name="work"] span, #shown')) {
      const what = { subtree: true, childList: true, characterData: true };
      new MutationObserver(() => globalThis.texts.push(place.textContent)).observe(place, what);
    }
  });
  await drop(page, await picture(page, { width: 320, height: 240 }));
  await made(page);
  const texts = await page.evaluate(() => globalThis.texts);
  const countsOf = (pattern) => texts.flatMap((text) => pattern.exec(text)?.[1] ?? []).map((text) => Number(text.replaceAll(',', '')));
  const told = countsOf(/^([\d,]+) Gaussians · [\d.]+ dB$/);
  assert.ok(told[0] > 0 && new Set(told).size > 3 && told.at(-1) > 2 * told[0], told.join());
  const arrived = countsOf(/bytes([\d,]+) Gaussians$/);
  // The last of the files is the one with all bytes.
  const last = [...new Set(arrived.slice(arrived.lastIndexOf(0)))];
  assert.ok(last.length > 3, arrived.join());
  assert.deepEqual(last, last.toSorted((a, b) => a - b));
});

onPage('with more bytes it is made anew, and the window stays where it is', {}, async (page) => {
  await drop(page, await picture(page));
  await made(page);
  const first = (await download(page)).bytes.length;
  await page.keyboard.press('+');
  await settled(page);
  const zoom = await page.textContent('#zoom');
  await page.locator('#maker [name="bytes"]').fill('800');
  await page.waitForSelector('#maker[aria-busy="true"]');
  await made(page);
  assert.ok((await download(page)).bytes.length > 1.5 * first);
  assert.equal(await page.textContent('#zoom'), zoom);
});

onPage('it is compared with what the browser makes of as many bytes', {}, async (page) => {
  await drop(page, await picture(page, { width: 320, height: 240 }));
  await made(page);
  const { length } = (await download(page)).bytes;
  for (const [type, label] of [['image/jpeg', 'JPEG'], ['image/webp', 'WebP']]) {
    await page.selectOption('#maker [name="rival"]', type);
    await page.waitForFunction((label) => document.querySelector('#maker [name="size"]').textContent.startsWith(label), label);
    const text = await page.textContent('#maker [name="size"]');
    const bytes = Number(/: ([\d,]+) bytes/.exec(text)[1].replaceAll(',', ''));
    assert.ok(bytes <= length || text.includes('none that is as small'), text);
    assert.equal(await page.textContent('#beside'), label);
  }
  await page.selectOption('#maker [name="rival"]', 'image/avif');
  await page.waitForSelector('#message:not([hidden])');
  assert.match(await page.textContent('#message p'), /does not write AVIF/);
  await page.selectOption('#maker [name="rival"]', 'image/webp');
  await page.waitForSelector('#message', { state: 'hidden' });
});

onPage('a .gip that is opened takes its place, and encoding can be stopped', {}, async (page) => {
  await drop(page, await picture(page, { width: 640, height: 480 }));
  await page.waitForSelector('#maker [name="cancel"]:not([hidden])');
  assert.ok(await page.isHidden('#welcome'), 'the picture is there already');
  await page.click('#maker [name="cancel"]');
  await page.waitForSelector('#maker[aria-busy="false"]');
  const sample = await readFile(new URL('../sample/sumac.gip', import.meta.url));
  await drop(page, { name: 'sumac.gip', bytes: sample });
  await settled(page);
  assert.equal(await page.title(), 'sumac.gip - gip viewer');
  assert.equal(await page.isHidden('#maker'), true);
});

for (const [place, width, height, least] of [['a phone', 360, 740, 300], ['a phone on its side', 640, 360, 200], ['a tablet', 820, 1180, 900]]) {
  onPage(`it fits on ${place}`, { viewport: { width, height }, hasTouch: true, colorScheme: 'dark' }, async (page) => {
    await drop(page, { ...(await picture(page)), name: 'a name that is long.png' });
    await made(page);
    const wide = await page.evaluate(() => document.documentElement.scrollWidth);
    assert.ok(wide <= width, wide);
    const stage = await page.locator('#stage').boundingBox();
    assert.ok(stage.height > least, stage.height);
    const name = await page.locator('#name').boundingBox();
    assert.ok(name.width > 100, name.width);
    const [download] = await Promise.all([page.waitForEvent('download'), page.click('#maker [name="download"]')]);
    assert.equal(download.suggestedFilename(), 'a name that is long.gip');
  });
}

onPage('its menus are chosen from with keys', {}, async (page) => {
  await drop(page, await picture(page));
  await made(page);
  await page.focus('#maker [name="rival"]');
  await page.keyboard.press('ArrowDown');
  assert.equal(await page.inputValue('#maker [name="rival"]'), 'image/jpeg');
  await page.keyboard.press('o');
  assert.equal(await page.inputValue('#maker [name="rival"]'), 'original');
  assert.equal(await page.getAttribute('[data-action="outlines"]', 'aria-pressed'), 'false');
  await page.keyboard.press('?');
  assert.ok(await page.isVisible('#help'));
});

onPage('what cannot be read, such as a folder, is told', {}, async (page) => {
  await page.evaluate(() => {
    Blob.prototype.arrayBuffer = () => Promise.reject(new DOMException('It has gone.', 'NotFoundError'));
  });
  await drop(page, { name: 'folder', bytes: Buffer.alloc(0) });
  await page.waitForSelector('#message:not([hidden])');
  assert.equal(await page.textContent('#message p'), 'It has gone.');
});

const threads = new URL('../../bindings/wasm/dist/encoder-threads.js', import.meta.url);
const skip = missing || (!existsSync(threads) && 'the package was built without threads');
test('with the headers for it, a picture is encoded with threads', { skip, timeout: 90_000 }, async () => {
  const { page, problems, close } = await openViewer(viewer, '/', { reducedMotion: 'reduce' });
  try {
    // Two of them for the encoder.
    await page.addInitScript(() => Object.defineProperty(navigator, 'hardwareConcurrency', { value: 3 }));
    const requests = [];
    page.on('request', (request) => requests.push(request.url()));
    await page.reload();
    await drop(page, await picture(page));
    await made(page);
    assert.deepEqual(problems, []);
    assert.ok(requests.some((url) => url.endsWith('image_gip_encoder_threads_bg.wasm')), requests);
    assert.ok(!requests.some((url) => url.endsWith('image_gip_encoder_bg.wasm')), requests);
  } finally {
    await close();
  }
});
