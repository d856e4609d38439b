/** Registers the element `<gip-image>`; also exports all of `index.js`. */

export * from './index.js';

/**
 * A `.gip` picture that lays out like `<img>`, and is loaded as far as its size needs.
 *
 * Attributes: `src`, `alt`, `width`, `height`, `loading` (`eager` or `lazy`), `crossorigin`
 * (`use-credentials` sends cookies to other origins), `referrerpolicy`, `fetchpriority`.
 *
 * Events, none of which bubble: `load`, once the picture is shown with what its size needs; `error`, an
 * `ErrorEvent` whose `error` is mostly a `GipError`; `progress`, a `ProgressEvent` with the bytes that
 * have been loaded.
 *
 * Parts for styles: `picture`, the canvas; `alt`, the alternative text of a broken picture.
 */
export class GipImageElement extends HTMLElement {
  /** The absolute URL; `''` without one. */
  src: string;
  alt: string;
  loading: 'eager' | 'lazy';
  /** The width of the content box in CSS pixels; setting it sets the attribute. */
  width: number;
  /** The height of the content box in CSS pixels; setting it sets the attribute. */
  height: number;
  /** The stored size in pixels; 0 until the header has arrived. */
  readonly naturalWidth: number;
  readonly naturalHeight: number;
  readonly currentSrc: string;
  /** Whether the picture is shown, is broken, or there is none. */
  readonly complete: boolean;
  /** Waits for the picture, as `load` and `error` tell of it. */
  decode(): Promise<void>;
}

declare global {
  interface HTMLElementTagNameMap {
    'gip-image': GipImageElement;
  }
}
