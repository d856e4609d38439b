// Pictures of all kinds that browsers have, as pixels.

/** Whether an object is of a class, which this platform may not have. */
const isOf = (object, name) => typeof globalThis[name] === 'function' && object instanceof globalThis[name];

const drawable = [
  'ImageBitmap',
  'HTMLImageElement',
  'HTMLCanvasElement',
  'OffscreenCanvas',
  'HTMLVideoElement',
  'VideoFrame',
];

/** The size of what can be drawn, in pixels. */
const sizeOf = (image) => [
  image.naturalWidth ?? image.videoWidth ?? image.displayWidth ?? image.width,
  image.naturalHeight ?? image.videoHeight ?? image.displayHeight ?? image.height,
];

/** Draws it, and reads the pixels, in Display P3 where that is asked for. */
function draw(image, colorSpace) {
  const [width, height] = sizeOf(image);
  if (!(width > 0 && height > 0)) throw new RangeError(`the picture has ${width} x ${height} pixels`);
  const canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext('2d', { colorSpace, willReadFrequently: true });
  context.drawImage(image, 0, 0);
  return context.getImageData(0, 0, width, height, { colorSpace });
}

/** A picture as `{ width, height, data, ... }`; what is so already is returned as it is. */
export async function pixelsOf(source, colorSpace) {
  if (isOf(source, 'Blob')) {
    if (typeof createImageBitmap !== 'function') {
      throw new TypeError('there are no decoders of pictures here: the source must be { width, height, data }');
    }
    const bitmap = await createImageBitmap(source);
    try {
      return draw(bitmap, colorSpace);
    } finally {
      bitmap.close();
    }
  }
  if (isOf(source, 'HTMLImageElement')) await source.decode();
  return drawable.some((name) => isOf(source, name)) ? draw(source, colorSpace) : source;
}
