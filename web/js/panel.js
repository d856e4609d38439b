// The panel: what the file has, and what its bytes are spent on.

import { element } from './dom.js';
import { bytes, count, decimal, integer, percent } from './format.js';

const CHUNKS = {
  GHDR: 'header',
  QNTZ: 'quantizers',
  GAUS: 'Gaussians',
  GEND: 'end',
  bNDS: 'bounds of the layers',
  iCCP: 'ICC profile',
  eXIf: 'Exif',
  xMPd: 'XMP',
  tEXt: 'text',
};

const COLORS = { gray: 'gray', 'gray-alpha': 'gray and alpha', rgb: 'RGB', rgba: 'RGB and alpha' };

const KERNELS = {
  exponential: 'exponential, exp(-q / 2)',
  quartic: 'quartic, (1 - q / 4)²',
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

function picture({ name, size, header }) {
  const pixels = header.width * header.height;
  return facts([
    ['Name', name],
    ['File', bytes(size)],
    ['Picture', `${integer(header.width)} × ${integer(header.height)} pixels`],
    ['Rate', `${decimal((size * 8) / pixels, 3)} bits per pixel`],
    ['Colour', `${COLORS[header.color] ?? header.color}, ${header.depth} bits`],
    ['Gaussians', `${integer(header.gaussians)} in ${count(header.layers, 'layer')}`],
    ['Coding', header.coding],
    ['Kernel', KERNELS[header.kernel] ?? header.kernel],
    ['Cut-off', `q = ${decimal(header.cutoff, header.cutoff % 1 ? 2 : 0)}`],
    ['Shape', header.parameterization],
    ['Base colour', baseColor(header)],
    ['Version', String(header.version)],
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

function steps({ latticeSteps }) {
  if (!latticeSteps) return null;
  const number = (value) => value.toPrecision(3);
  const { position, size, ratio, slant, color } = latticeSteps;
  return element('details', {}, element('summary', {}, 'Quantization steps'), facts([
    ['Position', number(position)],
    ['Size', number(size)],
    ['Ratio', number(ratio)],
    ['Slant', number(slant)],
    ['Colour', [...color].map(number).join(', ')],
  ]));
}

function metadata({ iccProfile, exif, xmp, texts }) {
  const rows = [
    ['ICC profile', iccProfile && bytes(iccProfile.length)],
    ['Exif', exif && bytes(exif.length)],
    ['XMP', xmp && `${integer(xmp.length)} characters`],
    ...texts.map(({ keyword, text }) => [keyword, text.length > 300 ? `${text.slice(0, 300)} …` : text]),
  ];
  if (rows.every(([, value]) => value === null)) return null;
  return element('section', {}, element('h3', {}, 'Metadata'), facts(rows));
}

/** Fills the panel. `about` has `metadata` and `statistics`; `arrived` counts Gaussians. */
export function showPanel(panel, { name, size, header, about, arrived }) {
  const { statistics } = about;
  const chunks = statistics.chunks.map(({ type, count: times, bytes: length }) => ({
    name: times > 1 ? `${type} × ${integer(times)}` : type,
    note: CHUNKS[type] ?? '',
    value: integer(length),
    share: length / size,
  }));
  const parts = [
    element('h2', {}, 'Details'),
    picture({ name, size, header }),
    attributes(statistics, arrived),
    bars('Bytes by chunk', chunks),
    steps(statistics),
    metadata(about.metadata),
    // The page says here what renders the picture.
    element('p', { className: 'small', id: 'renderer' }),
  ];
  panel.replaceChildren(...parts.filter((part) => part !== null));
}
