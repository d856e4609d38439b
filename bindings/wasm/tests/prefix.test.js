// Small files that are cut off: the module `image-gip/prefix`, in Node, where no WebAssembly is loaded.

import assert from 'node:assert/strict';
import { readFileSync, readdirSync } from 'node:fs';
import { test } from 'node:test';

import { GipError, MalformedError, UnexpectedEndError, prefix, prefixes } from '../dist/prefix.js';
import { chunk, exif, makePicture, signature, texture } from './picture.js';
import { crc32 } from './vectors.js';

const vectors = new URL('../../../spec/vectors/', import.meta.url);
const read = (file) => new Uint8Array(readFileSync(new URL(file, vectors)));
const end = chunk('E', Buffer.alloc(0));
const header = (fields) => chunk('H', Buffer.from(fields));
/** 96 x 64 gray pixels of the packed coding with kernel 1: these Gaussians and layers, in one byte each. */
const grayHeader = (gaussians, layers) =>
  header([0x30, 96, 64, gaussians, layers, 128, ...Array(6).fill([0, 32]).flat()]);

test('the vectors have the prefixes that the Rust crate finds, byte for byte', () => {
  const table = readFileSync(new URL('../../../tests/prefixes.tsv', import.meta.url), 'utf8');
  const lines = ['file\tlayers\tgaussians\tbytes\tend\tcrc32'];
  const names = [...new Set(readFileSync(new URL('index.tsv', vectors), 'utf8').match(/^[^x\s]\S*\.gip/gm))];
  for (const name of names) {
    const bytes = read(name);
    for (const found of prefixes(bytes)) {
      const file = prefix(bytes, found.bytes);
      assert.equal(file.length, found.bytes);
      const crc = crc32(file).toString(16).padStart(8, '0');
      lines.push([name, found.layers, found.gaussians, found.bytes, found.end, crc].join('\t'));
    }
  }
  assert.ok(lines.length > 60);
  assert.deepEqual(lines, table.trimEnd().split('\n'));
});

test('a prefix is the file of its layers, with what says how the picture is shown', () => {
  const shown = [
    ['cICP', Buffer.from([9, 16, 0, 1])],
    ['mDCV', Buffer.alloc(24, 1)],
    ['cLLI', Buffer.alloc(8, 2)],
    ['iCCP', Buffer.alloc(300, 3)],
    ['eXIF', exif(6)],
  ];
  const others = [
    ['tXTR', texture],
    ['xMPD', Buffer.from('<x/>')],
    ['tEXt', Buffer.from('Title\0Waves')],
    // A second profile does not count, nor do broken chunks.
    ['iCCP', Buffer.from('another')],
    ['prIv', Buffer.alloc(9)],
  ];
  const layers = [5, 130, 300];
  const options = { width: 300, height: 200 };
  const whole = makePicture({ ...options, layers, chunks: [...shown, ...others] });
  const found = prefixes(whole);
  const kept = [...shown.slice(0, -1), ['eXIF', rotated]];
  for (const count of [1, 2, 3]) {
    const expected = makePicture({ ...options, layers: layers.slice(0, count), chunks: kept });
    const { bytes, gaussians, end } = found[count - 1];
    assert.deepEqual(Buffer.from(prefix(whole, bytes)), expected);
    assert.deepEqual(Buffer.from(prefix(whole, found[count]?.bytes - 1 || Infinity)), expected);
    assert.equal(gaussians, layers.slice(0, count).reduce((a, b) => a + b));
    // The beginning of the file is enough, and not one byte less.
    assert.deepEqual(prefixes(whole.subarray(0, end)), found.slice(0, count));
    assert.deepEqual(prefixes(whole.subarray(0, end - 1)), found.slice(0, count - 1));
  }
  // What stands after the first layer does not count.
  const late = makePicture({ ...options, layers, later: [[1, ...shown[0]], [3, ...shown[3]]] });
  assert.deepEqual(Buffer.from(prefix(late, Infinity)), makePicture({ ...options, layers }));
});

