// What a worker that encodes does with a picture.

import { encode } from './encoder-core.js';
import { pack } from './errors.js';
import { port } from './port.js';

/** The least time in milliseconds between two reports of progress. */
const interval = 50;

function run({ image, options }) {
  let last = -Infinity;
  const onprogress = (progress) => {
    const now = performance.now();
    if (now - last < interval) return;
    last = now;
    port.postMessage({ progress });
  };
  const { file, report } = encode(image, { ...options, onprogress });
  port.postMessage({ result: { file, report } }, [file.buffer]);
}

/** Says that `work` failed, if it does. */
export function trying(work) {
  try {
    work();
  } catch (error) {
    port.postMessage({ error: pack(error, 'encoder') });
  }
}

/** Encodes a picture, and posts the file and its report, or the error. */
export const answer = (message) => trying(() => run(message));
