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

/** All limits: those of a caller, and the default for the others. */
export function allLimits(limits) {
  const all = { ...defaultLimits };
  for (const name of Object.keys(all)) {
    const value = (all[name] = limits?.[name] ?? all[name]);
    if (typeof value !== 'number' || !(value >= 0)) {
      throw new RangeError(`limits.${name} is ${String(value)}; it must be a number from 0 to Infinity`);
    }
  }
  return all;
}
