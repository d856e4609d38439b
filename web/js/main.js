// The page: joins the stage with its controls, and opens files.

import { Comparison } from './comparison.js';
import { element } from './dom.js';
import { listenForFiles } from './drop.js';
import { decode, fromFile, fromUrl, isGip } from './file.js';
import { integer, zoom } from './format.js';
import { GpuPainter } from './gpu-painter.js';
import { PointerInput } from './input.js';
import { KEYS, listenToKeys } from './keyboard.js';
import { Maker } from './maker.js';
import { showPanel } from './panel.js';
import { Pool } from './pool.js';
import { Scrubber } from './scrubber.js';
import { Stage } from './stage.js';

const SAMPLE = 'sample/sumac.gip';
const find = (selector) => document.querySelector(selector);

const [stageElement, panel, message] = [find('#stage'), find('#panel'), find('#message')];
const textureButton = find('[data-action="texture"]');
const fail = (error) => tell(error.message);
const pool = new Pool(fail);
const comparison = new Comparison(stageElement);
const stage = new Stage(stageElement, pool, comparison, fail);
const scrubber = new Scrubber(pool, (gaussians) => stage.showGaussians(gaussians));
const parameters = new URLSearchParams(location.search);
let gpu = startGpu(parameters.get('renderer'));
let opening = new AbortController();
const maker = new Maker(find('#maker'), { onFile: openMade, onRival: setRival, onError: fail });

/** Shows a message until it is dismissed or another file is opened. */
function tell(text) {
  message.querySelector('p').textContent = text;
  message.hidden = false;
}

/** The painter that uses the GPU; `null` where there is none, and when the page's address forbids it. */
function startGpu(renderer) {
  if (renderer === 'tiles') return null;
  const onLost = () => {
    gpu = null;
    stage.setGpu(null);
  };
  const anyAdapter = renderer === 'webgpu';
  return GpuPainter.create(find('#picture-gpu'), { anyAdapter, onLost }).catch(() => null);
}

/** For screen readers. */
function announce(text) {
  find('#status').textContent = text;
}

/** Opens the .gip file that a function finds: { name, stream }. What was made here is forgotten. */
function open(locate) {
  maker.close();
  return openFile(locate);
}

/** Opens a file that was made here. The window goes on showing the same part of the picture. */
async function openMade(file) {
  const { x, y, scale } = stage.view;
  const goesOn = stage.hasPicture && !stage.view.isFitted;
  await openFile(() => file);
  if (goesOn) stage.jump((view) => view.moveTo({ x, y, scale }));
  if (file.isLast) announce(`${file.name} is made.`);
}

async function openFile(locate) {
  opening.abort();
  opening = new AbortController();
  const { signal } = opening;
  message.hidden = true;
  try {
    const file = await locate(signal);
    signal.throwIfAborted();
    close();
    document.body.classList.add('loading');
    const result = await decode(file, pool, { signal, onProgress: (progress) => show(file, progress) });
    show(file, result);
    await finish(file, result, signal);
  } catch (error) {
    if (!signal.aborted) fail(error);
  } finally {
    if (!signal.aborted) document.body.classList.remove('loading');
  }
}

/** Back to the page without a picture. */
function close() {
  stage.reset();
  scrubber.setFile(null);
  comparison.setOriginal(null);
  textureButton.hidden = true;
  drawToggles();
  panel.replaceChildren();
  document.body.classList.add('empty');
  document.title = 'gip viewer';
  find('#name').textContent = 'gip viewer';
  stageElement.setAttribute('aria-label', 'No picture');
}

/** Shows what has arrived of a file. */
function show({ name }, { picture, gaussians, edition, size }) {
  if (!picture) return;
  if (!stage.hasPicture) {
    document.body.classList.remove('empty');
    stage.setPicture(picture);
    document.title = `${name} - gip viewer`;
    find('#name').textContent = name;
    stageElement.setAttribute('aria-label', `${name}, ${picture.width} by ${picture.height} pixels`);
    stageElement.focus({ preventScroll: true });
  }
  scrubber.showArrival({ size, gaussians });
  stage.edition = edition;
  stage.showGaussians(gaussians);
}

/** What is shown of a damaged file. */
function keptOf(picture, gaussians) {
  if (gaussians === 0) return 'Only the base colour can be shown.';
  return `What is shown came before that: ${integer(gaussians)} of ${integer(picture.gaussians)} Gaussians.`;
}

/** What needs the whole file, or what there is of it. */
async function finish({ name }, { size, picture, gaussians, error }, signal) {
  if (error) {
    tell(`${name}: ${error.message}.${picture ? ` ${keptOf(picture, gaussians)}` : ''}`);
  }
  if (!picture) return;
  const about = await pool.ask('about');
  signal.throwIfAborted();
  showPanel(panel, { name, size, picture, about, arrived: gaussians });
  scrubber.setFile({ size, gaussians, layers: about.statistics.layers });
  textureButton.hidden = !about.statistics.chunks.some(({ type }) => type === 'tXTR');
  stage.draw();
  announce(`${name} is open.`);
  // The shader knows nothing of colour profiles.
  if (!about.metadata.iccProfile && !about.metadata.cicp) await useGpu(picture, signal);
}

