// The element `<gip-image>`, which lays out like `<img>` and loads what its size needs.

import { ImageAttributes, keyword } from './image-attributes.js';
import { plan } from './layout.js';
import { Loader } from './loader.js';
import { inDevicePixels, observe, pinch, unobserve } from './observers.js';
import { naturalSize } from './orientation.js';
import { Painting } from './painting.js';
import { wantsFewBytes } from './reduced-data.js';
import { contentSize, layoutOf, newSheet } from './styles.js';

export * from './index.js';

/** The longer side in pixels of what is kept of a picture far from the screen, for printing. */
const farSide = 64;
/** While a picture arrives it is rendered anew with so many times the Gaussians. */
const growth = 1.25;
/** So many times those of a placeholder with a file of its own, whose few Gaussians are fitted to the whole picture. */
const growthOfPlaceholder = 16;

/** What `decode` rejects with, as that of `<img>` does. */
const encodingError = (message, cause) =>
  Object.assign(new DOMException(message, 'EncodingError'), { cause });

/** The attributes that change how a file is fetched, so that it is loaded anew. */
const reloads = ['crossorigin', 'referrerpolicy'];

/** The bytes of a placeholder, of base64 or a `data:` URL of it; `null` if it is neither, or there is none. */
function bytesOf(placeholder) {
  try {
    const text = atob(placeholder.slice(placeholder.indexOf(',') + 1));
    return text ? Uint8Array.from(text, (character) => character.charCodeAt(0)) : null;
  } catch {
    return null;
  }
}

const equal = (a, b) => JSON.stringify(a) === JSON.stringify(b);

export class GipImageElement extends ImageAttributes {
  static observedAttributes = ['src', 'alt', 'width', 'height', 'loading', 'texture', 'detail', ...reloads];

  /** What a file may cost at most. A page may have set it before this script has come. */
  limits = this.limits;
  #internals;
  #style = null;
  /** The text of the style sheet; `null` for none. */
  #layout = null;
  #painting = new Painting();
  #alternative = document.createElement('span');

  /** `waiting` for a reason to load, `loading`, `complete`, or `broken`. */
  #state = 'waiting';
  #loader = null;
  /** The header of the picture that the layout follows. */
  #header = null;
  /** The size of the upright picture. */
  #natural = null;
  /** `from-image`, or `none` where the page's styles want it as stored; `null` as long as it is not known. */
  #orientation = null;
  /** Whether the element is on the screen, or close to it; `undefined` as long as that is not known. */
  #near = undefined;
  /** The content box in CSS pixels, and in pixels of the screen. */
  #css = { width: 0, height: 0 };
  #device = { width: 0, height: 0 };
  /** The size in pixels that the loader was asked for last, and the promise of its answer. */
  #asked = null;
  #answer = null;
  /** Those who wait for the picture: `resolve` and `reject` of their promises. */
  #waiting = [];
  /** Whether something is being rendered. */
  #busy = false;

