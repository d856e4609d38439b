// The test vectors of the specification: what a line of spec/vectors/index.tsv says of a file, and
// what a decoder makes of it. Runs in Node and in the browser.

const table = Uint32Array.from({ length: 256 }, (_, byte) => {
  let crc = byte;
  for (let bit = 0; bit < 8; bit += 1) crc = crc & 1 ? (crc >>> 1) ^ 0xedb88320 : crc >>> 1;
  return crc;
});

/** The CRC-32 of bytes (spec, section 4.2). */
export function crc32(bytes) {
  let crc = 0xffffffff;
  for (const byte of bytes) crc = (crc >>> 8) ^ table[(crc ^ byte) & 0xff];
  return (crc ^ 0xffffffff) >>> 0;
}

/** The vectors are to be decoded whatever they cost. */
export const unlimited = {
  width: 2 ** 32 - 1,
  height: 2 ** 32 - 1,
  pixels: 2 ** 40,
  outputPixels: 2 ** 40,
  gaussians: 2 ** 32,
  memory: 2 ** 40,
  work: 2 ** 60,
};

/** The lines of index.tsv, but for those that say what is skipped, which this decoder does not tell. */
export function parseIndex(text) {
  const [, ...lines] = text.trimEnd().split('\n');
  const all = lines.map((line) => {
    const [file, rendering, result] = line.split('\t');
    return { file, rendering, result };
  });
  return all.filter(({ rendering }) => rendering !== 'skips');
}

const models = { Gray: 'gray', GrayAlpha: 'gray-alpha', Rgb: 'rgb', Rgba: 'rgba' };

/** The options of a rendering. */
function optionsOf(rendering) {
  const options = {};
  for (const part of rendering.split(', ')) {
    let match;
    if (part === 'whole') continue;
    if ((match = part.match(/^size (\d+)x(\d+)$/))) {
      [options.width, options.height] = [Number(match[1]), Number(match[2])];
    } else if ((match = part.match(/^region (\d+)x(\d+) at (\d+),(\d+)$/))) {
      const [width, height, x, y] = match.slice(1).map(Number);
      options.region = { x, y, width, height };
    } else if ((match = part.match(/^first (\d+)$/))) {
      options.gaussians = Number(match[1]);
    } else if ((match = part.match(/^as (\w+)$/))) {
      options.color = models[match[1]];
    } else if (part === 'without texture') {
      options.texture = false;
    } else {
      throw new Error(`unknown rendering: ${rendering}`);
    }
  }
  return options;
}

/** Samples as index.tsv counts them: 16-bit samples with their more significant byte first. */
function bytesOf({ data, depth }) {
  if (depth === 8) return data;
  const view = new DataView(new ArrayBuffer(2 * data.length));
  data.forEach((sample, index) => view.setUint16(2 * index, sample));
  return new Uint8Array(view.buffer);
}

/** What a decoder makes of one line, as index.tsv says it. Its methods may give promises. */
export async function resultOf(decoder, bytes, { rendering }) {
  try {
    // In two pieces, so that the second begins anywhere.
    const half = Math.floor(bytes.length / 2);
    await decoder.feed(bytes.subarray(0, half));
    await decoder.feed(bytes.subarray(half));
    await decoder.finish();
    if (rendering === 'error') return 'no error';
    const crc = crc32(bytesOf(await decoder.samples(optionsOf(rendering))));
    return crc.toString(16).padStart(8, '0');
  } catch (error) {
    if (error.kind === undefined) throw error;
    const what = [error.kind.replace('-', ' '), error.chunk].filter(Boolean).join(' ');
    return `${what}; ${(await decoder.gaussians()).length / 9} kept`;
  } finally {
    decoder.close();
  }
}
