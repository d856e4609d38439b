/** What a file may cost at most, in a browser. */
export const defaultLimits = Object.freeze({
  pixels: 2 ** 28,
  outputPixels: 2 ** 26,
  gaussians: 2 ** 21,
  memory: 2 ** 28,
  work: 2 ** 32,
});
