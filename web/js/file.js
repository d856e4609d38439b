// Reads a .gip file from wherever it comes, and gives it to the decoders as it arrives.

/** What files of every version of the format begin with. */
const START = [0xc7, 0x47, 0x49, 0x50, 0x0d, 0x0a];

/** Whether bytes begin as a .gip file does. */
export const isGip = (bytes) => START.every((byte, index) => bytes[index] === byte);

/** A file of the disk: { name, stream }. */
export const fromFile = (file) => ({ name: file.name, stream: file.stream() });

/** The bytes of a file as a stream that takes so many milliseconds, so that its layers are seen one after another. */
export function arriving(bytes, duration) {
  const count = 20;
  let piece = 0;
  return new ReadableStream({
    async pull(controller) {
      if (piece > 0) await new Promise((resolve) => setTimeout(resolve, duration / count));
      const [start, end] = [piece, piece + 1].map((at) => Math.round((bytes.length * at) / count));
      controller.enqueue(bytes.subarray(start, end));
      piece += 1;
      if (piece === count) controller.close();
    },
  });
}

/** The name that a part of an address stands for: itself, if it is not encoded. */
function decoded(part) {
  try {
    return decodeURIComponent(part);
  } catch {
    return part;
  }
}

function urlOf(address) {
  try {
    return new URL(address, location.href);
  } catch {
    throw new Error(`${address} is no address`);
  }
}

/** A file of the web. */
export async function fromUrl(address, signal) {
  const url = urlOf(address);
  if (!['http:', 'https:', 'blob:'].includes(url.protocol)) {
    throw new Error(`${url.protocol} addresses cannot be opened; use http: or https:`);
  }
  const response = await fetch(url, { signal }).catch((error) => {
    throw signal.aborted ? error : new Error(`${url} cannot be fetched: ${error.message}`);
  });
  if (!response.ok) throw new Error(`${url} cannot be fetched: the server answers ${response.status}`);
  const name = decoded(url.pathname.split('/').pop()) || url.host;
  return { name, stream: response.body };
}

/**
 * Decodes a file as it arrives. `onProgress` gets { size, picture, gaussians, edition, complete } after
 * each piece, where `size` is that of the file so far; so does the caller in the end, with the `error` that
 * a damaged file ends with.
 */
export async function decode({ stream }, pool, { signal, onProgress }) {
  let progress = { size: 0, picture: null, gaussians: 0, edition: 0, complete: false, error: null };
  const reader = stream.getReader();
  const stop = () => void reader.cancel().catch(() => {});
  signal.addEventListener('abort', stop, { once: true });
  await pool.tell('open');
  try {
    while (!progress.complete) {
      const { done, value: piece } = await reader.read();
      signal.throwIfAborted();
      if (done) break;
      progress.size += piece.length;
      const arrived = await pool.tell('feed', piece);
      signal.throwIfAborted();
      progress = { ...progress, ...arrived };
      onProgress(progress);
    }
    await pool.tell('finish');
  } catch (error) {
    signal.throwIfAborted();
    // What arrived before the damage can still be shown.
    progress = { ...progress, ...(await pool.ask('progress')), error };
  } finally {
    stop();
  }
  signal.throwIfAborted();
  return progress;
}
