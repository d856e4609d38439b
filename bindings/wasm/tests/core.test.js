// The decoder on one thread, in Node.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { before, test } from 'node:test';
import { inflateSync } from 'node:zlib';

import { Decoder, load } from '../dist/core.js';
import { GipError, LimitError, MalformedError } from '../dist/index.js';
import { chunk, exif, leastChunk, makePicture, signature, texture } from './picture.js';
import { swappedProfile } from './profile.js';
import { crc32, parseIndex, resultOf, unlimited } from './vectors.js';

const vectors = new URL('../../../spec/vectors/', import.meta.url);
const read = (file) => new Uint8Array(readFileSync(new URL(file, vectors)));

before(async () => {
  assert.throws(() => new Decoder(), { name: 'GipError', message: /wait for load\(\) first/ });
  await load(readFileSync(new URL('../dist/image_gip_bg.wasm', import.meta.url)));
});

test('every line of the test vectors', async () => {
  const lines = parseIndex(readFileSync(new URL('index.tsv', vectors), 'utf8'));
  assert.ok(lines.length > 150);
  for (const line of lines) {
    const found = await resultOf(new Decoder({ limits: unlimited }), read(line.file), line);
    assert.equal(found, line.result, `${line.file}, ${line.rendering}`);
  }
});

/** A decoder that has read a file. */
function opened(bytes, options) {
  const decoder = new Decoder(options);
  decoder.feed(bytes);
  decoder.finish();
  return decoder;
}

test('header, metadata and statistics', () => {
  const chunks = [
    ['eXIF', Buffer.from('II*\0')],
    ['tEXt', Buffer.from('Title\0A picture')],
    ['xMPD', Buffer.from('<x/>')],
  ];
  const bytes = makePicture({ width: 30, height: 20, layers: [3, 4], chunks });
  const decoder = opened(bytes, { statistics: true });
  assert.deepEqual(decoder.header, {
    version: 1,
    coding: 'packed',
    width: 30,
    height: 20,
    color: 'rgb',
    channels: 3,
    depth: 8,
    gaussians: 7,
    layers: 2,
    kernel: 'quartic',
    cutoff: 4,
    parameterization: 'cholesky',
    baseColor: [117 * 257, 125 * 257, 132 * 257],
  });
  const { metadata } = decoder;
  const { cicp, masteringDisplay, contentLight, iccProfile } = metadata;
  assert.deepEqual([cicp, masteringDisplay, contentLight, iccProfile], [null, null, null, null]);
  assert.deepEqual([...metadata.exif], [...Buffer.from('II*\0')]);
  assert.equal(metadata.xmp, '<x/>');
  assert.deepEqual(metadata.texts, [{ keyword: 'Title', text: 'A picture' }]);
  const statistics = decoder.statistics();
  const [end] = statistics.layers.slice(-1);
  assert.equal(end.end + leastChunk, bytes.length, 'all but the last chunk');
  assert.deepEqual(statistics.chunks.map(({ type }) => type), ['H', 'eXIF', 'tEXt', 'xMPD', 'L', 'E']);
  assert.equal(statistics.chunks.reduce((sum, chunk) => sum + chunk.bytes, 8), bytes.length);
  assert.deepEqual(statistics.attributeBits, { position: 448, precision: 0, shape: 672, color: 672 });
  assert.equal(statistics.quantizationSteps, null);
  decoder.close();
});

test('the Gaussians are those of the file', () => {
  const bytes = makePicture({ layers: [5] });
  const decoder = opened(bytes);
  const numbers = decoder.gaussians();
  assert.equal(numbers.length, 45);
  // The codes end before the CRC of the layer and the last chunk.
  const at = bytes.length - leastChunk - 4 - 5 * 32;
  for (let gaussian = 0; gaussian < 5; gaussian += 1) {
    for (let component = 0; component < 8; component += 1) {
      const stored = bytes.readFloatLE(at + gaussian * 32 + component * 4);
      assert.equal(numbers[gaussian * 9 + component], stored);
    }
    assert.equal(numbers[gaussian * 9 + 8], 0);
  }
  assert.deepEqual(decoder.gaussians({ start: 4, end: 100 }), numbers.slice(36));
  decoder.close();
});

