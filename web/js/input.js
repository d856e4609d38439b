// Mouse, pen, touch and wheel on the stage.

import { isCalm } from './motion.js';

/** Wheel steps of at least this many pixels are those of a mouse, and are made smooth. */
const NOTCH = 50;
/** How long a picture slides on after it was let go, in milliseconds. */
const SLIDE = 500;
/** Least speed to slide on, in pixels per millisecond. */
const LEAST_SPEED = 0.15;

export class PointerInput {
  #element;
  #stage;
  /** Where the pointers are that are down, in pixels of the stage. */
  #pointers = new Map();
  /** The latest movement: { dx, dy, time } summed over a short time. */
  #recent = [];

  constructor(element, stage) {
    this.#element = element;
    this.#stage = stage;
    element.addEventListener('pointerdown', (event) => this.#down(event));
    element.addEventListener('pointermove', (event) => this.#move(event));
    for (const type of ['pointerup', 'pointercancel']) {
      element.addEventListener(type, (event) => this.#up(event));
    }
    element.addEventListener('wheel', (event) => this.#wheel(event), { passive: false });
    element.addEventListener('dblclick', (event) => {
      const at = this.#at(event);
      const factor = event.shiftKey ? 1 / 2 : 2;
      stage.glide((view) => view.zoomTo(view.scale * factor, at));
    });
  }

  #at({ clientX, clientY }) {
    const { left, top } = this.#element.getBoundingClientRect();
    return { x: clientX - left, y: clientY - top };
  }

  #down(event) {
    if (!this.#stage.hasPicture || event.button !== 0) return;
    this.#element.setPointerCapture(event.pointerId);
    this.#pointers.set(event.pointerId, this.#at(event));
    this.#recent = [];
    this.#element.classList.add('dragging');
    this.#stage.motion.stop();
  }

  #move(event) {
    const before = this.#pointers.get(event.pointerId);
    if (!before) return;
    const now = this.#at(event);
    const other = [...this.#pointers].find(([id]) => id !== event.pointerId)?.[1];
    this.#pointers.set(event.pointerId, now);
    if (other) this.#pinch(other, before, now);
    else {
      const [dx, dy] = [now.x - before.x, now.y - before.y];
      this.#recent.push({ dx, dy, time: event.timeStamp });
      this.#stage.jump((view) => view.panBy(dx, dy));
    }
  }

  /** Two fingers: what is under them stays under them. */
  #pinch(other, before, now) {
    const length = (a, b) => Math.max(1, Math.hypot(a.x - b.x, a.y - b.y));
    const middle = (a, b) => ({ x: (a.x + b.x) / 2, y: (a.y + b.y) / 2 });
    const factor = length(now, other) / length(before, other);
    const [from, to] = [middle(before, other), middle(now, other)];
    this.#stage.jump((view) => {
      view.zoomTo(view.scale * factor, from);
      view.panBy(to.x - from.x, to.y - from.y);
    });
  }

  #up(event) {
    if (!this.#pointers.delete(event.pointerId) || this.#pointers.size > 0) return;
    this.#element.classList.remove('dragging');
    const recent = this.#recent.filter(({ time }) => event.timeStamp - time < 80);
    this.#recent = [];
    if (recent.length < 2 || isCalm()) return;
    const time = Math.max(16, event.timeStamp - recent[0].time);
    const sum = (key) => recent.reduce((total, move) => total + move[key], 0);
    const [vx, vy] = [sum('dx') / time, sum('dy') / time];
    if (Math.hypot(vx, vy) < LEAST_SPEED) return;
    // The movement begins with this speed, and slows down by the third power.
    this.#stage.glide((view) => view.panBy((vx * SLIDE) / 3, (vy * SLIDE) / 3), SLIDE);
  }

  #wheel(event) {
    if (!this.#stage.hasPicture) return;
    event.preventDefault();
    const pixels = event.deltaY * [1, 30, 300][event.deltaMode];
    const at = this.#at(event);
    // Browsers report pinches on a touchpad with the control key, in small steps.
    const factor = Math.exp(-pixels * (event.ctrlKey ? 0.01 : 0.002));
    const zoom = (view) => view.zoomTo(view.scale * factor, at);
    if (Math.abs(pixels) >= NOTCH) this.#stage.glide(zoom);
    else this.#stage.jump(zoom);
  }
}
