// The encoder, in Node and in a browser.

import assert from 'node:assert/strict';
import { availableParallelism } from 'node:os';
import { test } from 'node:test';

import { encode } from 'image-gip/encoder';
import * as core from 'image-gip/encoder/core';
import * as decoder from 'image-gip/core';

import { harness, inPage, withPage } from './harness.js';
import { sample } from './sample.js';

/** The file's samples, and their PSNR against others. */
async function decodedPsnr(file, { channels, data }) {
  await decoder.load();
  const picture = new decoder.Decoder();
  picture.feed(file);
  picture.finish();
  const samples = picture.samples({ texture: false });
  assert.equal(samples.channels, channels);
  const squares = samples.data.reduce((sum, value, at) => sum + (value - data[at]) ** 2, 0);
  picture.close();
  return 10 * Math.log10((255 ** 2 * data.length) / squares);
}

const options = { bytes: 1500, effort: 1 };

test('a file is a picture of the size that was asked for, and its report is right', async () => {
  const picture = sample({ channels: 3 });
  const seen = [];
  const { file, report } = await encode(picture, { ...options, onprogress: ({ fraction }) => seen.push(fraction) });
  assert.ok(file.length <= 1500 && file.length > 1400, file.length);
  assert.equal(report.shortfall, null);
  assert.ok(report.gaussians > 50 && report.iterations > 0);
  const psnr = await decodedPsnr(file, picture);
  assert.ok(Math.abs(psnr - report.psnr) < 0.01 && psnr > 30, `${psnr}, ${report.psnr}`);
  assert.ok(seen.length > 0 && seen.every((fraction, at) => fraction <= 1 && fraction >= (seen[at - 1] ?? 0)), seen);
});

test('files are the same in Node, in a browser and on its own thread, of files and of one script', async () => {
  const picture = sample();
  const { file } = await encode(picture, options);
  await core.load();
  const again = core.encode(picture, options);
  assert.deepEqual(again.file, file);
  const inBrowser = await inPage(
    async (_, { picture, options }) => {
      const image = { ...picture, data: new Uint8Array(picture.data) };
      const files = [];
      for (const script of ['/dist/encoder.js', '/dist/embedded/encoder.js']) {
        const { encode } = await import(script);
        files.push([...(await encode(image, options)).file]);
      }
      return files;
    },
    { picture: { ...picture, data: [...picture.data] }, options },
  );
  for (const other of inBrowser) assert.deepEqual(other, [...file]);
});

test('channels in which there is nothing are left out, and 16 bits stay', async () => {
  await core.load();
  await decoder.load();
  const headerOf = (image) => {
    const picture = new decoder.Decoder();
    picture.feed(core.encode(image, { gaussians: 20, effort: 1 }).file);
    const { color, depth } = picture.header;
    picture.close();
    return `${color} ${depth}`;
  };
  const opaque = sample({ width: 24, height: 16 });
  assert.equal(headerOf({ ...opaque, channels: undefined }), 'rgb 8');
  assert.equal(headerOf(opaque), 'rgba 8');
  const gray = { width: 24, height: 16, data: opaque.data.map((value, at) => (at % 4 < 3 ? 9 + (at >> 4) : 255)) };
  assert.equal(headerOf(gray), 'gray 8');
  const half = gray.data.map((value, at) => (at === 3 ? 128 : value));
  assert.equal(headerOf({ ...gray, data: half }), 'gray-alpha 8');
  assert.equal(headerOf({ ...opaque, data: Uint16Array.from(opaque.data, (value) => value * 257) }), 'rgba 16');
});

test('what is out of range is refused, with words', async () => {
  const picture = sample({ width: 16, height: 16 });
  const refused = async (error, image, options) => {
    await assert.rejects(encode(image, options), error);
    assert.throws(() => core.encode(image, options), error);
  };
  await core.load();
  await refused({ name: 'RangeError', message: /effort is 8; it must be an integer from 1 to 7/ }, picture, { effort: 8 });
  await refused({ name: 'TypeError', message: /bytes and quality|quality and bytes/ }, picture, { bytes: 900, quality: 50 });
  await refused({ name: 'RangeError', message: /firstLayer is 10/ }, picture, { firstLayer: 10 });
  await refused({ name: 'RangeError', message: /256 samples/ }, { ...picture, data: new Uint8Array(256) });
  await refused({ name: 'TypeError', message: /must have data/ }, { width: 1, height: 1 });
  for (const metadata of [{ exif: 'II*' }, { iccProfile: new ArrayBuffer(8) }]) {
    await refused({ name: 'TypeError', message: /must be a Uint8Array/ }, picture, { metadata });
  }
  await refused({ name: 'RangeError', message: /cicp is 300/ }, picture, { metadata: { cicp: [300, 1] } });
  // This is refused by the encoder itself.
  await refused({ name: 'RangeError', message: /invalid option/ }, picture, {
    metadata: { texts: [{ keyword: '', text: 'nothing' }] },
  });
});

test('an encoding can be aborted, and the next one is none the worse', async () => {
  const picture = sample({ width: 320, height: 240 });
  await assert.rejects(encode(picture, { signal: AbortSignal.abort() }), { name: 'AbortError' });
  const controller = new AbortController();
  const long = encode(picture, { effort: 7, signal: controller.signal, onprogress: () => controller.abort() });
  await assert.rejects(long, { name: 'AbortError' });
  await core.load();
  assert.throws(() => core.encode(picture, { effort: 7, onprogress: () => false }), { name: 'AbortError' });
  const { file } = await encode(sample(), options);
  assert.deepEqual(core.encode(sample(), options).file, file);
});

