// How many Gaussians may lie over each other, which bounds the work for a pixel.

const CELLS = 64;

/** An upper bound of how many Gaussians show in one place of the picture. */
export function mostOverlap(numbers, { width, height, cutoff }) {
  // Counts per cell as differences to the cell before, so that a large Gaussian takes no longer.
  const side = CELLS + 1;
  const changes = new Int32Array(side * side);
  const radius = Math.sqrt(cutoff);
  for (let at = 0; at < numbers.length; at += 9) {
    const [x, y, l11, l21, l22] = numbers.subarray(at, at + 5);
    // A pixel more: what is made smaller is widened.
    const reach = radius * l11 + 1;
    const rise = radius * Math.hypot(l21, l22) + 1;
    const [left, right] = cells(x - reach, x + reach, width);
    const [top, bottom] = cells(y - rise, y + rise, height);
    if (!(left < right && top < bottom)) continue;
    changes[top * side + left] += 1;
    changes[top * side + right] -= 1;
    changes[bottom * side + left] -= 1;
    changes[bottom * side + right] += 1;
  }
  let most = 0;
  for (let row = 0; row < side; row += 1) {
    for (let column = 0; column < side; column += 1) {
      const at = row * side + column;
      if (column > 0) changes[at] += changes[at - 1];
      if (row > 0) changes[at] += changes[at - side];
      if (row > 0 && column > 0) changes[at] -= changes[at - side - 1];
      most = Math.max(most, changes[at]);
    }
  }
  return most;
}

/** The first cell, and the one after the last, between two places along a side. */
function cells(low, high, length) {
  const cell = (at) => Math.min(CELLS, Math.max(0, (at / length) * CELLS));
  return [Math.floor(cell(low)), Math.ceil(cell(high))];
}
