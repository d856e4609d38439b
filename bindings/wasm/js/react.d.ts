/** The element, and its declaration for JSX in React 19: `import 'image-gip/react'`. */

import type { DetailedHTMLProps, HTMLAttributes } from 'react';
import type { GipImageAttributes, GipImageListeners } from './attributes.js';
import type { GipImageElement } from './gip-image.js';

export * from './gip-image.js';

type Own = GipImageAttributes & GipImageListeners;

declare module 'react' {
  namespace JSX {
    interface IntrinsicElements {
      'gip-image': Omit<DetailedHTMLProps<HTMLAttributes<GipImageElement>, GipImageElement>, keyof Own> & Own;
    }
  }
}
