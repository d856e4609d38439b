// The attributes of `<img>` as properties.

import { contentSize } from './styles.js';

// Where there are no elements, as in Node, the module can be imported all the same.
const Base = globalThis.HTMLElement ?? class {};

export class ImageAttributes extends Base {
  get src() {
    const src = this.getAttribute('src');
    return src ? new URL(src, document.baseURI).href : '';
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
    return this.getAttribute('loading')?.toLowerCase() === 'lazy' ? 'lazy' : 'eager';
  }

  set loading(value) {
    this.setAttribute('loading', value);
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
