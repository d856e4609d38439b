// The picture in its window: joins the view, the tiles and what paints them.

import { Motion } from './motion.js';
import { watchSize } from './size.js';
import { TilePainter } from './tile-painter.js';
import { Tiles } from './tiles.js';
import { View } from './view.js';

export class Stage {
  view = new View();
  motion = new Motion(this.view);
  /** Called with the view after each frame. */
  onFrame = () => {};
  #element;
  #pool;
  #tiles;
  #canvas;
  #painter;
  #gpuCanvas;
  #gpu = null;
  #outlinePainter;
  #outlineCanvas;
  #comparison;
  #checkers;
  /** The header of the file with the size of the upright picture; `null` without a picture. */
  #picture = null;
  /** How many Gaussians are shown. */
  #gaussians = 0;
  /** Tells what has arrived apart from Gaussians; see the worker. */
  #edition = 0;
  #outlines = false;
  #texture = true;
  #isAsked = false;

  /** `element` has the canvases; `comparison` is a `Comparison`. */
  constructor(element, pool, comparison, onError) {
    this.#element = element;
    this.#pool = pool;
    this.#comparison = comparison;
    const onArrival = () => this.draw();
    this.#tiles = new Tiles(pool, { onArrival, onError });
    this.#canvas = element.querySelector('#picture');
    this.#gpuCanvas = element.querySelector('#picture-gpu');
    this.#painter = new TilePainter(this.#canvas);
    this.#outlineCanvas = element.querySelector('#outlines');
    this.#outlinePainter = new TilePainter(this.#outlineCanvas);
    this.#checkers = element.querySelector('#checkers');
    watchSize(element, (size) => {
      this.view.setWindow(size);
      this.draw();
    });
  }

  /** Paints with a `GpuPainter` that has the picture from now on, or with tiles again after `null`. */
  setGpu(gpu) {
    this.#gpu = gpu;
    this.draw();
  }

  /** What renders, in words. */
  get renderer() {
    if (this.#gpu && !this.#gpuCanvas.hidden) return `WebGPU on ${this.#gpu.name}`;
    return `${this.#pool.size} ${this.#pool.size === 1 ? 'worker' : 'workers'}, in tiles`;
  }

  /** Starts with another file: nothing is shown until `setPicture`. */
  reset() {
    this.#picture = null;
    this.#gaussians = this.#edition = 0;
    this.#gpu = null;
    this.#tiles.reset();
    this.motion.stop();
    this.draw();
  }

  setPicture(picture) {
    this.#picture = picture;
    this.#checkers.hidden = picture.channels % 2 === 1;
    this.view.setPicture(picture);
    this.draw();
  }

  get hasPicture() {
    return this.#picture !== null;
  }

  /** Shows the first Gaussians of the file. */
  showGaussians(count) {
    this.#gaussians = count;
    this.draw();
  }

  set edition(edition) {
    this.#edition = edition;
    this.draw();
  }

  set outlines(shown) {
    this.#outlines = shown;
    this.#outlineCanvas.hidden = !shown;
    this.draw();
  }

  get outlines() {
    return this.#outlines;
  }

  set texture(shown) {
    this.#texture = shown;
    this.draw();
  }

  get texture() {
    return this.#texture;
  }

  /** Whether everything that is in the window is sharp and at rest. */
  get #isComplete() {
    return !this.#isAsked && this.#tiles.isComplete && !this.motion.isMoving;
  }

  /** Draws soon, once for all changes until then. */
  draw() {
    if (this.#isAsked) return;
    this.#isAsked = true;
    this.#element.setAttribute('aria-busy', true);
    requestAnimationFrame((now) => this.#frame(now));
  }

  #frame(now) {
    this.#isAsked = false;
    this.motion.step(now);
    if (this.#picture) this.#paint();
    this.onFrame(this.view);
    if (this.motion.isMoving) this.draw();
    this.#element.setAttribute('aria-busy', !this.#isComplete);
  }

  #paint() {
    const { frame } = this.view;
    const scene = {
      frame,
      picture: this.#picture,
      gaussians: this.#gaussians,
      edition: this.#edition,
      texture: this.#texture,
      ratio: this.view.window.ratio,
      kinds: this.#outlines ? ['outlines'] : [],
    };
    const gpu = this.#gpu?.canPaint(scene) ? this.#gpu : null;
    this.#canvas.hidden = gpu !== null;
    this.#gpuCanvas.hidden = gpu === null;
    if (gpu) gpu.paint(scene);
    else {
      const kind = this.#texture ? 'picture' : 'plain';
      scene.kinds.unshift(kind);
      this.#painter.paint(scene, kind, this.#tiles);
    }
    if (this.#outlines) this.#outlinePainter.paint(scene, 'outlines', this.#tiles);
    this.#comparison.paint(scene);
    this.#placeCheckers(frame);
    this.#tiles.want(scene);
    this.#tiles.trim(frame);
  }

  /** The checkers behind a picture with transparent parts. */
  #placeCheckers({ window, level, left, top }) {
    if (this.#checkers.hidden) return;
    const { ratio } = this.view.window;
    const [x, y] = [Math.max(0, left), Math.max(0, top)];
    Object.assign(this.#checkers.style, {
      left: `${x / ratio}px`,
      top: `${y / ratio}px`,
      width: `${(Math.min(window.width, left + level.width) - x) / ratio}px`,
      height: `${(Math.min(window.height, top + level.height) - y) / ratio}px`,
    });
  }

  /** Starts a smooth movement: `move` moves a view to where it shall end. */
  glide(move, duration = 160) {
    const { goal } = this.motion;
    move(goal);
    this.motion.start(goal, duration);
    this.draw();
  }

  /** Moves at once: `move` moves the view. */
  jump(move) {
    this.motion.stop();
    move(this.view);
    this.draw();
  }
}
