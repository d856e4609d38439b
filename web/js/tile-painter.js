// Paints tiles to a canvas, and what stands in for those that are not there yet.

/** Levels of which tiles stand in. */
const STAND_IN_LEVELS = 3;

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

const isInside = ({ left, top, width, height }, window) =>
  left < window.width && top < window.height && left + width > 0 && top + height > 0;

export class TilePainter {
  #canvas;
  #context;
  #kind;

  /** `kind` is that of the tiles. */
  constructor(canvas, kind) {
    this.#canvas = canvas;
    this.#context = canvas.getContext('2d');
    this.#kind = kind;
  }

  /** Paints a frame with what there is. */
  paint({ frame, gaussians }, tiles) {
    const { window } = frame;
    const context = this.#context;
    if (this.#canvas.width !== window.width || this.#canvas.height !== window.height) {
      this.#canvas.width = window.width;
      this.#canvas.height = window.height;
    } else {
      context.clearRect(0, 0, window.width, window.height);
    }
    const found = tiles.at(frame, this.#kind, gaussians);
    if (found.missing.length > 0) this.#paintStandIns(frame, found.missing, gaussians, tiles);
    for (const { bitmap, level, region } of found.tiles) {
      const { left, top } = place(frame, level, region);
      context.drawImage(bitmap, left, top);
    }
  }

  #paintStandIns(frame, missing, gaussians, tiles) {
    const context = this.#context;
    context.save();
    context.beginPath();
    for (const region of missing) {
      const { left, top, width, height } = place(frame, frame.level, region);
      context.rect(left, top, width, height);
    }
    context.clip();
    let known = gaussians;
    if (this.#kind === 'picture' && tiles.preview) {
      // Until the preview for this part of the file has come, the picture stays what it was.
      known = tiles.preview.gaussians;
      const { left, top } = frame;
      context.drawImage(tiles.preview.bitmap, left, top, frame.level.width, frame.level.height);
    }
    for (const level of tiles.ofOtherLevels(frame, this.#kind, known).slice(-STAND_IN_LEVELS)) {
      for (const tile of level) {
        const at = place(frame, tile.level, tile.region);
        if (!isInside(at, frame.window)) continue;
        // Straight over what was there: a picture may have transparent parts.
        context.clearRect(at.left, at.top, at.width, at.height);
        context.drawImage(tile.bitmap, at.left, at.top, at.width, at.height);
      }
    }
    context.restore();
  }
}
