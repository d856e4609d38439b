// What part of the picture the window shows, and at which scale. Knows nothing of the page.

/** Largest side in pixels of what the decoder renders a part of. */
const MOST_SIDE = 2 ** 23;
/** Largest scale in CSS pixels per stored pixel, unless the whole picture is larger. */
const MOST_SCALE = 100;
/** The least scale, where that of the whole picture is 1. */
const LEAST_OF_FIT = 0.5;

const clamp = (value, least, most) => Math.min(Math.max(value, least), most);

/**
 * The picture's centre on the screen as `x` and `y` in stored pixels, and `scale` in CSS pixels per
 * stored pixel.
 */
export class View {
  scale = 1;
  x = 0.5;
  y = 0.5;
  #picture = { width: 1, height: 1 };
  /** In CSS pixels; `ratio` device pixels for each of them, `device` of them in all. */
  #window = { width: 1, height: 1, ratio: 1, device: { width: 1, height: 1 } };

  get picture() {
    return this.#picture;
  }

  get window() {
    return this.#window;
  }

  /** Shows the whole of another picture. */
  setPicture({ width, height }) {
    this.#picture = { width, height };
    this.fit();
  }

  /** Keeps the centre, or the whole picture in view if it was. */
  setWindow(size) {
    const fitted = this.isFitted;
    this.#window = size;
    if (fitted) this.fit();
    else this.moveTo(this);
  }

  /** The scale at which the whole picture just fits, with a margin. */
  get fitScale() {
    const { width, height } = this.#window;
    const margin = Math.min(24, 0.03 * Math.min(width, height));
    const free = (side) => Math.max(1, side - 2 * margin);
    return Math.min(free(width) / this.#picture.width, free(height) / this.#picture.height);
  }

  get isFitted() {
    return Math.abs(this.scale / this.fitScale - 1) < 1e-6;
  }

  get leastScale() {
    return Math.min(this.fitScale * LEAST_OF_FIT, 1);
  }

  get mostScale() {
    const { width, height } = this.#picture;
    const renderable = MOST_SIDE / Math.max(width, height) / this.#window.ratio;
    return Math.min(Math.max(MOST_SCALE, this.fitScale), renderable);
  }

  /** The stored pixel under a point of the window. */
  toPicture({ x, y }) {
    const { width, height } = this.#window;
    return { x: this.x + (x - width / 2) / this.scale, y: this.y + (y - height / 2) / this.scale };
  }

  /** Moves to a scale and centre, as far as there is picture. */
  moveTo({ scale, x, y }) {
    this.scale = clamp(scale, this.leastScale, this.mostScale);
    const within = (at, side, length) => {
      const half = length / 2 / this.scale;
      return side <= 2 * half ? side / 2 : clamp(at, half, side - half);
    };
    this.x = within(x, this.#picture.width, this.#window.width);
    this.y = within(y, this.#picture.height, this.#window.height);
  }

  /** Moves the picture by CSS pixels. */
  panBy(dx, dy) {
    this.moveTo({ scale: this.scale, x: this.x - dx / this.scale, y: this.y - dy / this.scale });
  }

  /** Changes the scale around a point of the window, its middle by default. */
  zoomTo(wanted, at = { x: this.#window.width / 2, y: this.#window.height / 2 }) {
    const scale = clamp(wanted, this.leastScale, this.mostScale);
    const fixed = this.toPicture(at);
    const { width, height } = this.#window;
    this.moveTo({
      scale,
      x: fixed.x - (at.x - width / 2) / scale,
      y: fixed.y - (at.y - height / 2) / scale,
    });
  }

  /** Shows the whole picture. */
  fit() {
    this.moveTo({ scale: this.fitScale, x: this.#picture.width / 2, y: this.#picture.height / 2 });
  }

  /** The same view, to be moved on its own. */
  clone() {
    const copy = new View();
    copy.#picture = this.#picture;
    copy.#window = this.#window;
    copy.moveTo(this);
    return copy;
  }

  /**
   * The view in device pixels: the size of the window, the size of the whole picture (`level`), and
   * where in the window its first pixel is. All are integers, so that pixels that were rendered for
   * this level need no resampling.
   */
  get frame() {
    const { ratio, device: window } = this.#window;
    const { width, height } = this.#picture;
    const side = (stored) => clamp(Math.round(stored * this.scale * ratio), 1, MOST_SIDE);
    const level = { width: side(width), height: side(height) };
    return {
      window,
      level,
      left: Math.round(window.width / 2 - (this.x / width) * level.width),
      top: Math.round(window.height / 2 - (this.y / height) * level.height),
    };
  }
}

/** The part of a frame's level that is in the window, in pixels of the level; `null` if none is. */
export function visibleRegion({ window, level, left, top }, margin = 0) {
  const x = Math.max(0, -left - margin);
  const y = Math.max(0, -top - margin);
  const width = Math.min(level.width, window.width - left + margin) - x;
  const height = Math.min(level.height, window.height - top + margin) - y;
  return width > 0 && height > 0 ? { x, y, width, height } : null;
}
