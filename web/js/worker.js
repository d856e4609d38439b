// Decodes the file and renders tiles of it: the other end of `pool.js`.

import { Decoder, load } from '../decoder/core.js';
import { drawOutlines } from './outlines.js';

/** Most kernel evaluations of a tile: one of a hostile file could take minutes otherwise. */
const MOST_WORK = 2 ** 30;

const loading = load();
let decoder = null;
/** The Gaussians for the outlines, when they were last needed. */
let gaussians = null;

/**
 * What has arrived. `picture` is the header with the size of the upright picture, once that is known. What was
 * rendered of an earlier `edition` lacks a colour space or a texture that has come since.
 */
function progress() {
  const { header, orientation, gaussians, colorSpace, texture, complete } = decoder.progress;
  const { naturalWidth: width, naturalHeight: height } = decoder;
  const picture = orientation && { ...header, orientation, width, height };
  return { picture, gaussians, edition: colorSpace + texture, complete };
}

const uprightGaussians = () => decoder.gaussians({ orientation: 'from-image' });

/** The picture, with its texture or without. */
async function renderPicture({ level, region, gaussians }, texture) {
  const options = { ...level, region, gaussians, texture };
  if (decoder.progress.colorSpace) {
    // The browser converts the colours of PNG files.
    return createImageBitmap(new Blob([await decoder.png(options)], { type: 'image/png' }));
  }
  const { data, width, height } = decoder.render(options);
  return createImageBitmap(new ImageData(data, width, height));
}

const render = {
  picture: (job) => renderPicture(job, true),
  plain: (job) => renderPicture(job, false),
  outlines({ level, region, gaussians: count, ratio }) {
    const { picture, gaussians: arrived } = progress();
    if (gaussians?.arrived !== arrived) gaussians = { arrived, numbers: uprightGaussians() };
    const canvas = new OffscreenCanvas(region.width, region.height);
    const numbers = gaussians.numbers.subarray(0, 9 * count);
    drawOutlines(canvas.getContext('2d'), numbers, { level, region, ratio, picture });
    return canvas.transferToImageBitmap();
  },
};

const methods = {
  open() {
    decoder?.close();
    decoder = new Decoder({ statistics: true, limits: { work: MOST_WORK } });
    gaussians = null;
  },
  feed(bytes) {
    decoder.feed(bytes);
    return progress();
  },
  finish: () => decoder.finish(),
  // What a damaged file has kept, too.
  progress,
  about: () => ({ metadata: decoder.metadata, statistics: decoder.statistics() }),
  gaussiansIn: (bytes) => decoder.gaussiansIn(bytes),
  gaussians: uprightGaussians,
  textureMap: () => decoder.textureMap(),
  render: (job) => render[job.kind](job),
};

/** What the page is told: the decoder's own errors have a kind, and are written for people. */
function describe({ kind, message, limit, wanted, allowed }) {
  // The decoder's message is for programs, which can raise its limits.
  if (kind === 'limit') return `limit exceeded: ${limit}: ${wanted} required, ${allowed} allowed`;
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
