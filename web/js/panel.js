// The panel: what the file has, and what its bytes are spent on.

import { element } from './dom.js';
import { bytes, count, decimal, integer, percent } from './format.js';

const CHUNKS = {
  H: 'header',
  L: 'Gaussians',
  E: 'end',
  bNDS: 'bounds of the layers',
  tXTR: 'texture',
  cICP: 'Colour space',
  mDCV: 'Mastering display',
  cLLI: 'Light level',
  iCCP: 'ICC profile',
  eXIF: 'Exif',
  xMPD: 'XMP',
  tEXt: 'text',
};

const COLORS = { gray: 'gray', 'gray-alpha': 'gray and alpha', rgb: 'RGB', rgba: 'RGB and alpha' };

const KERNELS = {
  exponential: 'exponential, exp(-q / 2)',
  quartic: 'quartic, (1 - q / 4)²',
};

/** What Exif has turned, by its value. */
const ORIENTATIONS = {
  2: 'mirrored',
  3: 'turned by 180°',
  4: 'mirrored, then turned by 180°',
  5: 'mirrored, then turned by 270°',
  6: 'turned by 90°',
  7: 'mirrored, then turned by 90°',
  8: 'turned by 270°',
};

/** A list of names and values. Values that are `null` are left out. */
function facts(rows) {
  const list = element('dl', { className: 'facts' });
  for (const [name, value] of rows) {
    if (value !== null) list.append(element('dt', {}, name), element('dd', {}, value));
  }
  return list;
}

/** A table with a bar for the share of each row: { name, note, value, share }. */
function bars(caption, rows) {
  const table = element('table', { className: 'bars' }, element('caption', {}, caption));
  for (const { name, note, value, share } of rows) {
    const row = table.insertRow();
    const head = element('th', { scope: 'row' }, name, note ? element('small', {}, note) : null);
    const bar = element('span', { className: 'bar' });
    bar.style.setProperty('--share', share);
    row.append(head, element('td', {}, value), element('td', {}, bar, element('small', {}, percent(share))));
  }
  return table;
}

/** The base colour as a patch and numbers. */
function baseColor({ baseColor: values, channels }) {
  const shown = channels < 3 ? [values[0], values[0], values[0]] : values.slice(0, 3);
  const patch = element('span', { className: 'patch' });
  patch.style.backgroundColor = `rgb(${shown.map((value) => Math.round(value / 257)).join(' ')})`;
  const numbers = values.map((value) => decimal(value / 65535, 3)).join(', ');
  return element('span', {}, patch, numbers);
}

function ofPicture({ name, size, picture }) {
  const pixels = picture.width * picture.height;
  return facts([
    ['Name', name],
    ['File', bytes(size)],
    ['Picture', `${integer(picture.width)} × ${integer(picture.height)} pixels`],
    ['Orientation', ORIENTATIONS[picture.orientation] ?? null],
    ['Rate', `${decimal((size * 8) / pixels, 3)} bits per pixel`],
    ['Colour', `${COLORS[picture.color] ?? picture.color}, ${picture.depth} bits`],
    ['Gaussians', `${integer(picture.gaussians)} in ${count(picture.layers, 'layer')}`],
    ['Coding', picture.coding],
    ['Kernel', KERNELS[picture.kernel] ?? picture.kernel],
    ['Cut-off', `q = ${decimal(picture.cutoff, picture.cutoff % 1 ? 2 : 0)}`],
    ['Shape', picture.parameterization],
    ['Base colour', baseColor(picture)],
    ['Version', String(picture.version)],
  ]);
}

/** Bits by attribute, if there are Gaussians. */
function attributes({ attributeBits }, arrived) {
  const bits = Object.entries(attributeBits ?? {});
  const total = bits.reduce((sum, [, number]) => sum + number, 0);
  if (total === 0) return null;
  const names = { position: 'position', precision: 'precision', shape: 'shape', color: 'colour' };
  return bars(
    `Bits per Gaussian: ${decimal(total / arrived, 2)}`,
    bits.filter(([, number]) => number > 0).map(([name, number]) => ({
      name: names[name],
      value: decimal(number / arrived, 2),
      share: number / total,
    })),
  );
}

function steps({ quantizationSteps }) {
  if (!quantizationSteps) return null;
  const number = (value) => value.toPrecision(3);
  const { position, size, ratio, slant, color } = quantizationSteps;
  return element('details', {}, element('summary', {}, 'Quantization steps'), facts([
    ['Position', number(position)],
    ['Size', number(size)],
    ['Ratio', number(ratio)],
    ['Slant', number(slant)],
    ['Colour', [...color].map(number).join(', ')],
  ]));
}

/** The colour spaces that have names, by their codes. */
const colorSpaces = { '12,13': 'Display P3', '9,16': 'BT.2100 PQ', '9,18': 'BT.2100 HLG' };

function metadata({ cicp, iccProfile, exif, xmp, texts }) {
  const rows = [
    ['Colour space', cicp && (colorSpaces[cicp] ?? `cICP ${cicp.join(', ')}`)],
    ['ICC profile', iccProfile && bytes(iccProfile.length)],
    ['Exif', exif && bytes(exif.length)],
    ['XMP', xmp && `${integer(xmp.length)} characters`],
    ...texts.map(({ keyword, text }) => [keyword, text.length > 300 ? `${text.slice(0, 300)} …` : text]),
  ];
  if (rows.every(([, value]) => value === null)) return null;
  return element('section', {}, element('h3', {}, 'Metadata'), facts(rows));
}

/** Fills the panel. `about` has `metadata` and `statistics`; `arrived` counts Gaussians. */
export function showPanel(panel, { name, size, picture, about, arrived }) {
  const { statistics } = about;
  const chunks = statistics.chunks.map(({ type, count: times, bytes: length }) => ({
    name: times > 1 ? `${type} × ${integer(times)}` : type,
    note: CHUNKS[type] ?? '',
    value: integer(length),
    share: length / size,
  }));
  const parts = [
    element('h2', {}, 'Details'),
    ofPicture({ name, size, picture }),
    attributes(statistics, arrived),
    bars('Bytes by chunk', chunks),
    steps(statistics),
    metadata(about.metadata),
    // The page says here what renders the picture.
    element('p', { className: 'small', id: 'renderer' }),
  ];
  panel.replaceChildren(...parts.filter((part) => part !== null));
}
