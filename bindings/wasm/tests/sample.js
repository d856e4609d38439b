// A picture for the encoder.

/** A picture with edges, gradients and some noise, the same each time. */
export function sample({ width = 96, height = 64, channels = 4 } = {}) {
  const data = new Uint8Array(width * height * channels);
  let state = 1;
  for (let at = 0; at < data.length; at += 1) {
    const [channel, pixel] = [at % channels, Math.floor(at / channels)];
    const [x, y] = [pixel % width, Math.floor(pixel / width)];
    state = (state * 1103515245 + 12345) % 2 ** 31;
    const noise = (state / 2 ** 31) * 8;
    const disc = Math.hypot(x - width / 2, y - height / 2) < height / 3 ? 90 : 0;
    data[at] = channel === 3 ? 255 : Math.min(255, 40 + x + disc * (channel + 1) * 0.5 + noise);
  }
  return { width, height, channels, data };
}
