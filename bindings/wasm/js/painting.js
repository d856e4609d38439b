// The pixels of an element: a canvas that shows a region of the picture, in a window that is its box, in a
// frame that has the picture's size in the layout.

import { moved } from './layout.js';

export class Painting {
  frame = document.createElement('div');
  /** What the canvas shows: the plan that was rendered, and of what; `null` for nothing. */
  drawn = null;
  #window = document.createElement('div');
  #canvas = null;
  /** The colour space of the canvas, which it keeps. */
  #colorSpace = '';

  constructor() {
    this.frame.className = 'frame';
    this.#window.className = 'window';
    this.frame.append(this.#window);
  }

  /** Shows an `ImageData` or an `ImageBitmap`. */
  show(image, drawn, colorSpace) {
    if (colorSpace !== this.#colorSpace) this.clear();
    this.#colorSpace = colorSpace;
    if (!this.#canvas) {
      this.#canvas = document.createElement('canvas');
      this.#canvas.part = 'picture';
      this.#window.append(this.#canvas);
    }
    const context = this.#canvas.getContext('2d', { colorSpace });
    Object.assign(this.#canvas, { width: image.width, height: image.height });
    if (image instanceof ImageData) {
      context.putImageData(image, 0, 0);
    } else {
      context.drawImage(image, 0, 0);
      image.close();
    }
    this.drawn = drawn;
  }

  /** Puts what is shown where it belongs in a box of this size, by the plan for it. */
  place(box, plan) {
    if (!this.drawn) return;
    this.#window.style.width = `${box.width}px`;
    this.#window.style.height = `${box.height}px`;
    const place = moved(this.drawn.plan, plan);
    for (const side of ['left', 'top', 'width', 'height']) {
      this.#canvas.style[side] = `${place[side]}px`;
    }
  }

  /** Frees the pixels, which can be had again. */
  clear() {
    if (!this.#canvas) return;
    this.#canvas.remove();
    this.#canvas.width = 0;
    this.#canvas = null;
    this.drawn = null;
  }
}