test('what a part of a file has, as a decoder of that part tells', () => {
  const between = [[1, 'tEXt', Buffer.from('Title\0A picture')], [3, 'abCd', Buffer.alloc(300)]];
  const packed = [
    makePicture({ layers: [5, 60] }),
    makePicture({ layers: [3, 130, 2], later: between }),
    read('depths-odd.gip'),
    read('layers.gip'),
  ];
  for (const bytes of [...packed, read('entropy-layers.gip')]) {
    const whole = opened(bytes);
    for (let length = 0; length <= bytes.length; length += 3) {
      const part = new Decoder();
      const { gaussians } = part.feed(bytes.subarray(0, length));
      assert.equal(whole.gaussiansIn(length), gaussians, `${length} bytes`);
      part.close();
    }
    whole.close();
  }
});

test('where layers are does not depend on the pieces in which they come', () => {
  // Types of one and four letters, and lengths of one to three bytes.
  const lengths = [0, 1, 127, 128, 16_383, 16_384];
  const chunks = lengths.map((length) => ['abCd', Buffer.alloc(length, 0x4c)]);
  const later = [...chunks.map((found) => [1, ...found]), ...chunks.map((found) => [2, ...found])];
  const bytes = makePicture({ layers: [3, 130, 600], chunks, later });
  const { layers } = opened(bytes).statistics();
  assert.deepEqual(layers.map(({ gaussians }) => gaussians), [3, 130, 600]);
  for (const { start, end } of layers) {
    assert.equal(bytes[start], 'L'.charCodeAt(0));
    assert.equal(crc32(bytes.subarray(start, end - 4)), bytes.readUInt32LE(end - 4));
  }
  for (const piece of [1, 2, 5, 4096]) {
    const decoder = new Decoder();
    for (let at = 0; at < bytes.length; at += piece) decoder.feed(bytes.subarray(at, at + piece));
    assert.deepEqual(decoder.statistics().layers, layers, `pieces of ${piece} bytes`);
    decoder.close();
  }
});

test('what comes after layers is told, and rendered from then on', () => {
  const layers = [40, 160];
  const profile = swappedProfile();
  const chunks = [['iCCP', profile]];
  const later = [
    [2, 'tXTR', texture],
    [2, 'eXIF', exif(1)],
    [2, 'tEXt', Buffer.from('Title\0A picture')],
  ];
  const bytes = makePicture({ layers, chunks, later });
  const decoder = new Decoder();
  const seen = new Set();
  for (const byte of bytes) {
    const { orientation, colorSpace, texture, complete } = decoder.feed(Uint8Array.of(byte));
    seen.add(String([orientation, colorSpace, texture, complete]));
    assert.equal(decoder.textureMap() !== null, texture);
    assert.equal(decoder.metadata.iccProfile !== null, colorSpace);
  }
  assert.deepEqual([...seen], [
    ',false,false,false',
    ',true,false,false',
    '1,true,false,false',
    '1,true,true,false',
    '1,true,true,true',
  ]);
  const { metadata } = decoder;
  assert.deepEqual(Buffer.from(metadata.iccProfile), profile);
  assert.deepEqual(Buffer.from(metadata.exif), exif(1));
  assert.deepEqual(metadata.texts, [{ keyword: 'Title', text: 'A picture' }]);

  // The same picture as with all of it at the beginning.
  const all = [...chunks, ...later.map(([, ...found]) => found)];
  const early = opened(makePicture({ layers, chunks: all }));
  const plain = opened(makePicture({ layers }));
  assert.deepEqual(decoder.samples(), early.samples());
  assert.notDeepEqual(decoder.samples(), plain.samples());
  for (const opened of [decoder, early, plain]) opened.close();
});

test('codes of a colour space, mastering display and content light go into the PNG file', async () => {
  const chunks = [
    ['cICP', Buffer.from([9, 16, 0, 1])],
    ['mDCV', Buffer.from('8a48390821349baa199608fc3d1340420098968000000032', 'hex')],
    ['cLLI', Buffer.from('007bf44000000000', 'hex')],
  ];
  const decoder = opened(makePicture({ layers: [40], chunks }));
  const { cicp, masteringDisplay, contentLight } = decoder.metadata;
  assert.deepEqual([...cicp], [9, 16]);
  assert.deepEqual(Buffer.from(masteringDisplay), chunks[1][1]);
  assert.deepEqual(Buffer.from(contentLight), chunks[2][1]);
  assert.equal(decoder.progress.colorSpace, true);
  const png = Buffer.from(await decoder.png());
  const bodies = chunks.map(([type, payload]) => Buffer.concat([Buffer.from(type), payload]));
  let at = 33;
  for (const body of bodies) {
    assert.equal(png.readUInt32BE(at), body.length - 4);
    assert.deepEqual(png.subarray(at + 4, at + 4 + body.length), body);
    at += 8 + body.length;
  }
  decoder.close();
});