test('chunks that do not say how the picture is shown, or are broken, are left out', () => {
  const bare = makePicture({ layers: [5] });
  const entry = (change) => {
    const bytes = exif(6);
    change(bytes);
    return bytes;
  };
  for (const [type, payload] of [
    ['eXIF', exif(1)],
    ['eXIF', exif(0)],
    ['eXIF', exif(9)],
    ['eXIF', Buffer.from('II')],
    ['eXIF', Buffer.from('GIF89a, and more')],
    // The directory is not there, or its entry not as a whole.
    ['eXIF', entry((bytes) => bytes.writeUInt32BE(2 ** 32 - 1, 4))],
    ['eXIF', exif(6).subarray(0, 21)],
    // Another type, and another count.
    ['eXIF', entry((bytes) => bytes.writeUInt16BE(4, 12))],
    ['eXIF', entry((bytes) => bytes.writeUInt32BE(2, 14))],
    ['cICP', Buffer.from([9, 16, 0])],
    ['cICP', Buffer.from([9, 16, 1, 1])],
    ['cICP', Buffer.from([9, 16, 0, 0])],
    ['mDCV', Buffer.alloc(23)],
    ['cLLI', Buffer.alloc(9)],
  ]) {
    const file = makePicture({ layers: [5], chunks: [[type, payload]] });
    assert.deepEqual(Buffer.from(prefix(file, Infinity)), bare, `${type} ${payload.toString('hex')}`);
  }
  // Of Exif the orientation alone is kept, and of two the first one counts.
  const long = Buffer.concat([rotated, Buffer.alloc(9000, 7)]);
  const expected = makePicture({ layers: [5], chunks: [['eXIF', rotated]] });
  const turned = makePicture({ layers: [5], chunks: [['eXIF', long], ['eXIF', exif(3)]] });
  assert.deepEqual(Buffer.from(prefix(turned, Infinity)), expected);
  const upright = makePicture({ layers: [5], chunks: [['eXIF', exif(1)], ['eXIF', exif(6)]] });
  assert.deepEqual(Buffer.from(prefix(upright, Infinity)), bare);
});

test('sizes and arguments that are refused', () => {
  const file = makePicture({ layers: [5, 5] });
  const least = prefixes(file)[0].bytes;
  assert.throws(() => prefix(file, least - 1), {
    name: 'RangeError',
    message: `the file of the first layer has ${least} bytes; maxBytes is ${least - 1}, and must be ${least} at least`,
  });
  for (const size of [Number.NaN, -1, '300', undefined, 300n]) {
    assert.throws(() => prefix(file, size), { name: 'RangeError', message: /^maxBytes is .*; it must be a number/ });
  }
  for (const bytes of [undefined, 'text', [1, 2], new Uint16Array(9), new ArrayBuffer(9)]) {
    assert.throws(() => prefixes(bytes), { name: 'TypeError', message: 'the bytes must be a Uint8Array' });
  }
  assert.deepEqual(prefixes(file.subarray(0, 40)), []);
  const none = { name: 'GipError', message: 'the file has no complete layer' };
  assert.throws(() => prefix(file.subarray(0, 40), 1000), none);
  // One without Gaussians is its own prefix.
  const empty = makePicture({ layers: [] });
  assert.deepEqual(prefixes(empty), [{ layers: 0, gaussians: 0, bytes: empty.length, end: empty.length }]);
  assert.deepEqual(Buffer.from(prefix(empty, 1000)), empty);
});

/** Exif data of an orientation of 6 alone, as prefixes have it. */
const rotated = Buffer.from('49492a0008000000010012010300010000000600000000000000', 'hex');

test('what comes after the first layer does not take it away', () => {
  const layer = chunk('L', Buffer.concat([Buffer.from([1]), Buffer.alloc(24)]));
  const last = chunk('L', Buffer.alloc(24));
  const start = grayHeader(2, 2);
  const cut = Buffer.concat([signature, start, layer]);
  for (const flaw of [start, chunk('X', Buffer.alloc(0)), Buffer.from('a1BC\0aaaa')]) {
    assert.deepEqual(prefixes(Buffer.concat([cut, flaw])), prefixes(cut));
  }
  assert.equal(prefixes(Buffer.concat([cut, last, last])).length, 2);
});

