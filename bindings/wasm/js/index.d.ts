/** The package `image-gip` for scripts. The work is done in workers, where they can be had. */

import type { Gaussian9, GaussianOptions, Header, Limits, Metadata, Orientation } from './types.js';
import type { Progress, RenderOptions, SampleOptions, Samples, Statistics, TextureMap } from './types.js';

export type * from './types.js';
export * from './errors.js';

export const defaultLimits: Readonly<Required<Limits>>;

/** Where a file comes from. A URL is relative to the page. */
export type Source =
  | string
  | URL
  | Request
  | Response
  | Blob
  | ArrayBuffer
  | ArrayBufferView
  | ReadableStream<Uint8Array>;

export interface OpenOptions {
  /** Ends reading and waiting; the promise is rejected with the signal's reason. */
  signal?: AbortSignal;
  limits?: Limits;
  /** Count the bits of each attribute, which makes decoding slower. Default `false`. */
  statistics?: boolean;
}

/**
 * Reads a file and renders it, upright unless the option `orientation` is `none`. Colours are those of the file: sRGB, unless `open` gives an ICC
 * profile in `metadata()`.
 *
 * Rejects with a `GipError` for a file that is refused or cannot be fetched, a `RangeError` for a size
 * or region that is out of range, and the signal's reason after an abort.
 */
export function decode(
  source: Source,
  options?: RenderOptions & { signal?: AbortSignal; limits?: Limits },
): Promise<ImageData>;

/** Reads a whole file, to render it as often as needed. Rejects as `decode`. */
export function open(source: Source, options?: OpenOptions): Promise<Picture>;

/**
 * What has arrived of a file. Methods may be called at any time: each is carried out after those that were
 * called before it, and before the closing if `close` follows.
 */
interface Renderable {
  /** Whether the whole file has arrived. */
  readonly complete: boolean;
  /** The number of Gaussians that have arrived. */
  readonly arrived: number;
  /** How the picture is turned; `null` until it is known, at the latest with the first Gaussian. */
  readonly orientation: Orientation | null;
  /** The size of the upright picture in pixels; 0 until the orientation is known. */
  readonly naturalWidth: number;
  readonly naturalHeight: number;

  /** The metadata that has arrived. It is complete when the whole file has arrived. */
  metadata(): Promise<Metadata>;
  /** Chunks, layers, bits per attribute. */
  statistics(): Promise<Statistics>;
  /** The Gaussians that have arrived, or some of them, by default as stored. */
  gaussians(options?: GaussianOptions): Promise<Gaussian9>;
  /** The map of the texture that has arrived, always as stored; `null` without texture. */
  textureMap(): Promise<TextureMap | null>;
  /** How many Gaussians are enough for an output of this size in pixels. */
  gaussiansFor(width: number, height: number): Promise<number>;
  /** How many Gaussians a decoder has after the first `bytes` of the file. */
  gaussiansIn(bytes: number): Promise<number>;

  /** Renders 8-bit RGBA with straight alpha, by default upright. */
  render(options?: RenderOptions & { signal?: AbortSignal }): Promise<ImageData>;
  /** Renders the samples as the format specifies them, bit for bit, by default as stored. */
  samples(options?: SampleOptions & { signal?: AbortSignal }): Promise<Samples>;
  /** Renders a PNG file of 8 bits per sample with the picture's ICC profile, by default upright. */
  png(options?: SampleOptions & { signal?: AbortSignal }): Promise<Blob>;

  /** Frees the memory. What is called after this rejects with a `GipError`. */
  close(): void;
}

/** A whole file. */
export interface Picture extends Renderable {
  readonly header: Header;
  readonly orientation: Orientation;
}

export interface StreamDecoder extends Renderable {}
/** Decodes bytes as they arrive, for progressive display. */
export class StreamDecoder {
  constructor(options?: { limits?: Limits; statistics?: boolean });
  /** The header; `null` until it has arrived. */
  readonly header: Header | null;
  /** What has arrived, also after a rejection. */
  readonly progress: Progress;

  /**
   * Takes the next bytes of the file, in pieces of any size. They are copied at the call. After a
   * rejection nothing more can be fed, but what arrived before can be rendered.
   */
  feed(bytes: Uint8Array): Promise<Progress>;
  /** Rejects with an `UnexpectedEndError` if the file is not complete. */
  finish(): Promise<void>;
}
