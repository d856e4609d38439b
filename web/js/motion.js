// Smooth ways from one view to another.

const reduced = matchMedia('(prefers-reduced-motion: reduce)');

/** Whether the person wants no movement on the screen. */
export const isCalm = () => reduced.matches;

const easeOut = (t) => 1 - (1 - t) ** 3;

/** Moves a view over time. */
export class Motion {
  #view;
  #way = null;

  constructor(view) {
    this.#view = view;
  }

  /** Where the view will be in the end: a copy, which the caller may move and give to `start`. */
  get goal() {
    const goal = this.#view.clone();
    if (this.#way) goal.moveTo(this.#way.to);
    return goal;
  }

  get isMoving() {
    return this.#way !== null;
  }

  /** Moves to a goal in so many milliseconds. */
  start(goal, duration, now = performance.now()) {
    const { scale, x, y } = this.#view;
    const to = { scale: goal.scale, x: goal.x, y: goal.y };
    this.#way = { from: { scale, x, y }, to, start: now, duration: isCalm() ? 0 : duration };
  }

  stop() {
    this.#way = null;
  }

  /** Moves the view to where it is at a time. */
  step(now) {
    if (!this.#way) return;
    const { from, to, start, duration } = this.#way;
    const time = duration > 0 ? Math.min(1, Math.max(0, (now - start) / duration)) : 1;
    if (time === 1) {
      this.#way = null;
      this.#view.moveTo(to);
      return;
    }
    const eased = easeOut(time);
    const scale = from.scale * (to.scale / from.scale) ** eased;
    // While the scale changes, one point of the picture keeps its place in the window.
    const change = 1 / to.scale - 1 / from.scale;
    const share = Math.abs(change * from.scale) > 1e-6 ? (1 / scale - 1 / from.scale) / change : eased;
    this.#view.moveTo({
      scale,
      x: from.x + (to.x - from.x) * share,
      y: from.y + (to.y - from.y) * share,
    });
  }
}
