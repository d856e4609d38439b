// Paints tiles to a canvas, and what stands in for those that are not there yet.

/** Most levels of which tiles stand in. */
const STAND_IN_LEVELS = 2;

/** Where a region of a level is in the window of a frame, in whole device pixels. */
function place(frame, level, { x, y, width, height }) {
  const sx = frame.level.width / level.width;
  const sy = frame.level.height / level.height;
  const left = Math.round(frame.left + x * sx);
  const top = Math.round(frame.top + y * sy);
  const right = Math.round(frame.left + (x + width) * sx);
  const bottom = Math.round(frame.top + (y + height) * sy);
  return { left, top, width: right - left, height: bottom - top };
}

/** How many pixels of the window a place takes. */
function areaInside({ left, top, width, height }, window) {
  const across = Math.min(left + width, window.width) - Math.max(left, 0);
  const down = Math.min(top + height, window.height) - Math.max(top, 0);
  return Math.max(0, across) * Math.max(0, down);
}

export class TilePainter {
  #canvas;
  #context;

  constructor(canvas) {
    this.#canvas = canvas;
    this.#context = canvas.getContext('2d');
  }

  /** Paints a frame with what there is of tiles of a kind. */
  paint({ frame, gaussians, edition }, kind, tiles) {
    const { window } = frame;
    const context = this.#context;
    if (this.#canvas.width !== window.width || this.#canvas.height !== window.height) {
      this.#canvas.width = window.width;
      this.#canvas.height = window.height;
    } else {
      context.clearRect(0, 0, window.width, window.height);
    }
    const wanted = { kind, gaussians, edition };
    const found = tiles.at(frame, wanted);
    if (found.missing.length > 0) this.#paintStandIns(frame, found.missing, wanted, tiles);
    for (const { bitmap, level, region } of found.tiles) {
      const { left, top } = place(frame, level, region);
      context.drawImage(bitmap, left, top);
    }
  }

  #paintStandIns(frame, missing, wanted, tiles) {
    const context = this.#context;
    context.save();
    context.beginPath();
    for (const region of missing) {
      const { left, top, width, height } = place(frame, frame.level, region);
      context.rect(left, top, width, height);
    }
    context.clip();
    this.#standIns(frame, wanted, tiles).forEach((images, index) => {
      for (const { bitmap, at } of images) {
        // In place of what is below, not over it: a picture may have transparent parts.
        if (index > 0) context.clearRect(at.left, at.top, at.width, at.height);
        context.drawImage(bitmap, at.left, at.top, at.width, at.height);
      }
    });
    context.restore();
  }

  /** Layers of { bitmap, at } from the bottom up, no more than are needed to cover the window. */
  #standIns(frame, wanted, tiles) {
    const preview = wanted.kind === 'outlines' ? null : tiles.preview;
    // Until the preview of what is wanted has come, the picture stays what it was.
    const known = preview ?? wanted;
    const whole = { left: frame.left, top: frame.top, ...frame.level };
    const layers = [];
    const levels = tiles.ofOtherLevels(frame, known).slice(0, STAND_IN_LEVELS);
    for (const level of levels) {
      const images = level.map(({ bitmap, level, region }) => ({ bitmap, at: place(frame, level, region) }));
      const areas = images.map(({ at }) => areaInside(at, frame.window));
      layers.unshift(images.filter((_, index) => areas[index] > 0));
      if (areas.reduce((sum, area) => sum + area, 0) >= areaInside(whole, frame.window)) return layers;
    }
    if (preview) layers.unshift([{ bitmap: preview.bitmap, at: whole }]);
    return layers;
  }
}
