// Measures the frames of the viewer in headless Chromium, without a GPU:
//
//     node benchmarks/frames.js PICTURE.gip
//
// The window has 1280 x 800 pixels. Movements are those of a mouse, one step per frame.

import { readFile } from 'node:fs/promises';

import { drop, openViewer, settled, start } from '../tests/viewer.js';

const ROUNDS = 3;
const SECONDS = 3;
const [file] = process.argv.slice(2);
if (!file) throw new Error('usage: node benchmarks/frames.js PICTURE.gip');

/** In the page: drags the picture around for some seconds, and returns when frames came. */
async function drag({ seconds, speed }) {
  const stage = document.querySelector('#stage');
  const { left, top, width, height } = stage.getBoundingClientRect();
  const [cx, cy] = [left + width / 2, top + height / 2];
  const send = (type, clientX, clientY) =>
    stage.dispatchEvent(new PointerEvent(type, { pointerId: 1, isPrimary: true, clientX, clientY, bubbles: true }));
  // There is no such pointer to capture.
  stage.setPointerCapture = () => {};
  const times = [];
  const start = performance.now();
  let [x, y] = [cx, cy];
  send('pointerdown', x, y);
  for (;;) {
    const now = await new Promise(requestAnimationFrame);
    times.push(now);
    const time = (now - start) / 1000;
    if (time > seconds) break;
    // A spiral that does not repeat, at an even speed.
    const step = times.length > 1 ? ((now - times.at(-2)) / 1000) * speed : 0;
    const angle = time * 2.1 + Math.sin(time * 0.7);
    x += step * Math.cos(angle);
    y += step * Math.sin(angle);
    send('pointermove', x, y);
  }
  send('pointerup', x, y);
  return times;
}

/** In the page: shows more of the file in each frame. */
async function scrub({ seconds }) {
  const slider = document.querySelector('#scrubber');
  const times = [];
  const start = performance.now();
  for (;;) {
    const now = await new Promise(requestAnimationFrame);
    times.push(now);
    const share = (now - start) / 1000 / seconds;
    if (share > 1) return times;
    slider.value = share * slider.max;
    slider.dispatchEvent(new Event('input'));
  }
}

/** In the page: zooms in smoothly by the wheel. */
async function zoom({ seconds }) {
  const stage = document.querySelector('#stage');
  const { left, top, width, height } = stage.getBoundingClientRect();
  const at = { clientX: left + width * 0.6, clientY: top + height * 0.4, bubbles: true, cancelable: true };
  const times = [];
  const start = performance.now();
  for (;;) {
    const now = await new Promise(requestAnimationFrame);
    times.push(now);
    if (now - start > seconds * 1000) return times;
    stage.dispatchEvent(new WheelEvent('wheel', { deltaY: -8, ...at }));
  }
}

const intervals = (times) => times.slice(1).map((time, index) => time - times[index]);

/** The q-quantile of sorted numbers. */
const quantile = (sorted, q) => sorted[Math.min(sorted.length - 1, Math.floor(q * sorted.length))];

function summary(unsorted) {
  const frames = unsorted.toSorted((a, b) => a - b);
  const perSecond = (1000 * frames.length) / frames.reduce((sum, time) => sum + time, 0);
  const inTime = (100 * frames.filter((time) => time < 25).length) / frames.length;
  const columns = [perSecond, quantile(frames, 0.5), quantile(frames, 0.95), quantile(frames, 0.99), inTime];
  return columns.map((value) => value.toFixed(1).padStart(8)).join('');
}

/** Measures everything once: frame intervals by name, and how long it took to be sharp. */
async function round(page, frames, sharp) {
  const measure = async (name, run, options = {}) => {
    const times = await page.evaluate(run, { seconds: SECONDS, ...options });
    (frames[name] ??= []).push(...intervals(times));
    await settled(page);
  };
  const press = async (...keys) => {
    const start = performance.now();
    for (const key of keys) await page.keyboard.press(key);
    await settled(page);
    sharp.push(performance.now() - start);
  };
  // What the browser manages when nothing moves.
  await measure('at rest', drag, { speed: 0 });
  await press('1');
  await measure('pan, 100 %', drag, { speed: 800 });
  await press('+', '+', '+', '+');
  await measure('pan, 506 %', drag, { speed: 800 });
  await page.keyboard.press('o');
  await settled(page);
  await measure('pan with outlines', drag, { speed: 800 });
  await page.keyboard.press('o');
  await press('0');
  await measure('zoom', zoom);
  await press('0');
  await measure('scrub', scrub);
}

const viewer = await start();
try {
  const { page } = await openViewer(viewer);
  await drop(page, { name: 'picture.gip', bytes: await readFile(file) });
  await settled(page);
  console.log((await page.locator('#panel .facts').first().innerText()).replaceAll('\n', ' '));
  console.log(await page.locator('#renderer').textContent());
  // The picture takes the whole width.
  await page.keyboard.press('i');
  const [frames, sharp] = [{}, []];
  for (let number = 0; number < ROUNDS; number += 1) await round(page, frames, sharp);
  console.log('frames, intervals in ms  per s  median    95 %    99 %  % < 25 ms');
  for (const [name, times] of Object.entries(frames)) console.log(name.padEnd(22), summary(times));
  const times = sharp.toSorted((a, b) => a - b);
  const [least, median, most] = [0, 0.5, 1].map((q) => quantile(times, q).toFixed(0));
  console.log(`sharp after a change of scale: ${median} ms (${least} to ${most})`);
} finally {
  await viewer.stop();
}
