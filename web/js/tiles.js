// Which tiles are rendered when, and which are kept.

import { visibleRegion } from './view.js';

/** Side of a tile in device pixels. */
const TILE = 256;
/** Longest side in pixels of the preview: the whole picture, which stands in for missing tiles. */
const PREVIEW = 512;
/** Tiles are kept for so many windows. */
const KEPT_WINDOWS = 4;
/** The scale must have rested for so many milliseconds before tiles are rendered for it. */
const REST = 70;

/** Whether a tile or a preview shows what is wanted. */
const isOf = (tile, wanted) => ['kind', 'gaussians', 'edition'].every((name) => tile[name] === wanted[name]);

const nameOf = ({ width, height }) => `${width}x${height}`;

/** The tiles of a level that are in a region, each as a region. */
function* tilesIn(level, region) {
  const [right, bottom] = [region.x + region.width, region.y + region.height];
  for (let y = region.y - (region.y % TILE); y < bottom; y += TILE) {
    for (let x = region.x - (region.x % TILE); x < right; x += TILE) {
      const width = Math.min(TILE, level.width - x);
      const height = Math.min(TILE, level.height - y);
      yield { x, y, width, height };
    }
  }
}

/** The tiles of the file that is open. */
export class Tiles {
  #pool;
  #onArrival;
  #onError;
  /** By key, the least recently used first: { kind, level, gaussians, edition, region, bitmap }. */
  #kept = new Map();
  #queue = [];
  #running = new Set();
  #failed = new Set();
  #level = '';
  #timer = 0;
  /** Counts files, since answers for an earlier file may still come. */
  #file = 0;
  /** The whole picture, small, of a kind and with so many Gaussians: { kind, gaussians, edition, bitmap }. */
  preview = null;

  constructor(pool, { onArrival, onError }) {
    this.#pool = pool;
    this.#onArrival = onArrival;
    this.#onError = onError;
  }

  /** Forgets everything, for another file. */
  reset() {
    this.#file += 1;
    for (const tile of this.#kept.values()) tile.bitmap.close();
    this.#kept.clear();
    this.preview?.bitmap.close();
    this.preview = null;
    this.#queue = [];
    this.#running.clear();
    this.#failed.clear();
    this.#level = '';
    clearTimeout(this.#timer);
    this.#timer = 0;
  }

  /** Whether nothing is missing, as far as was asked for. */
  get isComplete() {
    return this.#queue.length === 0 && this.#running.size === 0 && this.#timer === 0;
  }

  /**
   * Says what is shown now: replaces what was asked for before, except what is being rendered.
   * `kinds` are `picture` or `plain`, which is the picture without its texture, and `outlines`. Where the GPU
   * renders the picture, it is absent.
   */
  want(scene) {
    const { frame, kinds } = scene;
    const level = nameOf(frame.level);
    const kind = kinds.find((kind) => kind !== 'outlines');
    const hasPreview = !kind || (this.preview && isOf(this.preview, { ...scene, kind }));
    this.#queue = hasPreview ? [] : [this.#previewJob(scene, kind)];
    if (level !== this.#level || this.#timer) {
      if (level !== this.#level) {
        // Not for every scale on the way.
        clearTimeout(this.#timer);
        this.#timer = setTimeout(() => {
          this.#timer = 0;
          this.#onArrival();
        }, this.#level ? REST : 0);
      }
      this.#level = level;
    } else {
      for (const margin of [0, TILE]) {
        for (const kind of kinds) this.#queue.push(...this.#missing(scene, kind, margin));
      }
    }
    this.#start();
  }

  #previewJob({ frame: { level }, gaussians, edition, picture }, kind) {
    const longest = Math.max(picture.width, picture.height);
    const side = (stored) => Math.max(1, Math.round((stored * PREVIEW) / longest));
    const size = { width: side(picture.width), height: side(picture.height) };
    // A picture that shows small needs no more.
    const whole = level.width < size.width ? level : size;
    const region = { x: 0, y: 0, ...whole };
    const key = `preview ${kind} ${gaussians} ${edition}`;
    return { kind, level: whole, region, gaussians, edition, isPreview: true, key };
  }

  /** The tiles that are not there, from the middle of the window outwards. */
  #missing({ frame, gaussians, edition, ratio }, kind, margin) {
    const { level, window, left, top } = frame;
    const region = visibleRegion(frame, margin);
    if (!region) return [];
    const jobs = [];
    for (const tile of tilesIn(level, region)) {
      const key = this.#key({ kind, gaussians, edition }, level, tile);
      if (this.#kept.has(key) || this.#running.has(key) || this.#failed.has(key)) continue;
      const dx = left + tile.x + tile.width / 2 - window.width / 2;
      const dy = top + tile.y + tile.height / 2 - window.height / 2;
      jobs.push({ key, kind, level, region: tile, gaussians, edition, ratio, distance: Math.hypot(dx, dy) });
    }
    return jobs.sort((a, b) => a.distance - b.distance);
  }

  #key({ kind, gaussians, edition }, level, { x, y }) {
    return `${kind} ${nameOf(level)} ${gaussians} ${edition} ${x},${y}`;
  }

