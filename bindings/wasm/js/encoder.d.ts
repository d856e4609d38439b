/** The encoder, in workers of its own, with threads where there can be some. It is loaded when it is used first. */

import type { EncodeOptions, Encoded, Pixels, Progress } from './encoder-types.js';

export type { EncodeOptions, Encoded, Pixels, Progress, Target } from './encoder-types.js';
export { GipError, LimitError } from './errors.js';

/** What a browser can draw, or a file in a format that it knows; turned upright. */
export type Drawable =
  | Blob
  | ImageBitmap
  | HTMLImageElement
  | HTMLCanvasElement
  | OffscreenCanvas
  | HTMLVideoElement
  | VideoFrame;

/**
 * Encodes a picture. The same pixels and options give the same file, in all browsers and in Node; natively they give
 * another one that is as good.
 *
 * Rejects with a `RangeError` or a `TypeError` if an option or the picture is out of range, with a `LimitError` if
 * decoders would refuse the file, with the reason of the signal if that is aborted, and with a `GipError` if the
 * worker fails, for instance for want of memory.
 */
export function encode(
  picture: Pixels | ImageData | Drawable,
  options?: EncodeOptions & {
    /**
     * Threads that share the work on this picture, 1 to 64. The file does not depend on them. There is only one where memory
     * cannot be shared: in pages that are not cross-origin isolated. Default: the cores, in a page all but one, divided by the
     * pictures that are encoded at the same time, and at most 16.
     */
    threads?: number;
    /** Aborting it rejects at once, and ends the workers of this picture. */
    signal?: AbortSignal;
    /** Called on this thread, at most every 50 ms. What it throws ends the encoding, which rejects with it. */
    onprogress?: (progress: Progress) => void;
    /** Whether the samples may be moved to the worker where they can be: they are not copied, and gone afterwards. */
    transfer?: boolean;
    /** The colour space in which what can be drawn is read. Default `srgb`. */
    colorSpace?: 'srgb' | 'display-p3';
  },
): Promise<Encoded>;
