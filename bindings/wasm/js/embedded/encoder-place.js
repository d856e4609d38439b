// Where the encoder is: in this script.

import script from 'embedded:encoder-worker.js';
import module from 'embedded:image_gip_encoder_bg.wasm';

import { workerOfText } from '../files.js';
import { compiledOnce } from './compile.js';

export { canShare, cores, mostPictures } from '../cores.js';

/** The WebAssembly, which is compiled once for all threads. */
export const source = compiledOnce(module);

/** The ways to start a worker. */
export const starts = [() => workerOfText(script, { name: 'image-gip' })];
