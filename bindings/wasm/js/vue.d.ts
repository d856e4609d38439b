/**
 * The element, and its declaration for templates and JSX in Vue 3: `import 'image-gip/vue'`. Vue's compiler must be
 * told that it is no component of Vue: `compilerOptions: { isCustomElement: (tag) => tag === 'gip-image' }`.
 */

import type { DefineComponent, HTMLAttributes, ReservedProps } from 'vue';
import type { GipImageAttributes } from './attributes.js';

export * from './gip-image.js';

interface Listeners {
  onLoad?: (event: Event) => void;
  onError?: (event: ErrorEvent) => void;
  onIncomplete?: (event: ErrorEvent) => void;
  onProgress?: (event: ProgressEvent) => void;
}

type Own = GipImageAttributes & Listeners;
type All = Omit<HTMLAttributes, keyof Own> & ReservedProps & Own;

declare module 'vue' {
  interface GlobalComponents {
    'gip-image': DefineComponent<All>;
  }
}

declare module 'vue/jsx-runtime' {
  namespace JSX {
    interface IntrinsicElements {
      'gip-image': All;
    }
  }
}
