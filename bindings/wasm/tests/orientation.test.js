// Pictures whose Exif turns them, beside what `<img>` makes of the same.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { before, test } from 'node:test';

import { Decoder, load } from '../dist/core.js';
import { file, harness, script, settled, slow, until, withPage } from './harness.js';
import { exif, makePicture, turns, withExif } from './picture.js';

const [WIDTH, HEIGHT] = [48, 32];
const TURNS = turns(WIDTH, HEIGHT);
const orientations = Object.keys(TURNS).map(Number);
const sizeOf = (orientation) =>
  orientation > 4 ? { width: HEIGHT, height: WIDTH } : { width: WIDTH, height: HEIGHT };

/** No more than the element needs at this size. */
const layers = [20, 70];
const pictureOf = (orientation, chunks = []) =>
  makePicture({ width: WIDTH, height: HEIGHT, layers, chunks: [...chunks, ['eXIF', exif(orientation)]] });

/** A decoder that has read a file. */
function opened(bytes) {
  const decoder = new Decoder();
  decoder.feed(bytes);
  decoder.finish();
  return decoder;
}

before(() => load(readFileSync(new URL('../dist/image_gip_bg.wasm', import.meta.url))));

/** The samples of a picture as stored, turned. */
function turned(data, channels, orientation) {
  const { width } = sizeOf(orientation);
  const out = data.slice();
  for (let y = 0; y < HEIGHT; y += 1) {
    for (let x = 0; x < WIDTH; x += 1) {
      const [column, row] = TURNS[orientation]([x + 0.5, y + 0.5]).map(Math.floor);
      const from = (y * WIDTH + x) * channels;
      out.set(data.subarray(from, from + channels), (row * width + column) * channels);
    }
  }
  return out;
}

test('pictures are upright, samples are as stored', async () => {
  const stored = opened(makePicture({ width: WIDTH, height: HEIGHT, layers }));
  assert.equal(stored.orientation, 1);
  for (const orientation of orientations) {
    const decoder = opened(pictureOf(orientation));
    const size = sizeOf(orientation);
    assert.equal(decoder.orientation, orientation);
    assert.deepEqual([decoder.naturalWidth, decoder.naturalHeight], [size.width, size.height]);
    assert.deepEqual([decoder.header.width, decoder.header.height], [WIDTH, HEIGHT]);

    const upright = { ...size, data: turned(stored.render().data, 4, orientation) };
    assert.deepEqual(decoder.render(), upright);
    assert.deepEqual(decoder.render({ orientation: 'none' }), stored.render());
    assert.deepEqual(decoder.samples(), stored.samples());
    const { data } = decoder.samples({ orientation: 'from-image', depth: 16 });
    assert.deepEqual(data, turned(stored.samples({ depth: 16 }).data, 3, orientation));

    // One side of the output gives the other one.
    const { width, height } = decoder.render({ width: 3 * size.width });
    assert.deepEqual([width, height], [3 * size.width, 3 * size.height]);
    assert.throws(() => decoder.render({ orientation: 'upright' }), RangeError);
    decoder.close();
  }
});

/** Part of an output as it is rendered for itself, and as it is in the whole. */
function part(decoder, size, region) {
  const whole = decoder.render(size).data;
  const rows = Array.from({ length: region.height }, (_, row) => {
    const at = 4 * ((region.y + row) * size.width + region.x);
    return [...whole.subarray(at, at + 4 * region.width)];
  });
  return [[...decoder.render({ ...size, region }).data], rows.flat()];
}

test('sizes and regions are those of the upright picture', () => {
  for (const orientation of orientations) {
    const decoder = opened(pictureOf(orientation));
    const size = sizeOf(orientation);
    // At the stored size, and out of proportion.
    for (const whole of [size, { width: 131, height: 57 }]) {
      const region = { x: whole.width - 20, y: 3, width: 17, height: 11 };
      const [found, wanted] = part(decoder, whole, region);
      assert.deepEqual(found, wanted, `${orientation}, ${whole.width}`);
    }
    const { width, height } = size;
    assert.throws(() => decoder.render({ region: { x: 0, y: 1, width, height } }), {
      name: 'RangeError',
      message: new RegExp(`${width}x${height} at \\(0, 1\\).*${width}x${height} output`),
    });
    decoder.close();
  }
});

test('an output that is rendered in strips is turned as a whole', () => {
  for (const orientation of [3, 6]) {
    const decoder = opened(pictureOf(orientation));
    const whole = { width: 2000, height: 3000 };
    // On both sides of the border between strips.
    const y = Math.floor(2 ** 22 / whole.width) - 2;
    const [found, wanted] = part(decoder, whole, { x: 0, y, width: whole.width, height: 4 });
    assert.ok(found.every((sample, at) => sample === wanted[at]));
    decoder.close();
  }
});