/** Paints with the GPU, if there is one that can. */
async function useGpu(picture, signal) {
  const painter = await gpu;
  if (!painter) return;
  const [numbers, map] = await Promise.all([pool.ask('gaussians'), pool.ask('textureMap')]);
  signal.throwIfAborted();
  stage.setGpu(painter.setPicture(picture, numbers, map) ? painter : null);
}

/** Files that a person gave: a .gip to open, and a picture of another kind, to compare with, or to make one of. */
async function openFiles(files) {
  const heads = await Promise.all(files.map(async (file) => new Uint8Array(await file.slice(0, 8).arrayBuffer())));
  const gip = files.find((_, index) => isGip(heads[index]));
  const other = files.find((_, index) => !isGip(heads[index]));
  if (gip) await open(() => fromFile(gip));
  if (!other) return;
  if (stage.hasPicture && !maker.isOn) await openOriginal(other);
  else await make(other);
}

/** Makes a .gip of a picture. */
async function make(file) {
  message.hidden = true;
  opening.abort();
  close();
  if (!(await maker.take(file))) {
    tell(`${file.name} is neither a .gip file nor a picture that this browser can show.`);
  }
}

/** Puts a picture of another format, or the original, beside the one that was made of it. */
function setRival(bitmap, name, text) {
  comparison.setOriginal(bitmap);
  find('#beside').textContent = name;
  setComparing(bitmap !== null);
  announce(text);
  message.hidden = true;
  if (bitmap) find('#maker [name="size"]').textContent = text;
  else tell(text);
}

async function openOriginal(file) {
  const bitmap = await createImageBitmap(file).catch(() => null);
  if (!bitmap) {
    tell(`${file.name} is neither a .gip file nor a picture that this browser can show.`);
  } else {
    message.hidden = true;
    const { width, height } = stage.view.picture;
    // More than a pixel of rounding.
    if (Math.abs(bitmap.width * height - bitmap.height * width) > Math.max(width, height)) {
      tell(`${file.name} has other proportions than this picture, and is shown stretched.`);
    }
    comparison.setOriginal(bitmap);
    find('#beside').textContent = 'original';
    setComparing(true);
  }
}

function setComparing(isOn) {
  comparison.toggle(isOn);
  stage.draw();
  drawToggles();
  announce(comparison.isOn ? 'The original is on the left of the divider.' : 'The comparison is off.');
}

function setPanel(shown) {
  panel.hidden = !shown;
  drawToggles();
}

/** The states of the buttons that stay pressed. */
function drawToggles() {
  const states = {
    texture: stage.texture,
    outlines: stage.outlines,
    compare: comparison.isOn,
    panel: !panel.hidden,
  };
  for (const [action, isOn] of Object.entries(states)) {
    find(`[data-action="${action}"]`).setAttribute('aria-pressed', isOn);
  }
  find('#legend').hidden = !stage.outlines;
}

const whenOpen = (action) => () => {
  if (stage.hasPicture) action();
};

const actions = {
  open: () => find('#picker').click(),
  sample: () => open((signal) => fromUrl(SAMPLE, signal)),
  zoomIn: whenOpen(() => stage.glide((view) => view.zoomTo(view.scale * 1.5))),
  zoomOut: whenOpen(() => stage.glide((view) => view.zoomTo(view.scale / 1.5))),
  fit: whenOpen(() => stage.glide((view) => view.fit(), 220)),
  actualSize: whenOpen(() => stage.glide((view) => view.zoomTo(1), 220)),
  texture: whenOpen(() => {
    if (textureButton.hidden) return;
    stage.texture = !stage.texture;
    drawToggles();
    announce(stage.texture ? 'Texture is shown.' : 'Texture is left out.');
  }),
  outlines: whenOpen(() => {
    stage.outlines = !stage.outlines;
    drawToggles();
    announce(stage.outlines ? 'Outlines are shown.' : 'Outlines are hidden.');
  }),
  compare: whenOpen(() => {
    if (comparison.hasOriginal) setComparing(!comparison.isOn);
    else tell('Drop the original of this picture on the page, or choose it with Open, to compare both.');
  }),
  panel: whenOpen(() => setPanel(panel.hidden)),
  play: () => scrubber.togglePlay(),
  layerBack: () => scrubber.stepLayers(-1),
  layerForward: () => scrubber.stepLayers(1),
  help: () => find('#help').showModal(),
};

comparison.onArrival = () => stage.draw();
stage.onFrame = ({ scale }) => {
  write(find('#zoom'), zoom(scale));
  write(find('#renderer'), `Rendered by ${stage.renderer}.`);
};

/** Writes a text where it has changed. */
function write(place, text) {
  if (place && place.textContent !== text) place.textContent = text;
}

document.addEventListener('click', ({ target }) => {
  const action = target.closest('[data-action]')?.dataset.action;
  if (action) actions[action]();
});
message.querySelector('button').addEventListener('click', () => {
  message.hidden = true;
});
for (const { label, does } of KEYS) {
  find('#keys').append(element('dt', {}, element('kbd', {}, label)), element('dd', {}, does));
}
// A folder, or a file that has gone, cannot be read.
const onFiles = (files) => void openFiles(files).catch(fail);
listenForFiles({ target: find('#drop-target'), picker: find('#picker'), onFiles });
listenToKeys(stage, actions);
new PointerInput(stageElement, stage);
setPanel(matchMedia('(min-width: 70rem)').matches);

if (parameters.get('src')) open((signal) => fromUrl(parameters.get('src'), signal));
