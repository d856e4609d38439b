// Where the encoder with threads is in Node: in this script.

import script from 'embedded:encoder-threads-worker.js';
import module from 'embedded:image_gip_encoder_threads_bg.wasm';

import { compiledOnce } from '../embedded/compile.js';
import { NodeWorker } from './worker.js';

/** The WebAssembly, which is compiled once for all threads. */
export const source = compiledOnce(module);

/** The ways to start a worker. */
export const starts = [() => new NodeWorker(script)];