test('an orientation comes before the first layer, or does not count', () => {
  const decoder = opened(makePicture({ layers: [40, 160], later: [[1, 'eXIF', exif(6)]] }));
  assert.deepEqual([decoder.orientation, decoder.progress.gaussians, decoder.metadata.exif], [1, 200, null]);
  const { width, height } = decoder.render();
  assert.deepEqual([width, height], [96, 64]);
  decoder.close();
});

test('errors name the letters of a chunk, and say what they stand for', () => {
  const bytes = makePicture({ layers: [3] });
  const changed = (at, value) => bytes.map((byte, index) => (index === at ? value : byte));
  const unknown = chunk('X', Buffer.alloc(3));
  const cases = [
    // Another version, which is no other file.
    [changed(6, 2), 'UnsupportedError', 'H', /chunk H \(header\): unsupported: version 2/],
    [changed(9, 200), 'UnsupportedError', 'H', /chunk H \(header\): unsupported: length 6472/],
    [changed(bytes.length - leastChunk - 5, 0), 'MalformedError', 'L', /chunk L \(layer\): the CRC/],
    [changed(bytes.length - 1, 0), 'MalformedError', 'E', /chunk E \(end\): the CRC/],
    [Buffer.concat([bytes.subarray(0, -leastChunk), unknown]), 'UnsupportedError', 'X', /chunk X: unsupported/],
    [changed(bytes.length - leastChunk, 7), 'MalformedError', '\\x07', /chunk \\x07: the type/],
  ];
  for (const [file, name, letters, message] of cases) {
    assert.throws(() => opened(file), { name, chunk: letters, message });
  }
  for (const at of signature.keys()) {
    if (at !== 6) assert.throws(() => opened(changed(at, bytes[at] ^ 1)), { name: 'SignatureError', chunk: null });
  }
});

test('texture is rendered, unless it is left out', () => {
  const textured = opened(makePicture({ chunks: [['tXTR', texture]] }));
  const plain = opened(makePicture());
  for (const options of [{}, { width: 300 }, { width: 30, region: { x: 3, y: 2, width: 20, height: 10 } }]) {
    const { data } = plain.samples(options);
    assert.deepEqual(plain.samples({ ...options, texture: true }).data, data);
    assert.deepEqual(textured.samples({ ...options, texture: false }).data, data);
    const found = textured.samples(options).data;
    assert.deepEqual(textured.samples({ ...options, texture: undefined }).data, found);
    const changed = found.filter((sample, index) => Math.abs(sample - data[index]) > 3);
    assert.ok(changed.length > 0.2 * data.length, `${changed.length} of ${data.length} samples`);
  }
  const map = textured.textureMap();
  assert.equal(map.length, 3 * 13 * 9);
  // Strengths are more than nothing somewhere, and streaks have both directions.
  for (const octave of [0, 1]) {
    assert.ok(map.slice(octave * 117, octave * 117 + 117).some((sum) => sum > 0.1), `octave ${octave}`);
  }
  const directions = map.slice(2 * 117);
  assert.ok(Math.max(...directions) > 0.6 && Math.min(...directions) < 0.4);
  assert.equal(plain.textureMap(), null);
  assert.equal(new Decoder().textureMap(), null);
});

test('an output that is rendered in strips is the same', () => {
  const decoder = opened(makePicture({ layers: [50] }));
  const [width, height] = [3000, 2000];
  const { data } = decoder.render({ width, height });
  assert.equal(data.length, width * height * 4);
  // Rows on both sides of the border between strips.
  const y = Math.floor(2 ** 22 / width) - 2;
  const part = decoder.render({ width, height, region: { x: 0, y, width, height: 4 } });
  assert.deepEqual(part.data, data.subarray(y * width * 4, (y + 4) * width * 4));
  decoder.close();
});

test('a PNG file has the samples', async () => {
  const decoder = opened(makePicture({ width: 200, height: 150, layers: [20] }));
  const png = Buffer.from(await decoder.png());
  const at = png.indexOf('IDAT');
  const rows = inflateSync(png.subarray(at + 4, at + 4 + png.readUInt32BE(at - 4)));
  const { data } = decoder.samples();
  assert.equal(rows.length, 150 * 601);
  assert.deepEqual([...rows.subarray(601 * 3 + 1, 601 * 4)], [...data.subarray(600 * 3, 600 * 4)]);
  assert.equal(png.readUInt32BE(at + 4 + png.readUInt32BE(at - 4)), crc32(png.subarray(at, png.indexOf('IEND') - 8)));
  decoder.close();
});

