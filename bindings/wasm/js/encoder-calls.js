// What the encoder calls in JavaScript.

import { GipError, LimitError } from './errors.js';

/** Hears of the progress of the encoding that runs on this thread; returns whether to go on. */
let listener = () => true;

/** Runs `work` with a listener. */
export function listening(onprogress, work) {
  listener = onprogress;
  try {
    return work();
  } finally {
    listener = () => true;
  }
}

export const progressed = (fraction, iteration, iterations, gaussians, psnr) =>
  listener({ fraction, iteration, iterations, gaussians, psnr });

export function encodeError(kind, message) {
  if (kind === 'request') return new RangeError(message);
  if (kind === 'cancelled') return new DOMException(message, 'AbortError');
  return new GipError(message);
}

export const limitError = (message, limit, wanted, allowed) => new LimitError(message, limit, wanted, allowed);

export const encoded = (file, gaussians, psnr, quality, textureBytes, iterations, shortfall = null) =>
  // The bytes are in the encoder's memory.
  ({ file: file.slice(), report: { gaussians, psnr, quality, textureBytes, iterations, shortfall } });