test('Gaussians are as stored, or turned', () => {
  for (const orientation of orientations) {
    const decoder = opened(pictureOf(orientation));
    const [stored, upright] = ['none', 'from-image'].map((orientation) => decoder.gaussians({ orientation, end: 20 }));
    assert.deepEqual(decoder.gaussians({ end: 20 }), stored);
    const turn = TURNS[orientation];
    const origin = turn([0, 0]);
    // What turning does to a distance.
    const along = (vector) => turn(vector).map((value, axis) => value - origin[axis]);
    for (let at = 0; at < stored.length; at += 9) {
      const [x, y, l11, l21, l22] = stored.subarray(at, at + 5);
      const near = (a, b) => a.forEach((value, i) => assert.ok(Math.abs(value - b[i]) < 1e-4, `${a}, ${b}`));
      near([...upright.subarray(at, at + 2)], turn([x, y]));
      const covariance = (a, b) => [a[0] * a[0] + b[0] * b[0], a[0] * a[1] + b[0] * b[1], a[1] * a[1] + b[1] * b[1]];
      const [u11, u21, u22] = upright.subarray(at + 2, at + 5);
      near(covariance([u11, u21], [0, u22]), covariance(along([l11, l21]), along([0, l22])));
      assert.ok(u11 > 0 && u22 > 0);
      assert.deepEqual(upright.subarray(at + 5, at + 9), stored.subarray(at + 5, at + 9));
    }
    decoder.close();
  }
});

/** A PNG file of the picture as stored, with the same Exif. */
async function pngOf(bytes) {
  const decoder = opened(bytes);
  const png = await decoder.png({ orientation: 'none' });
  const { exif } = decoder.metadata;
  decoder.close();
  return withExif(png, exif);
}

/** Serves the picture in each orientation, as /turned-6.gip and /turned-6.png. */
async function serveAll() {
  for (const orientation of orientations) {
    const bytes = pictureOf(orientation);
    harness.routes[`/turned-${orientation}.gip`] = file(bytes);
    harness.routes[`/turned-${orientation}.png`] = file(await pngOf(bytes), { 'Content-Type': 'image/png' });
  }
}

/** Both elements with a style, for each orientation. All of them fit on the screen. */
const pairs = (style, attributes = '') =>
  `${script}<style>
    p { display: flex; float: left; align-items: flex-start; width: 240px; height: 160px; margin: 0 }
    .both { ${style} }
  </style>` +
  orientations
    .map((n) => `<p><img class="both" src="/turned-${n}.png" alt="" ${attributes}>
      <gip-image class="both" src="/turned-${n}.gip" alt="" ${attributes}></gip-image></p>`)
    .join('');

/**
 * For each `<img>`, and for the element after it, the size and the natural size; and how their pixels on
 * the screen differ.
 */
async function compared(page) {
  await page.evaluate(async () => {
    await customElements.whenDefined('gip-image');
    await Promise.all([...document.querySelectorAll('img, gip-image')].map((image) => image.decode()));
  });
  // Of what is not on the screen, a screenshot may have what was painted a while ago.
  const png = (await page.screenshot()).toString('base64');
  const comparisons = await page.evaluate(async (png) => {
    const bitmap = await createImageBitmap(await (await fetch(`data:image/png;base64,${png}`)).blob());
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
    context.drawImage(bitmap, 0, 0);
    const pixels = ({ x, y, width, height }) =>
      context.getImageData(x, y, Math.ceil(width), Math.ceil(height)).data;
    const sizes = (image, { width, height }) => [width, height, image.naturalWidth, image.naturalHeight];
    return [...document.querySelectorAll('img')].map((img) => {
      const gip = img.nextElementSibling;
      const [a, b] = [img, gip].map((image) => image.getBoundingClientRect());
      const [wanted, found] = [pixels(a), pixels(b)];
      const differences = [...wanted].map((sample, at) => Math.abs(sample - found[at]));
      return {
        img: sizes(img, a),
        gip: sizes(gip, b),
        mean: differences.reduce((sum, value) => sum + value, 0) / differences.length,
        most: Math.max(...differences),
        samples: new Set(wanted).size,
      };
    });
  }, png);
  for (const { samples } of comparisons) assert.ok(samples > 50, 'there is a picture to compare');
  return comparisons;
}

