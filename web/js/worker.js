// Decodes the file and renders tiles of it: the other end of `pool.js`.

import { Decoder, load } from '../decoder/core.js';
import { drawOutlines } from './outlines.js';

/** Most kernel evaluations of a tile: one of a hostile file could take minutes otherwise. */
const MOST_WORK = 2 ** 30;

const loading = load();
let decoder = null;
/** The Gaussians for the outlines, when they were last needed. */
let gaussians = null;

const render = {
  async picture({ level, region, gaussians }) {
    const options = { ...level, region, gaussians };
    if (decoder.metadata.iccProfile) {
      // The browser converts the colours of PNG files.
      return createImageBitmap(new Blob([await decoder.png(options)], { type: 'image/png' }));
    }
    const { data, width, height } = decoder.render(options);
    return createImageBitmap(new ImageData(data, width, height));
  },
  outlines({ level, region, gaussians: count, ratio }) {
    if (gaussians?.arrived !== decoder.progress.gaussians) {
      gaussians = { arrived: decoder.progress.gaussians, numbers: decoder.gaussians() };
    }
    const canvas = new OffscreenCanvas(region.width, region.height);
    const numbers = gaussians.numbers.subarray(0, 9 * count);
    drawOutlines(canvas.getContext('2d'), numbers, { level, region, ratio, header: decoder.header });
    return canvas.transferToImageBitmap();
  },
};

const methods = {
  open() {
    decoder?.close();
    decoder = new Decoder({ statistics: true, limits: { work: MOST_WORK } });
    gaussians = null;
  },
  feed: (bytes) => decoder.feed(bytes),
  finish: () => decoder.finish(),
  // What a damaged file has kept, too.
  progress: () => decoder.progress,
  about: () => ({ metadata: decoder.metadata, statistics: decoder.statistics() }),
  gaussiansIn: (bytes) => decoder.gaussiansIn(bytes),
  gaussians: () => decoder.gaussians(),
  render: (job) => render[job.kind](job),
};

/** What the page is told: the decoder's own errors have a kind, and are written for people. */
function describe({ kind, message }) {
  return kind || !decoder ? message : `the decoder failed: ${message}`;
}

let turn = Promise.resolve();

self.onmessage = ({ data: { call, method, argument } }) => {
  // One after the other, although some wait for the browser.
  turn = turn.then(async () => {
    try {
      await loading;
      const result = await methods[method](argument);
      const isBitmap = result instanceof ImageBitmap;
      self.postMessage({ call, result }, isBitmap ? [result] : []);
    } catch (error) {
      self.postMessage({ call, error: describe(error) });
    }
  });
};
