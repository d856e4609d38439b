/** A plug-in for Vite, and what is built with it: Astro, SvelteKit, Nuxt. */

/** What `import picture from './photo.jpg?gip'` gives; `import 'image-gip/client'` declares it. */
export interface ImportedPicture {
  /** The address of the `.gip` file. */
  src: string;
  /** Its size in pixels. */
  width: number;
  height: number;
  /** The attribute `placeholder` of `<gip-image>`: a file of its own, of at most 300 bytes. */
  placeholder: string;
  /** The address of the original, if it is JPEG, PNG, WebP or GIF, which all browsers know; else `null`. */
  fallback: string | null;
  /**
   * The HTML of the element, with the attributes above and those given here, and the fallback in `<noscript>`. Always
   * give `alt`. An attribute that is `null`, `undefined` or `false` is left out.
   */
  markup(attributes?: Record<string, string | number | boolean | null | undefined>): string;
}

export interface Options {
  /**
   * What encodes: `gip`, the tool, which must be installed; `wasm`, for which the npm package `sharp` reads the pictures;
   * or `auto`, the tool where it is installed. The files of the two differ in bytes. Default `auto`.
   */
  encoder?: 'auto' | 'gip' | 'wasm';
  /** The folder of files that were encoded before, from Vite's `root`. Default: `.image-gip` in Vite's own folder. */
  cache?: string;
  // What an import can set as well, as in `?gip&quality=60`; see `encoder-types.d.ts`.
  quality?: number;
  bytes?: number;
  bpp?: number;
  psnr?: number;
  gaussians?: number;
  effort?: number;
  texture?: number;
  firstLayer?: number;
}

/** Throws a `TypeError` or `RangeError` for options that there are not. */
export default function gip(options?: Options): {
  name: 'image-gip';
  enforce: 'pre';
};