  constructor() {
    super();
    this.#internals = this.attachInternals();
    const root = this.attachShadow({ mode: 'open' });
    root.addEventListener('transitionrun', () => this.#refresh());
    this.addEventListener('transitionrun', () => this.#follow());
    this.addEventListener('click', () => {
      if (wantsFewBytes(this)) this.detail = 'full';
    });
    this.#alternative.part = 'alt';
    root.append(this.#painting.frame);
    this.#describe();
    this.adoptedCallback();
  }

  // What `<img>` tells of its picture.

  get naturalWidth() {
    return this.#natural?.width ?? 0;
  }

  get naturalHeight() {
    return this.#natural?.height ?? 0;
  }

  get currentSrc() {
    return this.#loader ? this.src : '';
  }

  /** Whether nothing more is to come: the picture is shown, is broken, or there is none. */
  get complete() {
    return this.#state === 'complete' || this.#state === 'broken' || !this.hasAttribute('src');
  }

  /** Whether the picture is complete, but the file is not: a part of it is missing or damaged. */
  get incomplete() {
    return this.#state === 'complete' && this.#loader.error !== null;
  }

  /** Waits for the picture. It is loaded for that even if it is not in the page, or lazy. */
  decode() {
    return new Promise((resolve, reject) => {
      if (this.#state === 'complete') return resolve();
      if (this.#state === 'broken') return reject(encodingError('the picture is broken'));
      if (!this.hasAttribute('src')) return reject(encodingError('there is no attribute src'));
      this.#waiting.push({ resolve, reject });
      this.#refresh();
    });
  }

  /** Answers those who wait for the picture. */
  #answerAll(error) {
    for (const { resolve, reject } of this.#waiting.splice(0)) error ? reject(error) : resolve();
  }

  // Reactions.

  connectedCallback() {
    observe(this, {
      onresize: (css, device) => {
        this.#css = css;
        this.#device = device;
        this.#refresh();
      },
      onzoom: () => {
        this.#measure();
        this.#refresh();
      },
      onnear: (near) => {
        this.#near = near;
        this.#refresh();
      },
    });
    this.#layOut();
    this.#refresh();
  }

  disconnectedCallback() {
    unobserve(this);
    this.#near = undefined;
    // An element that only moves in the page is connected again at once.
    queueMicrotask(() => {
      if (!this.isConnected) this.#reset();
    });
  }

  /** Draws what a transition of the page makes of the styles, of whose last steps the frame tells nothing. */
  #follow() {
    this.#refresh();
    const moves = ({ transitionProperty }) => transitionProperty?.startsWith('object-');
    if (this.getAnimations().some(moves)) requestAnimationFrame(() => this.#follow());
  }

  adoptedCallback() {
    this.#style = newSheet(this.ownerDocument);
    this.shadowRoot.adoptedStyleSheets = this.#style ? [this.#style] : [];
    this.#layout = null;
  }

  attributeChangedCallback(name, before, after) {
    const changes = name === 'src' || (reloads.includes(name) && keyword(name, before) !== keyword(name, after));
    if (changes) this.#reset();
    if (name === 'alt') this.#describe();
    this.#layOut();
    this.#refresh();
  }

  #describe() {
    const alt = this.getAttribute('alt');
    this.#internals.role = alt === '' ? 'presentation' : 'img';
    this.#internals.ariaLabel = alt;
    this.#alternative.textContent = alt ?? '';
  }

  /** The size that the picture has in the layout. */
  get #size() {
    return this.#orientation === 'none' ? this.#header : this.#natural;
  }

  /** Gives the element its size in the layout, and tells whether that may have changed. */
  #layOut() {
    if (!this.#style || !this.isConnected) return false;
    const layout = layoutOf(this, {
      width: this.getAttribute('width'),
      height: this.getAttribute('height'),
      natural: this.#size,
      broken: this.#state === 'broken',
    });
    if (layout === this.#layout) return false;
    this.#layout = layout;
    this.#style.replaceSync(layout);
    return true;
  }

  /** Forgets the picture. */
  #reset() {
    this.#answerAll(encodingError('the picture was changed or removed'));
    this.#loader?.close();
    this.#loader = null;
    this.#header = this.#natural = this.#orientation = null;
    this.#state = 'waiting';
    this.#painting.clear();
    this.shadowRoot.replaceChildren(this.#painting.frame);
  }

  /** Follows the orientation that the page's styles want, and what surrounds the element. */
  #orient() {
    this.#orientation = getComputedStyle(this).imageOrientation === 'none' ? 'none' : 'from-image';
    if (this.#layOut() || !this.isConnected) this.#measure();
  }

  #measure() {
    this.#css = contentSize(this);
    this.#device = inDevicePixels(this.#css);
  }

  // Loading.

  /** Does what is to be done: begins, goes on, places what is there, and renders it anew. */
  #refresh() {
    // Like `<img>`, it follows attributes that are set one after another, such as a source and its placeholder, together.
    if (this.#state === 'waiting') queueMicrotask(() => this.#begin());
    if (this.#loader?.held && this.#due) this.#loader.release();
    if (!this.#header || !this.#loader) return;
    this.#orient();
    this.#place();
    void this.#want();
    void this.#paint();
  }

  /** Whether the file is to be fetched. */
  get #due() {
    if (this.#waiting.length > 0) return true;
    if (!this.isConnected) return false;
    return wantsFewBytes(this) ? this.#near && !this.placeholder : this.#near || this.loading === 'eager';
  }

  #begin() {
    if (this.#state !== 'waiting' || !this.hasAttribute('src')) return;
    const placeholder = bytesOf(this.placeholder);
    if (!this.#due && !(placeholder && this.isConnected)) return;
    this.#state = 'loading';
    let loader;
    try {
      if (!this.src) throw new TypeError('the attribute src is empty');
      const init = {
        credentials: this.crossOrigin === 'use-credentials' ? 'include' : 'same-origin',
        referrerPolicy: this.referrerPolicy,
        priority: this.fetchPriority,
      };
      const failed = () => {
        if (this.#loader !== loader) return;
        // Like `<img>`, it shows the part that has arrived.
        if (loader.showable) void this.#arrived(loader);
        else this.#fail(loader.error);
      };
      const options = { init, limits: this.limits, placeholder };
      loader = new Loader(this.src, options, () => this.#arrived(loader), failed);
    } catch (error) {
      return this.#fail(error);
    }
    this.#loader = loader;
    if (this.#due) loader.release();
    else loader.start();
  }

  /** Something has arrived. */
  async #arrived(loader) {
    if (this.#loader !== loader || loader.orientation === null) return;
    if (loader.header !== this.#header) {
      this.#header = loader.header;
      this.#natural = naturalSize(loader.header, loader.orientation);
      this.#orientation = null;
      this.#asked = null;
      this.#orient();
    }
    await this.#want();
    if (this.#loader !== loader) return;
    void this.#paint();
    this.dispatchEvent(new ProgressEvent('progress', { loaded: loader.received }));
  }

  /** Asks for the Gaussians that the size needs. */
  #want() {
    const loader = this.#loader;
    const least = { width: 1, height: 1 };
    // What is to be ready before it is in the page has no size yet but its own.
    const whole = this.#plan() ?? (this.isConnected ? least : inDevicePixels(this.#size));
    const { width, height } = wantsFewBytes(this) ? least : whole;
    if (!equal(this.#asked, [width, height])) {
      this.#asked = [width, height];
      this.#answer = loader.want(width, height).then(
        () => void this.#paint(),
        (error) => {
          if (this.#loader === loader) this.#fail(error);
        },
      );
    }
    return this.#answer;
  }

  #tell(type, error) {
    this.dispatchEvent(new ErrorEvent(type, { error, message: error.message }));
  }

  /** What is shown in place of a broken picture: what is inside the element, or the alternative text. */
  get #fallback() {
    const isThere = this.querySelector(':scope > :not(noscript)');
    return isThere ? document.createElement('slot') : this.#alternative;
  }

  #fail(error) {
    this.#loader?.close();
    this.#loader = null;
    this.#header = this.#natural = null;
    this.#state = 'broken';
    this.#painting.clear();
    this.shadowRoot.replaceChildren(this.#fallback);
    this.#layOut();
    this.#answerAll(encodingError(error.message, error));
    this.#tell('error', error);
  }

  // Painting.

  /** What to render for the box: with all of its pixels, or, `far` from the screen, with a few. */
  #plan(far = false) {
    const { objectFit, objectPosition } = getComputedStyle(this);
    const most = Math.max(this.#device.width, this.#device.height);
    const scale = far ? Math.min(1, farSide / most) : pinch();
    const device = {
      width: Math.round(this.#device.width * scale),
      height: Math.round(this.#device.height * scale),
    };
    const box = { css: this.#css, device, natural: this.#size };
    const made = plan({ ...box, fit: objectFit, position: objectPosition });
    return made && { ...made, orientation: this.#orientation, texture: this.texture };
  }

  /** Puts what has been drawn where it belongs now, until it is rendered anew. */
  #place() {
    const now = this.#plan();
    if (now) this.#painting.place(this.#css, now);
  }

  /** What is to be rendered; `null` if it is there already, or nothing can be. */
  #next() {
    const { arrived, colorSpace, texture, lacking, preliminary } = this.#loader;
    if (this.#near === undefined || !this.#header || (arrived === 0 && this.#header.gaussians > 0)) return null;
    const plan = this.#plan(!this.#near);
    if (!plan) return null;
    const [old, header] = [this.#painting.drawn, this.#header];
    const next = { plan, arrived, colorSpace, texture, header, preliminary };
    if (old && equal(old.plan, plan)) {
      // A file that begins again, since it was replaced, is not shown before it is better.
      const least = old.arrived * (old.preliminary ? growthOfPlaceholder : growth);
      const isBetter = arrived >= least || arrived === header.gaussians;
      if ((lacking && !isBetter) || (header === old.header && equal(next, old))) return null;
    }
    return next;
  }

  async #paint() {
    if (this.#busy) return;
    this.#busy = true;
    try {
      for (let next; this.#loader && (next = this.#next()); ) {
        const loader = this.#loader;
        try {
          const image = await this.#render(loader, next);
          if (this.#loader === loader && this.#near !== undefined) this.#show(image, next);
        } catch (error) {
          if (this.#loader !== loader) continue;
          // Where more pixels are beyond the limits, those that are there are stretched.
          if (error.kind === 'limit' && this.#painting.drawn) break;
          this.#fail(error);
        }
      }
    } finally {
      this.#busy = false;
    }
    const placed = this.#near !== undefined || !this.isConnected;
    if (this.#state === 'loading' && this.#header && placed && !this.#loader.held && !this.#loader.lacking) {
      this.#state = 'complete';
      this.#answerAll();
      const { error } = this.#loader;
      if (error) this.#tell('incomplete', error);
      this.dispatchEvent(new Event('load'));
    }
  }

  async #render(loader, { plan, colorSpace }) {
    const { width, height, region, orientation, texture } = plan;
    const options = { width, height, region, orientation, texture: texture === 'on' };
    if (!colorSpace) return loader.render(options);
    // The browser knows how to convert colours.
    return createImageBitmap(await loader.png(options));
  }

  #show(image, drawn) {
    const wide = drawn.colorSpace && matchMedia('(color-gamut: p3)').matches;
    this.#painting.show(image, drawn, wide ? 'display-p3' : 'srgb');
    this.#place();
  }
}

if (globalThis.customElements && !customElements.get('gip-image')) {
  customElements.define('gip-image', GipImageElement);
}
