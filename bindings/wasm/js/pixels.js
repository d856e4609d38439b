// The samples of a picture, as the encoder takes them.

/** The codes of the colour space of an `ImageData`. */
const cicpOf = { 'display-p3': [12, 13] };

/** The least number of channels that have all of a picture of 8-bit RGBA. */
function channelsOf(data) {
  let [hasColor, hasAlpha] = [false, false];
  for (let at = 0; at < data.length && !(hasColor && hasAlpha); at += 4) {
    hasColor ||= data[at] !== data[at + 1] || data[at] !== data[at + 2];
    hasAlpha ||= data[at + 3] !== 255;
  }
  return (hasColor ? 3 : 1) + (hasAlpha ? 1 : 0);
}

/** Of RGBA only so many channels. */
function reduced(data, channels) {
  if (channels === 4) return data;
  const pixels = data.length / 4;
  const from = [[0], [0, 3], [0, 1, 2]][channels - 1];
  const samples = new Uint8Array(pixels * channels);
  for (let pixel = 0, at = 0; pixel < pixels; pixel += 1) {
    for (const channel of from) samples[at++] = data[4 * pixel + channel];
  }
  return samples;
}

/** The picture, if it has all of its samples. */
export function checked(image) {
  const { width, height, data, channels = 4 } = image ?? {};
  const isEight = data instanceof Uint8Array || data instanceof Uint8ClampedArray;
  if (!isEight && !(data instanceof Uint16Array)) {
    throw new TypeError('a picture must have data: a Uint8Array, Uint8ClampedArray or Uint16Array');
  }
  if (![1, 2, 3, 4].includes(channels)) throw new RangeError(`channels is ${String(channels)}; it must be 1 to 4`);
  if (!(data.length === width * height * channels)) {
    throw new RangeError(`${data.length} samples; ${width} x ${height} pixels of ${channels} channels need others`);
  }
  return image;
}

/**
 * Width, height, channels, samples, and the codes of the colour space, if it is not sRGB. Without `channels`, the
 * picture is RGBA, as an `ImageData`, and channels in which there is nothing are left out.
 */
export function samplesOf(image) {
  const { width, height, data, channels, colorSpace } = checked(image);
  const bytes = data instanceof Uint8ClampedArray ? new Uint8Array(data.buffer, data.byteOffset, data.length) : data;
  const cicp = cicpOf[colorSpace];
  if (channels !== undefined || data instanceof Uint16Array) return { width, height, channels: channels ?? 4, data: bytes, cicp };
  const least = channelsOf(bytes);
  return { width, height, channels: least, data: reduced(bytes, least), cicp };
}
