// How a picture is turned for display, by the values that Exif has for it: 1, as it is stored, to 8.

const exchangesAxes = (orientation) => orientation > 4;
const mirrorsColumns = (orientation) => [2, 3, 7, 8].includes(orientation);
const mirrorsRows = (orientation) => [3, 4, 6, 7].includes(orientation);

/** The size of a picture after turning. */
export function turnedSize({ width, height }, orientation) {
  return exchangesAxes(orientation) ? { width: height, height: width } : { width, height };
}

/** The size of the upright picture; 0 until header and orientation are known. */
export function naturalSize(header, orientation) {
  return orientation === null ? { width: 0, height: 0 } : turnedSize(header, orientation);
}

/** What has a header and an orientation, and the size that follows from them. */
export class Upright {
  get naturalWidth() {
    return naturalSize(this.header, this.orientation).width;
  }

  get naturalHeight() {
    return naturalSize(this.header, this.orientation).height;
  }
}

/** Turns Gaussians, nine numbers each, of a picture with this stored size. */
export function turnGaussians(numbers, { width, height }, orientation) {
  for (let at = 0; at < numbers.length; at += 9) {
    let [x, y, l11, l21, l22] = numbers.subarray(at, at + 5);
    if (mirrorsColumns(orientation)) [x, l21] = [width - x, -l21];
    if (mirrorsRows(orientation)) [y, l21] = [height - y, -l21];
    if (exchangesAxes(orientation)) {
      // The Cholesky factor of the covariance whose rows and columns are exchanged.
      const length = Math.hypot(l21, l22);
      [x, y, l11, l21, l22] = [y, x, length, (l11 * l21) / length, (l11 * l22) / length];
    }
    numbers.set([x, y, l11, l21, l22], at);
  }
  return numbers;
}
