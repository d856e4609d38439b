// The attributes of `<img>` as properties, and `placeholder` and `texture`.

import { contentSize } from './styles.js';

/** The keywords of enumerated attributes. The first is what any other value means. */
const keywords = {
  loading: ['eager', 'lazy'],
  crossorigin: ['anonymous', 'use-credentials'],
  fetchpriority: ['auto', 'high', 'low'],
  texture: ['on', 'off'],
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

export class ImageAttributes extends Base {
  get src() {
    const src = this.getAttribute('src');
    return src ? new URL(src, this.baseURI).href : '';
  }

  set src(value) {
    this.setAttribute('src', value);
  }

  get alt() {
    return this.getAttribute('alt') ?? '';
  }

  set alt(value) {
    this.setAttribute('alt', value);
  }

  get loading() {
    return keyword('loading', this.getAttribute('loading'));
  }

  set loading(value) {
    this.setAttribute('loading', value);
  }

  get crossOrigin() {
    const value = this.getAttribute('crossorigin');
    return value === null ? null : keyword('crossorigin', value);
  }

  set crossOrigin(value) {
    if (value === null) this.removeAttribute('crossorigin');
    else this.setAttribute('crossorigin', value);
  }

  get fetchPriority() {
    return keyword('fetchpriority', this.getAttribute('fetchpriority'));
  }

  set fetchPriority(value) {
    this.setAttribute('fetchpriority', value);
  }

  get referrerPolicy() {
    return keyword('referrerpolicy', this.getAttribute('referrerpolicy'));
  }

  set referrerPolicy(value) {
    this.setAttribute('referrerpolicy', value);
  }

  get placeholder() {
    return this.getAttribute('placeholder') ?? '';
  }

  set placeholder(value) {
    this.setAttribute('placeholder', value);
  }

  get texture() {
    return keyword('texture', this.getAttribute('texture'));
  }

  set texture(value) {
    this.setAttribute('texture', value);
  }

  get width() {
    return Math.round(contentSize(this).width);
  }

  set width(value) {
    this.setAttribute('width', value);
  }

  get height() {
    return Math.round(contentSize(this).height);
  }

  set height(value) {
    this.setAttribute('height', value);
  }
}