test('pictures that wait for a worker can be aborted as well', async () => {
  const controller = new AbortController();
  const { signal } = controller;
  const picture = sample({ width: 320, height: 240 });
  const all = Array.from({ length: availableParallelism() + 1 }, () => encode(picture, { effort: 7, signal }));
  const waiting = new AbortController();
  const last = encode(sample(), { ...options, signal: waiting.signal });
  waiting.abort();
  // None of the others is done.
  assert.equal(await Promise.race([last.catch(({ name }) => name), ...all]), 'AbortError');
  controller.abort();
  for (const { reason } of await Promise.allSettled(all)) assert.equal(reason.name, 'AbortError');
});

test('what no worker can be sent, and a listener that throws, are told, and the next picture is made', async () => {
  const gone = sample();
  assert.ok((await encode(gone, { ...options, transfer: true })).file.length > 0);
  const shared = { ...sample(), data: new Uint8Array(new SharedArrayBuffer(sample().data.length)) };
  const failed = () => {
    throw new Error('a fault of the page');
  };
  for (let more = availableParallelism(); more >= 0; more -= 1) {
    await assert.rejects(encode(gone, { ...options, transfer: true }), { name: 'RangeError', message: /^0 samples/ });
    await assert.rejects(encode(sample(), { ...options, metadata: { xmp: () => '' } }), { name: 'DataCloneError' });
    await assert.rejects(encode(sample(), { ...options, onprogress: failed }), /a fault of the page/);
  }
  assert.ok((await encode(shared, { ...options, transfer: true })).file.length > 0);
  assert.ok((await encode(sample(), options)).file.length > 0);
});

test('more pictures than workers are all encoded', async () => {
  const pictures = [8, 16, 24, 32, 40, 48].map((width) => sample({ width, height: 16 }));
  const all = await Promise.all(pictures.map((picture) => encode(picture, { gaussians: 10, effort: 1 })));
  await decoder.load();
  for (const [at, { file }] of all.entries()) {
    const picture = new decoder.Decoder();
    picture.feed(file);
    assert.equal(picture.header.width, pictures[at].width);
    picture.close();
  }
});

const alone = availableParallelism() < 2 && 'there is one core';
test('several pictures are encoded at the same time, to the files that they have alone', { skip: alone }, async () => {
  const options = { bytes: 6000, effort: 3 };
  const pictures = [320, 321].map((width) => sample({ width, height: 200, channels: 3 }));
  const events = [];
  const encoded = (picture, at) =>
    encode(picture, { ...options, onprogress: () => events.push(at) }).then(({ file }) => (events.push('end'), file));
  const files = await Promise.all(pictures.map(encoded));
  assert.deepEqual(new Set(events.slice(0, events.indexOf('end'))), new Set([0, 1]));
  await core.load();
  for (const [at, picture] of pictures.entries()) assert.deepEqual(core.encode(picture, options).file, files[at]);
});

test('a browser encodes what it can draw, and keeps Display P3', async () => {
  const found = await inPage(async ({ open }) => {
    const { encode } = await import('/dist/encoder.js');
    const canvas = new OffscreenCanvas(40, 30);
    const context = canvas.getContext('2d');
    context.fillStyle = 'rgb(200 40 90)';
    context.fillRect(0, 0, 40, 30);
    context.fillStyle = 'rgb(20 140 90)';
    context.fillRect(5, 5, 20, 20);
    const blob = await canvas.convertToBlob();
    const image = new Image();
    image.src = URL.createObjectURL(blob);
    const facts = [];
    for (const source of [canvas, blob, image, await createImageBitmap(blob), context.getImageData(0, 0, 40, 30)]) {
      const { file } = await encode(source, { gaussians: 30, effort: 1 });
      const picture = await open(file);
      facts.push([picture.header.width, picture.header.color, (await picture.metadata()).cicp, file.length]);
      picture.close();
    }
    const { file } = await encode(blob, { gaussians: 30, effort: 1, colorSpace: 'display-p3' });
    const picture = await open(file);
    const refused = [];
    const empty = Object.assign(document.createElement('canvas'), { width: 0 });
    const ofSvg = document.createElementNS('http://www.w3.org/2000/svg', 'image');
    for (const source of [document.createElement('video'), empty, ofSvg]) {
      await encode(source).catch(({ name, message }) => refused.push(`${name}: ${message}`));
    }
    return { facts, refused, cicp: [...(await picture.metadata()).cicp] };
  });
  assert.match(found.refused.join('; '), /^RangeError: .* 0 x 0 pixels; RangeError: .* 0 x 150 pixels; TypeError: a picture must have data/);
  for (const fact of found.facts) assert.deepEqual(fact, [40, 'rgb', null, found.facts[0][3]]);
  assert.deepEqual(found.cicp, [12, 13]);
});

test('without workers a page encodes on its own thread', async () => {
  const headers = {
    'Content-Security-Policy': "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; connect-src 'self'; worker-src 'none'",
  };
  harness.routes['/encode.js'] = (_, response) => {
    response.writeHead(200, { 'Content-Type': 'text/javascript' });
    response.end(`import { encode } from '/dist/encoder.js';
      const data = new Uint8Array(16 * 16 * 3).map((_, at) => at % 251);
      encode({ width: 16, height: 16, channels: 3, data }, { gaussians: 10, effort: 1 })
        .then(({ file }) => { document.title = String(file.length > 40); }, (error) => { document.title = error.message; });`);
  };
  await withPage('<script type="module" src="/encode.js"></script>', async (page) => {
    await page.waitForFunction(() => document.title !== 'test');
    assert.equal(await page.title(), 'true');
    assert.equal(page.workers().length, 0);
  }, { headers, quiet: true });
});
