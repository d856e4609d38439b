// What every project does: encodes a picture, and shows it with its placeholder.

import 'image-gip/element';
import { encode } from 'image-gip/encoder';
import { placeholder } from 'image-gip/prefix';

const [width, height] = [64, 48];
const data = new Uint8Array(width * height * 3).map((_, at) => (at * 7 + (at >> 6)) % 256);

/** Sets the title to what came out, for the test. */
async function main() {
  const options = { bytes: 2000, effort: 1, firstLayer: 300, threads: 2 };
  const { file } = await encode({ width, height, channels: 3, data }, options);
  const image = document.createElement('gip-image');
  image.placeholder = placeholder(file, 500);
  image.src = URL.createObjectURL(new Blob([file], { type: 'image/vnd.gip' }));
  document.body.append(image);
  await image.decode();
  const canvas = image.shadowRoot.querySelector('canvas');
  document.title = `shown ${canvas.width} x ${canvas.height} of ${file.length} bytes`;
}

main().catch((error) => {
  document.title = `failed: ${error.stack}`;
});