test('files that are refused', () => {
  const layer = chunk('L', Buffer.concat([Buffer.from([1]), Buffer.alloc(24)]));
  const last = chunk('L', Buffer.alloc(24));
  const start = grayHeader(2, 2);
  assert.equal(prefixes(Buffer.concat([signature, start, layer, last, end, Buffer.from('more')])).length, 2);
  for (const [error, chunks] of [
    ['malformed H: the header does not stand', [start, start]],
    ['malformed tEXt: the header does not stand', [chunk('tEXt', Buffer.alloc(1)), start]],
    ['unsupported H: unsupported: length 256', [header(Array(256).fill(1))]],
    ['malformed H: is shorter than its fields', [header([])]],
    ['malformed H: is shorter than its fields', [header([0x30, 96, 64, 0x80])]],
    ['malformed H: the width is zero', [header([0x30, 0, 64, 0])]],
    ['malformed H: a number of more than 32 bits', [header([0x30, 0xff, 0xff, 0xff, 0xff, 0x10])]],
    ['malformed H: a number with more bytes than it needs', [header([0x30, 0x80, 0])]],
    ['malformed H: Gaussians, but no layer', [grayHeader(2, 0)]],
    ['malformed H: more layers than Gaussians', [grayHeader(2, 3)]],
    ['unsupported H: unsupported: height 1048577', [header([0x30, 1, 0x81, 0x80, 0x40])]],
    ['malformed H: is shorter than its fields', [header([0x30, 96, 64, 0])]],
    ['malformed H: is longer than its fields', [header([0x30, 96, 64, 0, 128, 0])]],
    ['malformed H: is longer than its fields', [header([0x36, 96, 64, 0, 1, 2, 3, 4, 5, 6, 7])]],
    ['malformed H: is shorter than its fields', [header([0x20, 96, 64, 0, 128, 0, 0, 0])]],
    ['malformed H: is shorter than its fields', [header([0x38, 96, 64, 1, 1, 128, 0, 0, ...Array(7).fill(0)])]],
    ['malformed H: is longer than its fields', [header([0x18, 96, 64, 1, 1, 128, 0, 0, 0])]],
    ['malformed H: is longer than its fields', [header([0x30, 96, 64, 1, 1, 128, ...Array(6).fill([0, 32]).flat(), 0])]],
    ['malformed H: is shorter than its fields', [header([0x30, 96, 64, 1, 1, 128, ...Array(6).fill([1, 32]).flat()])]],
    ['unsupported H: unsupported: format 176', [header([0xb0, 96, 64, 0])]],
    ['unsupported H: unsupported: format 112', [header([0x70, 96, 64, 0, 128])]],
    ['unsupported H: unsupported: format 88', [header([0x58, 96, 64, 0, 128])]],
    ['unsupported H: unsupported: number of layers 65536', [header([0x30, 1, 1, 0x80, 0x80, 4, 0x80, 0x80, 4])]],
    ['unsupported X: unsupported: critical chunk of an unknown type', [start, chunk('X', Buffer.alloc(0))]],
    ['malformed a\\x31BC: the type is not of letters', [start, Buffer.from('a1BC\0aaaa')]],
    ['malformed L: a number of more than 32 bits', [start, Buffer.from([0x4c, 0xff, 0xff, 0xff, 0xff, 0x1f])]],
    ['malformed L: the length is over 2^31 - 1', [start, Buffer.from([0x4c, 0x80, 0x80, 0x80, 0x80, 8])]],
    ['malformed L: the CRC does not match', [start, layer.subarray(0, -1), Buffer.alloc(1)]],
    ['malformed L: too short for a number of Gaussians', [start, chunk('L', Buffer.alloc(0))]],
    ['malformed L: no Gaussians', [start, chunk('L', Buffer.alloc(9))]],
    ['malformed L: more Gaussians than the header declares', [start, chunk('L', Buffer.from([2, 0]))]],
  ]) {
    const [kind, type] = error.split(/[ :]/);
    const message = `chunk ${error.slice(kind.length + 1)}`;
    const found = (thrown) => {
      assert.ok(thrown instanceof GipError);
      assert.ok(thrown.message.startsWith(message), `${thrown.message}, not ${message}`);
      assert.deepEqual([thrown.kind, thrown.chunk], [kind, type]);
      return true;
    };
    assert.throws(() => prefixes(Buffer.concat([signature, ...chunks])), found);
  }
  assert.throws(() => prefixes(Buffer.from('GIF89a')), { name: 'SignatureError' });
  const second = Buffer.from(signature);
  second[6] = 2;
  assert.throws(() => prefixes(second), { name: 'UnsupportedError', message: 'chunk H: unsupported: version 2' });
  assert.throws(() => prefixes(new Uint8Array()), UnexpectedEndError);
});

test('no file makes it fail otherwise: cut off, or with any byte changed', () => {
  const file = read('metadata-late.gip');
  const whole = prefixes(file);
  for (let length = 0; length < file.length; length += 1) {
    try {
      const found = prefixes(file.subarray(0, length));
      assert.deepEqual(found, whole.filter(({ end }) => end <= length));
    } catch (error) {
      assert.ok(error instanceof UnexpectedEndError, `${length}: ${error}`);
    }
    for (const change of [1, 0x80, 0xff]) {
      const damaged = Uint8Array.from(file);
      damaged[length] ^= change;
      try {
        prefixes(damaged).forEach(({ bytes }) => prefix(damaged, bytes));
      } catch (error) {
        assert.ok(error instanceof GipError, `${length}: ${error}`);
      }
    }
  }
  for (const name of readdirSync(vectors).filter((name) => /^x.*gip$/.test(name))) {
    try {
      prefixes(read(name)).forEach(({ bytes }) => prefix(read(name), bytes));
    } catch (error) {
      assert.ok(error instanceof GipError, `${name}: ${error}`);
    }
  }
  assert.throws(() => prefixes(read('xcrc-header.gip')), MalformedError);
});
