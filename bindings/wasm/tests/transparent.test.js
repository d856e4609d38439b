// `.gip` wherever a browser shows a picture, by a service worker.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';

import { file, harness, until, withPage } from './harness.js';
import { makePicture } from './picture.js';

const picture = makePicture({ width: 96, height: 64, layers: [40, 160] });
const gif = Buffer.from('R0lGODlhAQABAIAAAP///wAAACH5BAAAAAAALAAAAAABAAEAAAICRAEAOw==', 'base64');
harness.routes['/photo.gip'] = file(picture);
harness.routes['/part.gip'] = file(picture.subarray(0, picture.length / 2));
harness.routes['/other.gip'] = (_, response) => response.writeHead(200, { 'Content-Type': 'image/gif' }).end(gif);
harness.routes['/style.css'] = (_, response) =>
  response.writeHead(200, { 'Content-Type': 'text/css' }).end('p { width: 96px; height: 64px; background: url(/photo.gip) }');
// At the root of the site, so that it is for all pages.
harness.routes['/service-worker.js'] = (_, response) => {
  const script = readFileSync(new URL('../dist/service-worker.js', import.meta.url));
  response.writeHead(200, { 'Content-Type': 'text/javascript' }).end(script);
};

const html = `<link rel="stylesheet" href="/style.css">
  <img src="/photo.gip" alt="">
  <picture><source srcset="/photo.gip" type="image/png"><img src="/missing.png" alt=""></picture>
  <img src="/part.gip" alt=""><img src="/other.gip" alt=""><p></p>
  <style>.box { width: 96px; height: 64px; display: block }</style><style id="by-script"></style>
  <div class="box" id="inline" style="background: url('/photo.gip')"></div><div class="box" id="rule"></div>
  <div class="box" id="variable" style="--picture: url(/photo.gip)"></div><div class="box" id="adopted"></div>
  <svg class="box"><image href="/photo.gip" width="96" height="64" /></svg>
  <video class="box" poster="/photo.gip"></video><div class="box" id="shadow"></div>
  <script>
    // As libraries do: these rules are in no text.
    const { sheet } = document.querySelector('#by-script');
    sheet.insertRule('#rule { background: url(/photo.gip) }');
    sheet.insertRule('#variable { background: var(--picture) }');
    sheet.insertRule('b { order: 7 }');
    const adopted = new CSSStyleSheet();
    adopted.replaceSync('@media screen { #adopted { background: url("/photo.gip") } }');
    document.adoptedStyleSheets = [adopted];
    const root = document.querySelector('#shadow').attachShadow({ mode: 'open' });
    root.innerHTML = '<img src="/photo.gip" alt="" style="display: block">';
  </script>`;
const others = ['p', '#inline', '#rule', '#variable', '#adopted', 'svg', 'video', '#shadow'];

test('images, sources and backgrounds are shown, on the first visit and on later ones', async () => {
  await withPage(html, async (page) => {
    const widths = () => page.evaluate(() => [...document.images].map(({ naturalWidth }) => naturalWidth));
    /** The means of what is on the screen where the first image is, and the others. */
    const colors = async () => {
      const means = [];
      for (const selector of ['img', ...others]) {
        const shot = (await page.locator(selector).first().screenshot()).toString('base64');
        means.push(await page.evaluate(async (shot) => {
          const bitmap = await createImageBitmap(await (await fetch(`data:image/png;base64,${shot}`)).blob());
          const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
          context.drawImage(bitmap, 0, 0);
          const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);
          return data.reduce((sum, value) => sum + value, 0) / data.length;
        }, shot));
      }
      return means;
    };
    const isShown = async () => {
      if (JSON.stringify(await widths()) !== '[96,96,96,1]') return false;
      const [image, ...means] = await colors();
      return means.every((mean) => Math.abs(image - mean) < 0.5);
    };
    /** What scripts have put into style sheets is theirs. */
    const keepsRules = () => page.evaluate(() => document.querySelector('#by-script').sheet.cssRules[0].style.order === '7');
    assert.equal((await widths())[0], 0);
    await page.evaluate(async () => {
      const { install } = await import('/dist/transparent.js');
      await install();
    });
    await until(isShown, 'all pictures');
    assert.ok(await keepsRules());
    await page.reload();
    await until(isShown, 'all pictures on the next visit');
    const session = await page.context().newCDPSession(page);
    await session.send('Page.reload', { ignoreCache: true });
    await page.waitForFunction(() => navigator.serviceWorker.controller === null && document.readyState === 'complete');
    await page.evaluate(async () => {
      const { install } = await import('/dist/transparent.js');
      await install();
    });
    await until(isShown, 'all pictures of a page that was loaded without the cache');
    // Scripts get the file itself.
    const size = await page.evaluate(async () => (await (await fetch('/photo.gip')).arrayBuffer()).byteLength);
    assert.equal(size, picture.length);
  }, { quiet: true });
});

test('a service worker that is for other pages is told', async () => {
  await withPage('', async (page) => {
    const message = await page.evaluate(async () => {
      const { install } = await import('/dist/transparent.js');
      return install('/dist/service-worker.js').then(() => null, ({ message }) => message);
    });
    assert.match(message, /is for http.*\/dist\/, and not for this page/);
  });
});
