// Where the encoder is: in files beside this script.

import { startsOf } from './files.js';

export { canShare, cores, mostPictures } from './cores.js';

/** The WebAssembly; `undefined` for that which its script fetches by itself. */
export const source = () => undefined;

/** The ways to start a worker. */
export const starts = startsOf(new URL('./encoder-worker.js', import.meta.url));
