/** Placeholders that are cut off a file, without decoding and without WebAssembly. */

import type { Prefix } from './types.js';

export type { Prefix } from './types.js';
export { GipError, MalformedError, SignatureError, UnexpectedEndError, UnsupportedError } from './errors.js';

/**
 * The small files that the first layers of a file make, without making them: one for each number of layers, from 1
 * to that of the layers that `bytes` has completely. That of the first layer is a placeholder of a few hundred bytes.
 * A whole file without Gaussians has one, of no layers.
 *
 * Each is a valid file. It keeps what says how the picture is shown: cICP, mDCV, cLLI, the ICC profile, and the
 * orientation in Exif. Texture and other metadata are left out.
 *
 * `bytes` is a file, the beginning of one, or one that is damaged after its first layer. Throws a `GipError` if that
 * ends before the header does, or breaks a rule of the format before the first layer is complete. What is copied as it is, such as Gaussians and quantizers, is not looked
 * at.
 */
export function prefixes(bytes: Uint8Array): Prefix[];

/**
 * The longest of these files that has at most `maxBytes`.
 *
 * Throws a `RangeError` if that of the first layer has more, whose message says how many; and a `GipError` as
 * `prefixes`, or if there is no complete layer.
 */
export function prefix(bytes: Uint8Array, maxBytes: number): Uint8Array;

/**
 * The attribute `placeholder` of `<gip-image>`: the first bytes of the file, at most `maxBytes` (by default 400), up to
 * where the last complete layer of them ends, in base64. Unlike `prefix` it makes no file of its own: the element goes
 * on from here, and fetches only the rest.
 *
 * Throws as `prefix`.
 */
export function placeholder(bytes: Uint8Array, maxBytes?: number): string;
