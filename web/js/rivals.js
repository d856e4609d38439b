// Files of other formats with about as many bytes, as this browser writes them.

/** So many qualities are tried: they halve what is left each time. */
const TRIES = 7;

/**
 * A picture in a format, such as `image/webp`, with the most bytes that are not more than asked for:
 * `{ blob, bytes, isLarger }`, where the last is true if even the lowest quality has more. `null` if the browser does
 * not write the format.
 */
export async function ofBytes(canvas, type, bytes) {
  let [low, high, best, least] = [0, 1, null, null];
  for (let tries = 0; tries < TRIES; tries += 1) {
    // The lowest one first, which may be all that there is.
    const quality = tries === 0 ? 0 : (low + high) / 2;
    const blob = await canvas.convertToBlob({ type, quality });
    if (blob.type !== type) return null;
    if (tries === 0) least = blob;
    if (blob.size <= bytes) {
      [low, best] = [quality, blob];
    } else {
      if (tries === 0) break;
      high = quality;
    }
  }
  const blob = best ?? least;
  return { blob, bytes: blob.size, isLarger: best === null };
}
