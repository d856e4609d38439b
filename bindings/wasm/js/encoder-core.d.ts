/** The encoder on the calling thread: nothing is asynchronous but loading it. For workers, and for Node. */

import type { EncodeOptions, Encoded, Pixels, Progress } from './encoder-types.js';

export type { EncodeOptions, Encoded, Pixels, Progress, Target } from './encoder-types.js';

/** Loads the encoder, once per thread; later calls wait for the same. */
export function load(
  source?: URL | string | Response | Promise<Response> | BufferSource | WebAssembly.Module,
): Promise<void>;

/**
 * Encodes a picture; `load` must have finished. Throws as `encode` of the module `encoder` rejects, and an `AbortError`
 * if `onprogress` returns `false`. That is called again and again, with no least time between two calls.
 */
export function encode(
  image: Pixels | ImageData,
  options?: EncodeOptions & { onprogress?: (progress: Progress) => boolean | void },
): Encoded;
