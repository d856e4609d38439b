// Measures the frames of the viewer in headless Chromium, without a GPU:
//
//     node benchmarks/frames.js PICTURE.gip
//
// The window has 1280 x 800 pixels. Movements are those of a mouse, one step per frame.

import { readFile } from 'node:fs/promises';

import { drop, openViewer, settled, start } from '../tests/viewer.js';

const SECONDS = 5;
const [file] = process.argv.slice(2);
if (!file) throw new Error('usage: node benchmarks/frames.js PICTURE.gip');

/** In the page: drags the picture around for some seconds, and returns when frames came. */
async function drag({ seconds, speed }) {
  const stage = document.querySelector('#stage');
  const { left, top, width, height } = stage.getBoundingClientRect();
  const [cx, cy] = [left + width / 2, top + height / 2];
  const send = (type, x, y) =>
    stage.dispatchEvent(new PointerEvent(type, { pointerId: 1, isPrimary: true, clientX: x, clientY: y, bubbles: true }));
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

function summary(times) {
  const frames = times.slice(1).map((time, index) => time - times[index]).sort((a, b) => a - b);
  const at = (share) => frames[Math.min(frames.length - 1, Math.floor(share * frames.length))];
  const perSecond = (1000 * frames.length) / frames.reduce((sum, time) => sum + time, 0);
  const inTime = frames.filter((time) => time < 25).length / frames.length;
  const ms = (value) => value.toFixed(1).padStart(6);
  return `${perSecond.toFixed(1).padStart(6)} ${ms(at(0.5))} ${ms(at(0.95))} ${ms(at(0.99))} ${(100 * inTime).toFixed(1).padStart(7)} %`;
}

const viewer = await start();
try {
  const { page } = await openViewer(viewer);
  await drop(page, { name: 'picture.gip', bytes: await readFile(file) });
  await settled(page);
  console.log((await page.locator('#panel .facts').first().innerText()).replaceAll('\n', ' '));
  console.log(await page.locator('#renderer').textContent());
  console.log('                        per s   median   95 %   99 %   < 25 ms');
  const measure = async (name, run, options = {}) => {
    const times = await page.evaluate(run, { seconds: SECONDS, ...options });
    console.log(name.padEnd(21), summary(times));
    await settled(page);
  };
  /** Presses keys, and returns how many milliseconds it took until the picture was sharp again. */
  const press = async (...keys) => {
    const start = performance.now();
    for (const key of keys) await page.keyboard.press(key);
    await settled(page);
    return performance.now() - start;
  };
  await press('i');
  // What the browser manages when nothing moves.
  await measure('at rest', drag, { speed: 0 });
  const sharp = [await press('1')];
  await measure('pan, 100 %', drag, { speed: 800 });
  sharp.push(await press('+', '+', '+', '+'));
  await measure('pan, 506 %', drag, { speed: 800 });
  await press('o');
  await measure('pan with outlines', drag, { speed: 800 });
  sharp.push(await press('o', '0'));
  await measure('zoom', zoom);
  await press('0');
  await measure('scrub', scrub);
  console.log(`sharp after a change of scale: ${sharp.map((time) => `${time.toFixed(0)} ms`).join(', ')}`);
} finally {
  await viewer.stop();
}
