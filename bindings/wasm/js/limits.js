/** What a file may cost at most: what other decoders allow, and how large one rendering may be here. */
export const defaultLimits = Object.freeze({
  width: 2 ** 16,
  height: 2 ** 16,
  pixels: 2 ** 28,
  outputPixels: 2 ** 26,
  gaussians: 2 ** 22,
  memory: 2 ** 29,
  work: 2 ** 32,
});
