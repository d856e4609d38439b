/** Registers the element `<gip-image>`; also exports all of `index.js`. */

import type { Limits } from './index.js';

export * from './index.js';

/**
 * A `.gip` picture that lays out like `<img>`, and is loaded as far as its size needs.
 *
 * Attributes: `src`, `alt`, `width`, `height`, `loading` (`eager` or `lazy`), `crossorigin`
 * (`use-credentials` sends cookies to other origins), `referrerpolicy`, `fetchpriority`,
 * `placeholder` (a small `.gip`, or the first bytes of the file, in base64 or as a `data:` URL, which is shown before
 * anything is fetched; set it before `src`), `texture` (`on` or `off`: whether the picture's texture is rendered),
 * `detail` (`auto` or `full`: whether all that the size needs is loaded also for those who want few bytes).
 *
 * The picture is upright, as its Exif says, and so are its natural size and the layout that follows from
 * it. With the CSS property `image-orientation: none` it is laid out and shown as stored.
 *
 * Events, none of which bubble: `load`, once the picture is shown with what its size needs, or with what there is of
 * a truncated or damaged file; before that, `incomplete` in the second case, an `ErrorEvent` whose `error` is mostly a
 * `GipError`; `error`, such an event if nothing can be shown; `progress`, a `ProgressEvent` with the bytes that
 * have been loaded.
 *
 * In place of a picture of which nothing can be shown there are the elements inside this one, except `<noscript>`, or
 * the alternative text.
 *
 * Parts for styles: `picture`, the canvas or the image in its place; `alt`, the alternative text of a broken picture.
 */
export class GipImageElement extends HTMLElement {
  /** The absolute URL; `''` without one. */
  src: string;
  alt: string;
  loading: 'eager' | 'lazy';
  crossOrigin: string | null;
  referrerPolicy: string;
  fetchPriority: string;
  /** A small `.gip`, or the first bytes of the file, in base64 or as a `data:` URL. It counts from the next setting of `src` on. */
  placeholder: string;
  texture: 'on' | 'off';
  detail: 'auto' | 'full';
  /** The width of the content box in CSS pixels; setting it sets the attribute. */
  width: number;
  /** The height of the content box in CSS pixels; setting it sets the attribute. */
  height: number;
  /** The size of the upright picture in pixels; 0 until it is known. */
  readonly naturalWidth: number;
  readonly naturalHeight: number;
  /** What a file may cost at most. It counts from the next setting of `src` on. */
  limits: Limits | undefined;
  readonly currentSrc: string;
  /** Whether the picture is shown, is broken, or there is none. */
  readonly complete: boolean;
  /** Whether it is complete with a part of the picture, as the file is truncated or damaged. */
  readonly incomplete: boolean;
  /**
   * Waits until `load` would fire. It also loads a picture that is not in the page, at its natural size, or
   * is lazy. Rejects with an `EncodingError` if there is no `src`, if it changes, if the element is taken
   * out of the page meanwhile, and if the picture is broken: then the `cause` is the `error` of that event.
   */
  decode(): Promise<void>;
}

declare global {
  interface HTMLElementTagNameMap {
    'gip-image': GipImageElement;
  }
}