for (const style of ['', 'image-orientation: none']) {
  test(`it shows the pixels of <img> ${style}`, async () => {
    await serveAll();
    await withPage(pairs(style), async (page) => {
      for (const [index, { img, gip, most }] of (await compared(page)).entries()) {
        const box = sizeOf(style ? 1 : orientations[index]);
        const natural = sizeOf(orientations[index]);
        assert.deepEqual(gip, [...Object.values(box), ...Object.values(natural)]);
        assert.deepEqual(gip, img);
        assert.equal(most, 0, String(orientations[index]));
      }
    });
  });
}

const layouts = [
  ['', 'width="100"'],
  ['width: 90px', ''],
  ['width: 120px; height: 70px; object-fit: contain', ''],
  ['width: 60px; height: 80px; object-fit: cover; object-position: 20% 90%', ''],
  ['width: 30px; height: 40px; object-fit: none; object-position: -4px 1px', ''],
];

for (const [style, attributes] of layouts) {
  test(`it is laid out and drawn like <img>: ${attributes}${style}`, async () => {
    await serveAll();
    await withPage(pairs(style, attributes), async (page) => {
      for (const [index, { img, gip, mean }] of (await compared(page)).entries()) {
        assert.deepEqual(gip, img, String(orientations[index]));
        // The browser resamples, the element renders at the size.
        assert.ok(mean < 2, `${orientations[index]}: they differ by ${mean}`);
      }
    });
  });
}

test('the size waits for the Exif, and every step is upright', async () => {
  const comment = ['tEXt', Buffer.concat([Buffer.from('Comment\0'), Buffer.alloc(1000, 97)])];
  const bytes = pictureOf(6, [comment]);
  let allowed = 600;
  const { route } = slow(bytes, { piece: 100, gate: (sent) => until(() => sent < allowed, 'the next piece') });
  harness.routes['/slow-turned.gip'] = route;
  harness.routes['/at-once.gip'] = file(bytes);
  await withPage(`${script}<gip-image src="/slow-turned.gip"></gip-image>`, async (page) => {
    const state = () => page.evaluate(async () => {
      const { open } = await import('/dist/index.js');
      globalThis.whole ??= await open('/at-once.gip');
      const image = document.querySelector('gip-image');
      const { width, height } = image.getBoundingClientRect();
      const canvas = image.shadowRoot?.querySelector('canvas');
      return { box: [width, height], natural: [image.naturalWidth, image.naturalHeight], canvas: canvas && [canvas.width, canvas.height] };
    });
    // The header has come, but not what turns the picture.
    for (let times = 0; times < 5; times += 1) {
      const { box, natural } = await state();
      assert.ok(box[0] !== WIDTH && natural[0] !== WIDTH, `${box}, ${natural}`);
    }
    const upright = [HEIGHT, WIDTH];
    allowed = 1500;
    await until(async () => (await state()).natural?.[0] === HEIGHT, 'the size');
    assert.deepEqual((await state()).box, upright);
    for (const part of [0.5, 0.8, 1]) {
      allowed = part === 1 ? Infinity : bytes.length * part;
      await until(async () => Boolean((await state()).canvas), 'a picture');
      assert.deepEqual((await state()).canvas, upright);
    }
    await settled(page);
    const equal = await page.evaluate(async () => {
      const canvas = document.querySelector('gip-image').shadowRoot.querySelector('canvas');
      const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
      const { orientation, naturalWidth, naturalHeight } = globalThis.whole;
      const wanted = await globalThis.whole.render();
      const same = data.every((value, at) => value === wanted.data[at]);
      return [orientation, naturalWidth, naturalHeight, wanted.width, same];
    });
    assert.deepEqual(equal, [6, HEIGHT, WIDTH, HEIGHT, true]);
  });
});

test('a picture with a colour space is turned as well', async () => {
  const { swappedProfile } = await import('./profile.js');
  for (const colorSpace of [['iCCP', swappedProfile()], ['cICP', Buffer.from([12, 13, 0, 1])]]) {
    const bytes = pictureOf(8, [colorSpace]);
    harness.routes['/profile-8.gip'] = file(bytes);
    harness.routes['/profile-8.png'] = file(await pngOf(bytes), { 'Content-Type': 'image/png' });
    const html = `${script}<img alt="" src="/profile-8.png"><gip-image src="/profile-8.gip"></gip-image>`;
    await withPage(html, async (page) => {
      const [{ gip, most }] = await compared(page);
      assert.deepEqual(gip, [HEIGHT, WIDTH, HEIGHT, WIDTH]);
      assert.ok(most <= 2, `${colorSpace[0]}: ${most}`);
    });
  }
});