  #start() {
    for (let thread = this.#pool.idle; thread && this.#queue.length > 0; thread = this.#pool.idle) {
      const job = this.#queue.shift();
      if (!this.#running.has(job.key) && !this.#kept.has(job.key)) this.#run(thread, job);
    }
  }

  async #run(thread, job) {
    const file = this.#file;
    thread.isBusy = true;
    this.#running.add(job.key);
    let bitmap;
    try {
      bitmap = await thread.call('render', job);
    } catch (error) {
      if (file === this.#file) {
        this.#failed.add(job.key);
        this.#onError(error);
      }
    }
    thread.isBusy = false;
    if (file !== this.#file) bitmap?.close();
    else {
      this.#running.delete(job.key);
      if (bitmap) this.#keep(job, bitmap);
    }
    this.#start();
  }

  #keep(job, bitmap) {
    if (job.isPreview) {
      this.preview?.bitmap.close();
      this.preview = { kind: job.kind, gaussians: job.gaussians, edition: job.edition, bitmap };
    } else {
      this.#kept.set(job.key, { ...job, bitmap });
    }
    this.#onArrival();
  }

  /** Forgets the tiles that were not used for the longest time. */
  trim({ window }) {
    const across = (side) => Math.ceil(side / TILE) + 2;
    const most = KEPT_WINDOWS * across(window.width) * across(window.height);
    for (const [key, tile] of this.#kept) {
      if (this.#kept.size <= most) return;
      tile.bitmap.close();
      this.#kept.delete(key);
    }
  }

  /** What is there of a frame: its tiles, each with its region, and regions without one. */
  at(frame, wanted) {
    const found = { tiles: [], missing: [] };
    const region = visibleRegion(frame);
    if (!region) return found;
    for (const tile of tilesIn(frame.level, region)) {
      const key = this.#key(wanted, frame.level, tile);
      const kept = this.#kept.get(key);
      if (kept) {
        // The last of the map now.
        this.#kept.delete(key);
        this.#kept.set(key, kept);
        found.tiles.push(kept);
      } else found.missing.push(tile);
    }
    return found;
  }

  /** Kept tiles of other levels, in groups by level, that of the most similar scale first. */
  ofOtherLevels(frame, wanted) {
    const levels = new Map();
    for (const tile of this.#kept.values()) {
      if (!isOf(tile, wanted)) continue;
      const name = nameOf(tile.level);
      if (!levels.has(name)) levels.set(name, []);
      levels.get(name).push(tile);
    }
    const unlike = ([{ level }]) => Math.abs(Math.log(level.width / frame.level.width));
    return [...levels.values()].sort((a, b) => unlike(a) - unlike(b));
  }
}
