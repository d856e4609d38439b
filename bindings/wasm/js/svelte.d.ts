/** The element, and its declaration for templates of Svelte 5: `import 'image-gip/svelte'`. */

import type { HTMLAttributes } from 'svelte/elements';
import type { GipImageAttributes, GipImageListeners } from './attributes.js';
import type { GipImageElement } from './gip-image.js';

export * from './gip-image.js';

type Own = GipImageAttributes & GipImageListeners;

declare module 'svelte/elements' {
  interface SvelteHTMLElements {
    'gip-image': Omit<HTMLAttributes<GipImageElement>, keyof Own> & Own;
  }
}
