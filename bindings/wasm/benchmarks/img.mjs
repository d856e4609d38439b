// What it costs to hand pictures over to `<img>`. Not a test: prints a table.
//
//     npm run build && node benchmarks/img.mjs [FILE]
//
// The file, by default the viewer's sample, is shown in some widths in Chromium, seven times each. The time is that from the
// event `load` of the element to the image in place of its canvas, and `frame` the longest between two frames of the page
// meanwhile. The bytes are those of the PNG file that the browser keeps; the decoded image takes what the canvas took.

import { readFileSync } from 'node:fs';

import { launch } from '../tests/browser.js';
import { serve } from '../tests/server.js';

const path = process.argv[2] ?? new URL('../../../web/sample/sumac.gip', import.meta.url);
const html = ['gip-image', 'img'].map((name) => `<script type="module" src="/dist/${name}.js"></script>`).join('');
const server = await serve({
  '/page': (_, response) => response.writeHead(200, { 'Content-Type': 'text/html' }).end(`<!doctype html>${html}`),
  '/picture.gip': (_, response) => response.writeHead(200, { 'Content-Type': 'image/vnd.gip' }).end(readFileSync(path)),
});
const browser = await launch();

/** Shows the picture once in a width. */
const show = async (width) => {
  const image = document.createElement('gip-image');
  image.style.width = `${width}px`;
  image.src = '/picture.gip';
  document.body.replaceChildren(image);
  await new Promise((resolve) => image.addEventListener('load', resolve, { once: true }));
  const start = performance.now();
  let [last, busy, isOver] = [start, 0, false];
  const onFrame = (now) => {
    [last, busy] = [now, Math.max(busy, now - last)];
    if (!isOver) requestAnimationFrame(onFrame);
  };
  requestAnimationFrame(onFrame);
  const found = () => image.shadowRoot.querySelector('img');
  await new Promise((resolve) => {
    if (found()) resolve();
    new MutationObserver(() => found() && resolve()).observe(image.shadowRoot, { subtree: true, childList: true });
  });
  const time = performance.now() - start;
  isOver = true;
  const { size } = await (await fetch(found().src)).blob();
  return { time, busy, size, pixels: found().naturalWidth * found().naturalHeight };
};

const median = (values) => values.sort((a, b) => a - b)[values.length >> 1];
console.log('width  megapixels  time, ms  frame, ms  bytes per pixel');
for (const width of [480, 960, 1920]) {
  const page = await browser.newPage({ viewport: { width: 2000, height: 1500 } });
  await page.goto(`${server.origin}/page`);
  await page.evaluate(() => customElements.whenDefined('gip-image'));
  const runs = [];
  for (let run = 0; run < 7; run += 1) runs.push(await page.evaluate(show, width));
  const [{ size, pixels }] = runs;
  const cells = [
    String(width).padStart(5),
    (pixels / 1e6).toFixed(2).padStart(10),
    median(runs.map(({ time }) => time)).toFixed(0).padStart(8),
    median(runs.map(({ busy }) => busy)).toFixed(0).padStart(9),
    (size / pixels).toFixed(2).padStart(15),
  ];
  console.log(cells.join('  '));
  await page.close();
}
await browser.close();
await server.close();
