// Where the encoder is in Node: in this script, with workers of Node's own kind.

import { availableParallelism } from 'node:os';

import script from 'embedded:encoder-worker.js';
import module from 'embedded:image_gip_encoder_bg.wasm';

import { compiledOnce } from '../embedded/compile.js';
import { NodeWorker } from './worker.js';

/** The WebAssembly, which is compiled once for all threads. */
export const source = compiledOnce(module);

/** The ways to start a worker. */
export const starts = [() => new NodeWorker(script)];

/** Cores for the encoder. */
export const cores = availableParallelism();

/** Most pictures at the same time; each takes some ten megabytes, and more if it is large. */
export const mostPictures = cores;

/** Whether threads can share memory. */
export const canShare = true;
