// The attributes of `<img>` as properties, and `placeholder`, `texture` and `detail`.

import { contentSize } from './styles.js';

/** The keywords of enumerated attributes. The first is what any other value means. */
const keywords = {
  loading: ['eager', 'lazy'],
  crossorigin: ['anonymous', 'use-credentials'],
  fetchpriority: ['auto', 'high', 'low'],
  texture: ['on', 'off'],
  detail: ['auto', 'full'],
  referrerpolicy: [
    '',
    'no-referrer',
    'no-referrer-when-downgrade',
    'same-origin',
    'origin',
    'strict-origin',
    'origin-when-cross-origin',
    'strict-origin-when-cross-origin',
    'unsafe-url',
  ],
};

/** What the value of an enumerated attribute means. */
export function keyword(name, value) {
  const lower = value?.toLowerCase();
  return keywords[name].includes(lower) ? lower : keywords[name][0];
}

// Where there are no elements, as in Node, the module can be imported all the same.
const Base = globalThis.HTMLElement ?? class {};

/** Defines a property that sets the attribute of the same name. Without a value, as frameworks take one back, there is none. */
function define(property, get) {
  const name = property.toLowerCase();
  Object.defineProperty(ImageAttributes.prototype, property, {
    get() {
      return get(this, this.getAttribute(name), name);
    },
    set(value) {
      if (value == null) this.removeAttribute(name);
      else this.setAttribute(name, value);
    },
    configurable: true,
  });
}

export class ImageAttributes extends Base {}

define('src', (element, value) => (value ? new URL(value, element.baseURI).href : ''));
for (const side of ['width', 'height']) define(side, (element) => Math.round(contentSize(element)[side]));
define('crossOrigin', (_, value, name) => (value === null ? null : keyword(name, value)));
for (const text of ['alt', 'placeholder']) define(text, (_, value) => value ?? '');
for (const property of ['loading', 'fetchPriority', 'referrerPolicy', 'texture', 'detail']) {
  define(property, (_, value, name) => keyword(name, value));
}
