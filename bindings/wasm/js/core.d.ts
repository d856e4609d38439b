/** The decoder on the calling thread: nothing is asynchronous but loading it. For workers. */

import type { Gaussian9, GaussianOptions, Header, Limits, Metadata, Orientation } from './types.js';
import type { Progress, RenderOptions, SampleOptions, Samples, Statistics, TextureMap } from './types.js';

export type * from './types.js';

/**
 * Loads the decoder, once per thread; later calls wait for the same. Without an argument,
 * `image_gip_bg.wasm` is fetched from beside this script.
 */
export function load(
  source?: URL | string | Response | Promise<Response> | BufferSource | WebAssembly.Module,
): Promise<void>;

/** The bytes that all decoders of this thread take. They are used again, but never given back. */
export function memorySize(): number;

/** Decodes bytes as they arrive, and renders what has arrived. `load` must have finished, or its constructor throws. */
export class Decoder {
  constructor(options?: { limits?: Limits; statistics?: boolean });

  /**
   * Takes the next bytes of the file, in pieces of any size. Bytes after the end of the file are
   * ignored. After an error, nothing more can be fed, but what arrived before can be rendered.
   */
  feed(bytes: Uint8Array): Progress;
  /** Throws an `UnexpectedEndError` if the file is not complete. */
  finish(): void;

  /** The header; `null` until it has arrived. */
  readonly header: Header | null;
  /** How the picture is turned; `null` until it is known, at the latest with the first Gaussian. */
  readonly orientation: Orientation | null;
  /** The size of the upright picture in pixels; 0 until the orientation is known. */
  readonly naturalWidth: number;
  readonly naturalHeight: number;
  /** The metadata that has arrived. It is complete when the whole file has arrived. */
  readonly metadata: Metadata;
  readonly progress: Progress;

  /** How many Gaussians are enough for an output of this size in pixels; 0 without a header. */
  gaussiansFor(width: number, height: number): number;
  /** How many Gaussians a decoder has after the first `bytes` of the file. */
  gaussiansIn(bytes: number): number;
  /** The Gaussians that have arrived, or some of them, by default as stored. */
  gaussians(options?: GaussianOptions): Gaussian9;
  /** The map of the texture that has arrived, always as stored; `null` without texture. */
  textureMap(): TextureMap | null;
  /** Chunks, layers, bits per attribute. */
  statistics(): Statistics;

  /** Renders 8-bit RGBA samples with straight alpha, by default upright. */
  render(options?: RenderOptions): { width: number; height: number; data: Uint8ClampedArray };
  /** Renders the samples as the format specifies them, bit for bit, by default as stored. */
  samples(options?: SampleOptions): Samples;
  /** Renders a PNG file of 8 bits per sample with the picture's ICC profile, by default upright. */
  png(options?: SampleOptions): Promise<Uint8Array>;

  /** Frees the memory. What is called after this throws a `GipError`. */
  close(): void;
}
