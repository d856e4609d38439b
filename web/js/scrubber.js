// The slider over the bytes of the file.

import { element } from './dom.js';
import { bytes, count, integer } from './format.js';

/** How long the whole file plays, in milliseconds. */
const DURATION = 5000;
/** Most marks for the ends of layers; more would only be a gray bar. */
const MOST_TICKS = 100;

export class Scrubber {
  #slider = document.querySelector('#scrubber');
  #output = document.querySelector('#shown');
  #ticks = document.querySelector('#ticks');
  #button = document.querySelector('#play');
  #pool;
  #onChange;
  /** { size, gaussians, layers }; `null` until the file has arrived. */
  #file = null;
  #asked = 0;
  #playing = 0;

  /** `onChange` gets the number of Gaussians to show. */
  constructor(pool, onChange) {
    this.#pool = pool;
    this.#onChange = onChange;
    this.#slider.addEventListener('input', () => {
      this.pause();
      this.#show();
    });
  }

  /** Takes a file that has arrived, `null` while there is none. */
  setFile(file) {
    this.pause();
    this.#file = file;
    this.#slider.disabled = this.#button.disabled = !file;
    this.#ticks.replaceChildren();
    this.#output.value = '';
    if (!file) return;
    this.#slider.max = file.size;
    this.#slider.value = file.size;
    for (const { end } of file.layers.slice(0, -1).slice(0, MOST_TICKS)) {
      const tick = element('span');
      tick.style.setProperty('--at', end / file.size);
      this.#ticks.append(tick);
    }
    this.#describe(file.gaussians);
  }

  /** Tells how much there is of a file that is still arriving. */
  showArrival({ size, gaussians }) {
    this.#output.replaceChildren(element('b', {}, bytes(size)), element('span', {}, count(gaussians, 'Gaussian')));
  }

  get #value() {
    return Number(this.#slider.value);
  }

  async #show() {
    const asked = ++this.#asked;
    const file = this.#file;
    const gaussians = await this.#pool.ask('gaussiansIn', this.#value);
    // The latest wish counts.
    if (asked !== this.#asked || file !== this.#file) return;
    this.#onChange(gaussians);
    this.#describe(gaussians);
  }

  #describe(gaussians) {
    const { size, layers } = this.#file;
    const whole = layers.filter(({ end }) => end <= this.#value).length;
    const share = this.#value === size ? bytes(size) : `${integer(this.#value)} of ${bytes(size)}`;
    const counts = `${count(gaussians, 'Gaussian')} · ${whole} of ${count(layers.length, 'layer')}`;
    this.#output.replaceChildren(element('b', {}, share), element('span', {}, counts));
    this.#slider.setAttribute('aria-valuetext', `${share}, ${counts}`);
    this.#slider.style.setProperty('--share', this.#value / size);
  }

  /** Moves to the end of the next layer, or of the one before. */
  stepLayers(direction) {
    if (!this.#file) return;
    this.pause();
    const { layers, size } = this.#file;
    const stops = [0, ...layers.map(({ end }) => end).slice(0, -1), size];
    const next = direction > 0
      ? stops.find((stop) => stop > this.#value)
      : stops.findLast((stop) => stop < this.#value);
    this.#slider.value = next ?? this.#value;
    this.#show();
  }

  /** Plays from here, or from the start when it is at the end; pauses when it plays. */
  togglePlay() {
    if (!this.#file) return;
    if (this.#playing) {
      this.pause();
      return;
    }
    const { size } = this.#file;
    const from = this.#value >= size ? 0 : this.#value;
    const start = performance.now();
    const step = (now) => {
      this.#slider.value = Math.min(size, from + (size * Math.max(0, now - start)) / DURATION);
      this.#show();
      this.#playing = this.#value < size ? requestAnimationFrame(step) : 0;
      this.#drawButton();
    };
    this.#playing = requestAnimationFrame(step);
    this.#drawButton();
  }

  pause() {
    cancelAnimationFrame(this.#playing);
    this.#playing = 0;
    this.#drawButton();
  }

  #drawButton() {
    const isPlaying = this.#playing !== 0;
    this.#button.querySelector('use').setAttribute('href', isPlaying ? '#icon-pause' : '#icon-play');
    this.#button.setAttribute('aria-label', isPlaying ? 'Pause' : 'Play the file from its first byte');
  }
}
