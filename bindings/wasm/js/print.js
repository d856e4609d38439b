// Sharp pictures on printed pages, also of those that were never on the screen.
//
// A page cannot make a browser wait with printing. So between `beforeprint` and the printing, files are fetched and decoded on
// the page's own thread, without waiting for anything.

import { Decoder, load } from './core.js';
import { plan } from './layout.js';
import { turnedSize } from './orientation.js';
import { wantsFewBytes } from './reduced-data.js';
import { contentSize } from './styles.js';

/** Pixels for a CSS pixel, of which there are 96 in an inch of paper. */
const mostDensity = 2;
/** Most pixels of all pictures together: with more of them, each is coarser. */
const mostPixels = 2 ** 26;

/** What undoes the changes to the page. */
let restore = [];

/** The elements in a tree, and in the open shadow trees inside it. */
function* elementsIn(root) {
  for (const element of root.querySelectorAll('*')) {
    if (element.localName === 'gip-image') yield element;
    else if (element.shadowRoot) yield* elementsIn(element.shadowRoot);
  }
}

/** The bytes of a file, from the cache if it was loaded before. */
function bytesOf({ src, crossOrigin }) {
  const request = new XMLHttpRequest();
  request.open('GET', src, false);
  request.withCredentials = crossOrigin === 'use-credentials';
  // Each byte becomes a character, whose code ends with that byte: requests that block give no other bytes.
  request.overrideMimeType('text/plain; charset=x-user-defined');
  request.send();
  if (request.status !== 200) throw new Error(`the server answers ${request.status}`);
  return Uint8Array.from(request.responseText, (character) => character.charCodeAt(0));
}

/** The pixels for a box, and where in it they belong; `null` if there are none. */
function render(decoder, element, density) {
  const { header, orientation, colorSpace } = decoder.progress;
  const { cicp } = decoder.metadata;
  const isWide = String(cicp) === '12,13';
  // All others would take a conversion, which browsers do later.
  if (orientation === null || (colorSpace && !isWide)) return null;
  const { objectFit, objectPosition, imageOrientation } = getComputedStyle(element);
  const turned = imageOrientation === 'none' ? 'none' : 'from-image';
  const css = contentSize(element);
  const device = { width: Math.round(css.width * density), height: Math.round(css.height * density) };
  const natural = turnedSize(header, turned === 'none' ? 1 : orientation);
  const made = plan({ css, device, natural, fit: objectFit, position: objectPosition });
  if (!made) return null;
  const { width, height, region } = made;
  const image = decoder.render({ width, height, region, orientation: turned, texture: element.texture === 'on' });
  const colors = { colorSpace: isWide ? 'display-p3' : 'srgb' };
  return { css, place: made.place, colors, image: new ImageData(image.data, image.width, image.height, colors) };
}

/** A canvas that follows the box, whose size on paper is another one. */
function canvasOf(element, { css, place, colors, image }) {
  const canvas = Object.assign(document.createElement('canvas'), { width: image.width, height: image.height });
  canvas.part = 'picture';
  canvas.getContext('2d', colors).putImageData(image, 0, 0);
  const percent = (length, whole) => `${(100 * length) / whole}%`;
  Object.assign(canvas.style, {
    left: percent(place.left, css.width),
    top: percent(place.top, css.height),
    width: percent(place.width, css.width),
    height: percent(place.height, css.height),
  });
  const box = document.createElement('div');
  const { paddingLeft, paddingTop, paddingRight, paddingBottom } = getComputedStyle(element);
  const inset = `${paddingTop} ${paddingRight} ${paddingBottom} ${paddingLeft}`;
  Object.assign(box.style, { position: 'absolute', overflow: 'hidden', inset });
  box.append(canvas);
  return box;
}

function prepare(element, density) {
  const shown = element.shadowRoot.querySelector('.window');
  if (!shown || !element.src || wantsFewBytes(element)) return;
  const decoder = new Decoder({ limits: element.limits });
  try {
    decoder.feed(bytesOf(element));
  } catch {
    // What came before the damage is printed, and without a file what is on the page.
  }
  try {
    const rendered = render(decoder, element, density);
    if (!rendered) return;
    const box = canvasOf(element, rendered);
    shown.after(box);
    shown.style.display = 'none';
    restore.push(() => {
      shown.style.display = '';
      box.remove();
      // Nobody can tell when else the memory is freed.
      box.firstChild.width = 0;
    });
  } finally {
    decoder.close();
  }
}

function prepareAll() {
  restoreAll();
  const all = [...elementsIn(document)].filter((element) => element.shadowRoot);
  const pixels = all.map(contentSize).reduce((sum, { width, height }) => sum + width * height, 0);
  const density = Math.min(mostDensity, Math.sqrt(mostPixels / pixels));
  for (const element of all) {
    try {
      prepare(element, density);
    } catch {
      // What is on the page is printed.
    }
  }
}

function restoreAll() {
  for (const undo of restore.splice(0)) undo();
}

async function start() {
  // What is on the screen comes before what may be printed.
  if (document.readyState !== 'complete') await new Promise((resolve) => addEventListener('load', resolve, { once: true }));
  await load();
  addEventListener('beforeprint', prepareAll);
  addEventListener('afterprint', restoreAll);
}

/** Resolves when pages can be printed so. On a server there are none. */
export const ready = globalThis.document ? start() : Promise.resolve();
