// Where the encoder with threads is: in files beside this script.

import { startsOf } from './files.js';

/** The WebAssembly; `undefined` for that which its script fetches by itself. */
export const source = () => undefined;

/** The ways to start a worker. */
export const starts = startsOf(new URL('./encoder-threads-worker.js', import.meta.url));
