// The original beside the picture, with a divider between them.

/** From this scale on, in device pixels per pixel, the original's pixels show as squares. */
const SQUARES_FROM = 3;
/** Most pixels of a smaller copy. */
const MOST_COPY = 2 ** 23;

const isSize = (level, { width, height }) => level.width === width && level.height === height;

export class Comparison {
  #stage;
  #canvas;
  #context;
  #divider;
  #original = null;
  /** The original at the size of a level that is smaller. */
  #copy = null;
  #isCopying = false;
  #isOn = false;
  /** The share of the window with the original. */
  #split = 0.5;
  /** Called when the original for a level has been made. */
  onArrival = () => {};

  constructor(stage) {
    this.#stage = stage;
    this.#canvas = stage.querySelector('#original');
    this.#context = this.#canvas.getContext('2d');
    this.#divider = stage.querySelector('#divider');
    this.#divider.addEventListener('pointerdown', (event) => this.#drag(event));
    this.#divider.addEventListener('keydown', (event) => this.#key(event));
    this.#place();
  }

  get hasOriginal() {
    return this.#original !== null;
  }

  get isOn() {
    return this.#isOn;
  }

  /** Takes an `ImageBitmap`, or `null`. */
  setOriginal(bitmap) {
    this.#original?.close();
    this.#copy?.close();
    this.#original = bitmap;
    this.#copy = null;
    if (!bitmap) this.toggle(false);
  }

  toggle(isOn = !this.#isOn) {
    this.#isOn = isOn && this.hasOriginal;
    this.#place();
    return this.#isOn;
  }

  #drag(down) {
    down.preventDefault();
    down.stopPropagation();
    this.#divider.focus();
    this.#divider.setPointerCapture(down.pointerId);
    const move = ({ clientX }) => {
      const { left, width } = this.#stage.getBoundingClientRect();
      this.#moveTo((clientX - left) / width);
    };
    const end = () => this.#divider.removeEventListener('pointermove', move);
    this.#divider.addEventListener('pointermove', move);
    this.#divider.addEventListener('lostpointercapture', end, { once: true });
  }

  #key(event) {
    const steps = { ArrowLeft: -0.02, ArrowRight: 0.02, PageDown: -0.1, PageUp: 0.1, Home: -1, End: 1 };
    const step = steps[event.key];
    if (step === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    this.#moveTo(this.#split + step);
  }

  #moveTo(split) {
    this.#split = Math.min(1, Math.max(0, split));
    this.#place();
  }

  /** Nothing is painted anew when the divider moves: it only changes what of the layers shows. */
  #place() {
    const percent = this.#split * 100;
    this.#stage.style.setProperty('--split', `${percent}%`);
    this.#stage.classList.toggle('comparing', this.#isOn);
    this.#canvas.hidden = !this.#isOn;
    this.#divider.hidden = !this.#isOn;
    this.#divider.setAttribute('aria-valuenow', Math.round(percent));
  }

  paint({ frame }) {
    if (!this.#isOn) return;
    const { window, level, left, top } = frame;
    if (this.#canvas.width !== window.width || this.#canvas.height !== window.height) {
      Object.assign(this.#canvas, window);
    } else {
      this.#context.clearRect(0, 0, window.width, window.height);
    }
    const scale = level.width / this.#original.width;
    this.#context.imageSmoothingEnabled = scale < SQUARES_FROM;
    const copy = scale < 1 && this.#smaller(level);
    this.#context.drawImage(copy || this.#original, left, top, level.width, level.height);
  }

  /** The original at the size of a level, as the browser reduces pictures best; `null` until it is made. */
  #smaller(level) {
    if (this.#copy && isSize(level, this.#copy)) return this.#copy;
    if (!this.#isCopying && level.width * level.height <= MOST_COPY) this.#makeCopy(level);
    return null;
  }

  async #makeCopy(level) {
    const original = this.#original;
    const size = { resizeWidth: level.width, resizeHeight: level.height, resizeQuality: 'high' };
    this.#isCopying = true;
    const copy = await createImageBitmap(original, size).catch(() => null);
    this.#isCopying = false;
    if (!copy) return;
    if (original !== this.#original) {
      copy.close();
      return;
    }
    this.#copy?.close();
    this.#copy = copy;
    // Perhaps of a level that is over; then the next frame asks again.
    this.onArrival();
  }
}
