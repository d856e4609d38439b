// An `<img>` in place of the canvas of each `<gip-image>` that is complete: browsers measure, save, copy and drag it as
// they do all pictures.

/** What is smaller is no picture that somebody looks at: the element keeps so many pixels of those far from the screen. */
const leastSide = 65;
/** How long the pixels have to stay as they are before they are encoded once more, in milliseconds. */
const rest = 200;

const pause = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));

/** Whether the page's content security policy takes the addresses of images; it is asked once. */
let isAllowed = true;

/** A loaded image of the pixels of a canvas; `null` if there can be none. */
async function imageOf(canvas) {
  const blob = await new Promise((resolve) => canvas.toBlob(resolve));
  if (!blob) return null;
  const image = new Image();
  // The element itself has the role and the name.
  image.alt = '';
  image.src = URL.createObjectURL(blob);
  try {
    await image.decode();
    return image;
  } catch {
    isAllowed = false;
    URL.revokeObjectURL(image.src);
    return null;
  }
}

/** The image of one element, and the canvas that it stands for. */
class Substitute {
  #element;
  #image = null;
  #canvas = null;
  /** Counts the pictures that the canvas has had. */
  #edition = 0;
  #observer = new MutationObserver((changes) => this.#follow(changes));

  constructor(element) {
    this.#element = element;
    const what = { subtree: true, childList: true, attributeFilter: ['style', 'width'] };
    this.#observer.observe(element.shadowRoot, what);
  }

  /** Makes the image, after a while without changes. */
  async make(wait = 0) {
    const edition = (this.#edition += 1);
    await pause(wait);
    const canvas = this.#drawn;
    const isCurrent = () => edition === this.#edition && canvas?.isConnected && this.#element.complete;
    if (!isAllowed || this.#image || !isCurrent() || Math.max(canvas.width, canvas.height) < leastSide) return;
    const image = await imageOf(canvas);
    if (!image) return;
    if (!isCurrent()) return void URL.revokeObjectURL(image.src);
    this.#image = image;
    this.#canvas = canvas;
    image.part = canvas.part.value;
    this.#place();
    canvas.after(image);
    // Nothing is drawn of it, and its pixels are freed.
    canvas.part = '';
    canvas.width = 0;
    this.#observer.takeRecords();
  }

  /** The canvas of the element. Others may be beside it, such as one for printing. */
  get #drawn() {
    return this.#element.shadowRoot.querySelector('.window canvas');
  }

  #place() {
    this.#image.style.cssText = `position: absolute; display: block; ${this.#canvas.style.cssText}`;
  }

  /** The element has drawn something else, or put it elsewhere. This is before anybody sees it. */
  #follow(changes) {
    const canvas = this.#drawn;
    const isDrawn = changes.some(({ target, attributeName }) => attributeName === 'width' && target === canvas);
    if (isDrawn || (this.#image && this.#canvas !== canvas)) {
      this.#remove();
      void this.make(rest);
    } else if (this.#image) {
      this.#place();
      this.#observer.takeRecords();
    }
  }

  #remove() {
    if (!this.#image) return;
    URL.revokeObjectURL(this.#image.src);
    this.#canvas.part = this.#image.part.value;
    this.#image.remove();
    this.#image = this.#canvas = null;
    this.#observer.takeRecords();
  }
}

const substitutes = new WeakMap();

function onLoad({ target }) {
  if (target.localName !== 'gip-image') return;
  if (!substitutes.has(target)) substitutes.set(target, new Substitute(target));
  void substitutes.get(target).make();
}

/** Does so for the elements in a document or shadow root. */
export function watch(root) {
  root.addEventListener('load', onLoad, true);
  for (const target of root.querySelectorAll('gip-image')) {
    if (target.complete && target.naturalWidth > 0) onLoad({ target });
  }
}

// On a server there is nothing to watch.
if (globalThis.document) watch(document);
