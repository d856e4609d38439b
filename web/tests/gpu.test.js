// The painting by WebGPU against the decoder, on the program that stands in for a GPU in Chromium.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { exif, makePicture, texture } from '../../bindings/wasm/tests/picture.js';
import { missing, openViewer, sampleBytes, settled, start, vectorBytes } from './viewer.js';

const FLAGS = ['--enable-unsafe-webgpu', '--use-webgpu-adapter=swiftshader', '--disable-gpu-watchdog'];

/** How often Chromium may lose its GPU process, which it does on a busy machine. */
const ATTEMPTS = 4;

/** Neither a multiple of the shader's tiles, nor of its bins. */
const WINDOW = { width: 200, height: 150 };

/** What to paint: the scale, where the picture begins, and the share of its Gaussians. */
const SAMPLE_FRAMES = [
  { scale: 0.4, left: 40, top: -20, first: 1 },
  { scale: 9, left: -2700, top: -2500, first: 0.2 },
];
const SMALL_FRAMES = [{ scale: 5, left: 30, top: 20, first: 1 }];
const TURNED_FRAMES = [
  { scale: 0.5, left: 30, top: 20, first: 1 },
  { scale: 1, left: -7, top: 30, first: 0.5 },
  { scale: 3, left: -20, top: -30, first: 1 },
  { scale: 3, left: -20, top: -30, first: 1, texture: false },
];

/**
 * In the page: paints frames of files to a texture. For each there is the largest difference from what
 * the decoder renders, the largest sample beside the picture, and the number of different samples;
 * `null` in place of all that if there is no device, or it is lost.
 */
async function paint({ files, size }) {
  const { GpuPainter } = await import('/js/gpu-painter.js');
  const { visibleRegion } = await import('/js/view.js');
  const { Decoder, load } = await import('/decoder/core.js');
  await load();
  let isLost = false;
  const onLost = () => {
    isLost = true;
  };
  const ROW = 1024;

  async function read(device, texture) {
    const usage = GPUBufferUsage.COPY_DST | GPUBufferUsage.MAP_READ;
    const buffer = device.createBuffer({ size: ROW * size.height, usage });
    const encoder = device.createCommandEncoder();
    encoder.copyTextureToBuffer({ texture }, { buffer, bytesPerRow: ROW }, Object.values(size));
    device.queue.submit([encoder.finish()]);
    await buffer.mapAsync(GPUMapMode.READ);
    return new Uint8Array(buffer.getMappedRange());
  }

  function compare(found, order, frame, region, wanted) {
    let [worst, beside] = [0, 0];
    const samples = new Set();
    for (let y = 0; y < size.height; y += 1) {
      for (let x = 0; x < size.width; x += 1) {
        const [column, row] = [x - frame.left - region.x, y - frame.top - region.y];
        const isInside = column >= 0 && row >= 0 && column < region.width && row < region.height;
        const at = 4 * (row * region.width + column);
        for (let channel = 0; channel < 4; channel += 1) {
          const sample = found[ROW * y + 4 * x + order[channel]];
          if (isInside) {
            const alpha = wanted[at + 3];
            const expected = channel < 3 ? (wanted[at + channel] * alpha) / 255 : alpha;
            worst = Math.max(worst, Math.abs(sample - expected));
            samples.add(sample);
          } else beside = Math.max(beside, sample);
        }
      }
    }
    return { worst, beside, samples: samples.size };
  }

  try {
    const painter = await GpuPainter.create(new OffscreenCanvas(1, 1), { anyAdapter: true, onLost });
    if (!painter) return null;
    const { device } = painter;
    const format = navigator.gpu.getPreferredCanvasFormat();
    const usage = GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.COPY_SRC;
    const target = device.createTexture({ size: Object.values(size), format, usage });
    const results = [];
    for (const { name, bytes, frames } of files) {
      const decoder = new Decoder();
      decoder.feed(Uint8Array.from(atob(bytes), (letter) => letter.charCodeAt(0)));
      const { header, progress, naturalWidth, naturalHeight } = decoder;
      const { orientation } = progress;
      const picture = { ...header, orientation, width: naturalWidth, height: naturalHeight };
      const numbers = decoder.gaussians({ orientation: 'from-image' });
      if (!painter.setPicture(picture, numbers, decoder.textureMap())) throw new Error(`${name} is refused`);
      for (const { scale, left, top, first, texture = true } of frames) {
        const level = { width: Math.ceil(picture.width * scale), height: Math.ceil(picture.height * scale) };
        const frame = { window: size, level, left, top };
        if (!painter.canPaint({ frame })) throw new Error(`${name} is too much work`);
        const gaussians = Math.ceil(progress.gaussians * first);
        painter.paint({ frame, gaussians, texture }, target);
        const found = await read(device, target);
        const region = visibleRegion(frame);
        const { data } = decoder.render({ ...level, region, gaussians, texture });
        const order = format === 'bgra8unorm' ? [2, 1, 0, 3] : [0, 1, 2, 3];
        results.push({ name, scale, texture, ...compare(found, order, frame, region, data) });
      }
    }
    return isLost ? null : results;
  } catch (error) {
    if (isLost || /instance|lost/i.test(error.message)) return null;
    throw error;
  }
}

