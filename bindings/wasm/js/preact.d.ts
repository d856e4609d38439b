/** The element, and its declaration for JSX in Preact: `import 'image-gip/preact'`. */

import type { HTMLAttributes } from 'preact';
import type { GipImageAttributes, GipImageListeners } from './attributes.js';
import type { GipImageElement } from './gip-image.js';

export * from './gip-image.js';

type Own = GipImageAttributes & GipImageListeners;

declare module 'preact' {
  namespace JSX {
    interface IntrinsicElements {
      'gip-image': Omit<HTMLAttributes<GipImageElement>, keyof Own> & Own;
    }
  }
}
