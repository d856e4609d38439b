// Ten pictures of hills under a sky, as JPEG and PNG, so that none has to be in the repository.

import sharp from 'sharp';

const [width, height] = [480, 320];

/** A number from 0 to 1 for a place and a picture, the same in every run. */
const noise = (x, y, seed) => {
  const value = Math.sin(x * 12.9898 + y * 78.233 + seed * 37.719) * 43758.5453;
  return value - Math.floor(value);
};

for (let seed = 0; seed < 10; seed += 1) {
  const data = Buffer.alloc(width * height * 3);
  for (let y = 0; y < height; y += 1) {
    for (let x = 0; x < width; x += 1) {
      const hill = height * (0.55 + 0.15 * Math.sin(x / (40 + 9 * seed) + seed) + 0.05 * Math.sin(x / 17));
      const sun = Math.hypot(x - 40 * (seed + 1), y - 60) < 26;
      const sky = [90 + 0.5 * y, 140 + 0.3 * y, 230 - 8 * seed];
      const grass = [60 + 60 * noise(x, y, seed), 110 + 50 * noise(y, x, seed), 40 + 12 * seed];
      const color = y > hill ? grass : sun ? [255, 230, 150] : sky;
      for (let channel = 0; channel < 3; channel += 1) data[3 * (y * width + x) + channel] = color[channel];
    }
  }
  const picture = sharp(data, { raw: { width, height, channels: 3 } });
  await picture.toFile(`picture${seed}.${seed % 2 ? 'png' : 'jpg'}`);
}