test('requests that cannot be met', () => {
  const decoder = opened(makePicture());
  const kinds = [
    [{ width: 0 }, RangeError],
    [{ width: -1 }, RangeError],
    [{ width: 2 ** 24 }, RangeError],
    [{ width: Number.NaN }, RangeError],
    [{ region: { x: 0, y: 0, width: 97, height: 1 } }, RangeError],
    [{ region: { x: 2 ** 32 - 1, y: 0, width: 2 ** 32 - 1, height: 1 } }, RangeError],
    [{ width: 2 ** 23, height: 2 ** 23 }, LimitError],
    [{ gaussians: 1.5 }, RangeError],
  ];
  for (const [options, kind] of kinds) {
    assert.throws(() => decoder.render(options), kind, JSON.stringify(options));
  }
  assert.throws(() => decoder.samples({ color: 'gray' }), RangeError);
  for (const color of ['cmyk', 'toString', 'constructor', '__proto__']) {
    const error = { name: 'RangeError', message: `color is ${color}; it must be one of gray,gray-alpha,rgb,rgba` };
    assert.throws(() => decoder.samples({ color }), error);
  }
  assert.throws(() => decoder.samples({ depth: 12 }), RangeError);
  assert.equal(decoder.render().data.length, 96 * 64 * 4, 'it can still render');
  decoder.close();
});

test('before the header, and after close', async () => {
  const decoder = new Decoder();
  const end = { name: 'UnexpectedEndError' };
  assert.throws(() => decoder.render(), end);
  assert.throws(() => decoder.samples(), end);
  assert.throws(() => decoder.samples({ color: 'rgb', depth: 16, orientation: 'from-image' }), end);
  await assert.rejects(decoder.png(), end);
  assert.equal(decoder.gaussians({ orientation: 'from-image' }).length, 0);
  decoder.close();
  decoder.close();
  const closed = { name: 'GipError', message: 'the decoder is closed' };
  for (const call of [
    () => decoder.feed(new Uint8Array()),
    () => decoder.finish(),
    () => decoder.progress,
    () => decoder.metadata,
    () => decoder.render(),
    () => decoder.samples(),
    () => decoder.gaussiansIn(5),
  ]) {
    assert.throws(call, closed);
  }
  await assert.rejects(decoder.png(), closed);
});

test('limits', () => {
  const bytes = makePicture();
  const limited = (limits) => () => opened(bytes, { limits }).render();
  assert.throws(limited({ pixels: 100 }), LimitError);
  assert.throws(limited({ gaussians: 100 }), LimitError);
  assert.throws(limited({ memory: 1000 }), LimitError);
  const small = (work) => opened(bytes, { limits: { work } }).render({ width: 1, height: 1 });
  // Counting ends with the first Gaussian that is too many.
  const most = { limit: 'work', allowed: 12 * 16 * 64 + 1000 };
  assert.throws(() => small(1000), most);
  assert.throws(() => small(1000), LimitError);
  // 200 Gaussians in 2 x 2 tiles.
  small(200 * 4 * 64);
  assert.throws(limited({ outputPixels: 100 }), { limit: 'outputPixels', wanted: 6144, allowed: 100 });
  for (const value of [Number.NaN, -1, '100', 5n]) {
    const message = `limits.memory is ${value}; it must be a number from 0 to Infinity`;
    assert.throws(limited({ memory: value }), { name: 'RangeError', message });
  }
  limited({ memory: Infinity, work: undefined })();
  // Which one it was can be raised by its name.
  for (const [limit, size] of [['height', { width: 2, height: 65_537 }], ['width', { width: 65_537, height: 2 }]]) {
    const long = makePicture({ ...size, layers: [3] });
    const error = { limit, wanted: 65_537, allowed: 65_536, message: new RegExp(`${limit}: 65537 required.*limits: { ${limit}: ... }`) };
    assert.throws(() => opened(long), error);
    const { data } = opened(long, { limits: { [limit]: 65_537 } }).render();
    assert.equal(data.length, 4 * 2 * 65_537);
  }
});

test('after an error there is what came before it', () => {
  const bytes = read('xcrc-layer.gip');
  const decoder = new Decoder();
  assert.throws(() => decoder.feed(bytes), MalformedError);
  assert.equal(decoder.progress.gaussians, 1);
  assert.ok(decoder.render().data.length > 0);
  assert.throws(() => decoder.feed(bytes), GipError);
  decoder.close();
});