test('WebGPU paints what the decoder renders', { skip: missing, timeout: 180_000 }, async (context) => {
  const encoded = async (bytes) => (await bytes).toString('base64');
  const files = [
    { name: 'sample', bytes: await encoded(sampleBytes()), frames: SAMPLE_FRAMES },
    { name: 'alpha', bytes: await encoded(vectorBytes('rgba8.gip')), frames: SMALL_FRAMES },
    { name: 'gray', bytes: await encoded(vectorBytes('gray8.gip')), frames: SMALL_FRAMES },
    ...[1, 2, 4, 6, 7].map((orientation) => ({
      name: `orientation ${orientation}`,
      bytes: makePicture({ layers: [200], chunks: [['eXIF', exif(orientation)], ['tXTR', texture]] }).toString('base64'),
      frames: TURNED_FRAMES,
    })),
  ];
  let results = null;
  for (let attempt = 0; attempt < ATTEMPTS && !results; attempt += 1) {
    const viewer = await start({ flags: FLAGS });
    try {
      const { page } = await openViewer(viewer);
      results = await page.evaluate(paint, { files, size: WINDOW });
    } finally {
      await viewer.stop();
    }
  }
  if (!results) {
    context.skip('Chromium has no WebGPU here');
    return;
  }
  assert.equal(results.length, 24);
  for (const { name, scale, texture, worst, beside, samples } of results) {
    assert.ok(worst <= 2, `${name}, ${scale}, ${texture}: ${worst} steps`);
    assert.equal(beside, 0, `${name}, ${scale}`);
    assert.ok(samples > 8, `${name}, ${scale}: ${samples} samples`);
  }
});

test('the page paints with tiles when the GPU is lost', { skip: missing, timeout: 180_000 }, async (context) => {
  const viewer = await start({ flags: FLAGS });
  try {
    const { page } = await openViewer(viewer, '/?renderer=webgpu&src=sample/sumac.gip');
    const says = (text) =>
      page.waitForFunction((text) => document.querySelector('#renderer')?.textContent.includes(text), text);
    if (!(await says('WebGPU').catch(() => null))) {
      context.skip('Chromium has no WebGPU here');
      return;
    }
    const other = await viewer.browser.newPage();
    // The address never answers: it ends the process that has the GPU.
    other.goto('chrome://gpucrash').catch(() => {});
    await says('worker');
    await settled(page);
    assert.ok(await page.locator('#picture').isVisible());
    assert.ok(await page.locator('#picture-gpu').isHidden());
  } finally {
    await viewer.stop();
  }
});
