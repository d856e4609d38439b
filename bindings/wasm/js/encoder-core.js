// The encoder on this thread: no worker, and nothing to wait for once it is loaded.

import init, { Encoder } from './image_gip_encoder.js';
import { listening } from './encoder-calls.js';
import { source as here } from './encoder-place.js';
import { GipError } from './errors.js';
import { number } from './numbers.js';
import { samplesOf } from './pixels.js';

/** How a file can be asked for, and the least and the most of each. */
const targets = {
  quality: [0, 100],
  bytes: [1, 2 ** 30],
  bpp: [1e-6, 1e6],
  psnr: [1, 120],
  gaussians: [1, 2 ** 22],
};
const integers = ['bytes', 'gaussians'];

let loading = null;
let loaded = false;

/**
 * Loads the encoder, once per thread. Without an argument it comes from where this script is.
 */
export function load(source = undefined) {
  // Of nothing, it takes the file beside this script.
  loading ??= init({ module_or_path: source ?? here() }).catch((error) => {
    loading = null;
    throw error;
  });
  return loading.then(() => {
    loaded = true;
  });
}

/** The one target that is given. */
function targetOf(options) {
  const given = Object.keys(targets).filter((name) => options[name] !== undefined);
  if (given.length > 1) throw new TypeError(`at most one target may be given, not ${given.join(' and ')}`);
  const [name = 'quality'] = given;
  return [name, number(options[name] ?? 75, name, ...targets[name], integers.includes(name))];
}

/** An encoder with these options. */
function encoderOf(options) {
  const { tune = 'visual', effort = 4, texture = 50, firstLayer, seed = 0, keepInvisible = false } = options;
  if (tune !== 'visual' && tune !== 'psnr') throw new RangeError(`tune is ${tune}; it must be visual or psnr`);
  return new Encoder(
    ...targetOf(options),
    tune === 'visual',
    number(effort, 'effort', 1, 7),
    number(texture, 'texture', 0, 100),
    firstLayer === undefined ? 0 : number(firstLayer, 'firstLayer', 80, 65_536),
    number(seed, 'seed', 0, 2 ** 32 - 1),
    Boolean(keepInvisible),
  );
}

/** Bytes among the metadata. WebAssembly would take another object for some of its own. */
function bytes(value, name) {
  if (!(value instanceof Uint8Array)) throw new TypeError(`${name} must be a Uint8Array`);
  return value;
}

/** Stores metadata with the picture. */
function describe(encoder, { cicp, iccProfile, exif, xmp, texts = [] }) {
  if (cicp) encoder.setCicp(...[0, 1].map((at) => number(cicp[at], 'cicp', 0, 255)));
  if (iccProfile) encoder.setIccProfile(bytes(iccProfile, 'iccProfile'));
  if (exif) encoder.setExif(bytes(exif, 'exif'));
  if (xmp) encoder.setXmp(xmp);
  for (const { keyword, text } of texts) encoder.addText(keyword, text);
}

/** Encodes a picture; see the declarations. */
export function encode(image, options = {}) {
  if (!loaded) throw new GipError('the encoder is not loaded yet: wait for load() first');
  const { width, height, channels, data, cicp } = samplesOf(image);
  const encoder = encoderOf(options);
  try {
    describe(encoder, { cicp, ...options.metadata });
  } catch (error) {
    encoder.free();
    throw error;
  }
  const { onprogress } = options;
  const goesOn = (progress) => onprogress?.(progress) !== false;
  return listening(goesOn, () =>
    data instanceof Uint16Array
      ? encoder.encode16(width, height, channels, data)
      : encoder.encode8(width, height, channels, data),
  );
}
