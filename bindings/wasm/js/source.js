// Bytes from whatever a caller has.

import { NetworkError } from './errors.js';

/** Fetches a URL or a Request, and makes failures `NetworkError`s. An abort stays what it is. */
export async function fetchResponse(source, init = {}) {
  const url = source.url ?? source;
  let response;
  try {
    response = await fetch(source, init);
  } catch (error) {
    if (init.signal?.aborted) throw error;
    throw new NetworkError(`${url} cannot be fetched: ${error.message}`, 0, { cause: error });
  }
  if (!response.ok) {
    throw new NetworkError(`${url}: the server answers ${response.status}`, response.status);
  }
  return response;
}

/** The pieces of a stream. Who stops early cancels the stream. */
export async function* pieces(stream, signal = undefined) {
  const reader = stream.getReader();
  const cancel = () => void reader.cancel(signal?.reason).catch(() => {});
  signal?.addEventListener('abort', cancel, { once: true });
  try {
    for (;;) {
      signal?.throwIfAborted();
      const { done, value } = await readFrom(reader, signal);
      signal?.throwIfAborted();
      if (done) return;
      yield bytesOf(value);
    }
  } finally {
    signal?.removeEventListener('abort', cancel);
    cancel();
  }
}

async function readFrom(reader, signal) {
  try {
    return await reader.read();
  } catch (error) {
    signal?.throwIfAborted();
    // What browsers say when a connection is lost.
    if (!(error instanceof TypeError)) throw error;
    throw new NetworkError(`the connection was lost: ${error.message}`, 0, { cause: error });
  }
}

function bytesOf(value) {
  if (value instanceof ArrayBuffer) return new Uint8Array(value);
  if (ArrayBuffer.isView(value)) {
    return new Uint8Array(value.buffer, value.byteOffset, value.byteLength);
  }
  throw new TypeError('a stream must have pieces of bytes');
}

/** The pieces of a URL, Request, Response, Blob, ArrayBuffer, view of one, or ReadableStream. */
export async function* read(source, signal = undefined) {
  signal?.throwIfAborted();
  if (source instanceof ArrayBuffer || ArrayBuffer.isView(source)) {
    yield bytesOf(source);
  } else if (source instanceof Blob) {
    yield* pieces(source.stream(), signal);
  } else if (source instanceof ReadableStream) {
    yield* pieces(source, signal);
  } else if (source instanceof Response) {
    if (!source.ok) {
      throw new NetworkError(`the server answered ${source.status}`, source.status);
    }
    if (source.body) yield* pieces(source.body, signal);
  } else if (typeof source === 'string' || source instanceof URL || source instanceof Request) {
    const response = await fetchResponse(source, { signal });
    if (response.body) yield* pieces(response.body, signal);
  } else {
    throw new TypeError(
      'the source must be a URL, Request, Response, Blob, ArrayBuffer, view or ReadableStream',
    );
  }
}
