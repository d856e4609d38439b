// Many elements, and pages with rules.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { file, harness, script, settled, until, withPage } from './harness.js';
import { makePicture } from './picture.js';
import { swappedProfile } from './profile.js';

const picture = makePicture({ width: 96, height: 64, layers: [40, 160] });

test('fifty elements on a page, and lazy ones far below', async () => {
  let requests = 0;
  harness.routes['/many.gip'] = (request, response) => {
    requests += 1;
    file(picture)(request, response);
  };
  const many = (count, attributes) =>
    Array.from({ length: count }, (_, n) => `<gip-image src="/many.gip?${n}" ${attributes}></gip-image>`).join('');
  const html = `${script}${many(50, '')}<div style="height: 5000px"></div>${many(5, 'loading="lazy"')}`;
  await withPage(html, async (page) => {
    await page.evaluate(async () => {
      await customElements.whenDefined('gip-image');
      await Promise.all([...document.querySelectorAll('gip-image:not([loading])')].map((image) => image.decode()));
    });
    /** How many have a canvas of so many columns: 96 with all pixels, 64 far from the screen. */
    const drawn = (width) => page.evaluate((width) => {
      const canvases = [...document.querySelectorAll('gip-image')].map(({ shadowRoot }) => shadowRoot.querySelector('canvas'));
      return canvases.filter((canvas) => canvas?.width === width).length;
    }, width);
    assert.equal(requests, 50);
    await until(async () => (await drawn(96)) === 50, 'fifty pictures');
    await page.evaluate(() => scrollTo(0, document.body.scrollHeight));
    await until(() => requests === 55, 'the lazy ones');
    // Those far above have freed their pixels, but a few that are printed.
    await until(async () => (await drawn(96)) === 5 && (await drawn(64)) === 50, 'five pictures');
    await page.evaluate(() => scrollTo(0, 0));
    await until(async () => (await drawn(96)) >= 50, 'fifty pictures again');
    assert.equal(requests, 55);
  });
});

test('memory after 200 loads', async () => {
  // Three that are kept by mistake would take a megabyte.
  harness.routes['/again.gip'] = file(makePicture({ layers: [1000, 4000] }));
  const headers = {
    'Cross-Origin-Opener-Policy': 'same-origin',
    'Cross-Origin-Embedder-Policy': 'require-corp',
  };
  await withPage(`${script}<gip-image></gip-image>`, async (page) => {
    const load = (count) => page.evaluate(async (count) => {
      await customElements.whenDefined('gip-image');
      const { open, decode } = await import('/dist/index.js');
      for (let n = 0; n < count; n += 1) {
        const image = document.querySelector('gip-image');
        image.src = `/again.gip?${n}`;
        await image.decode();
        await decode('/again.gip', { width: 200 });
        await open('/again.gip'); // and forgotten
        const next = document.createElement('gip-image');
        image.replaceWith(next);
      }
    }, count);
    const client = await page.context().newCDPSession(page);
    const memory = async () => {
      await client.send('HeapProfiler.collectGarbage');
      const { bytes } = await page.evaluate(() => performance.measureUserAgentSpecificMemory());
      const sizes = page.workers().map((worker) =>
        worker.evaluate(async (script) => (await import(script)).memorySize(),
          `${harness.server.origin}/dist/core.js`));
      const decoders = (await Promise.all(sizes)).reduce((sum, size) => sum + size, 0);
      return { bytes, decoders };
    };
    await load(30);
    const before = await memory();
    await load(200);
    const after = await memory();
    // What was forgotten waits for the collector. All 600 of them would take 100 MB.
    assert.ok(before.decoders > 1e6, `${before.decoders} bytes`);
    const decoders = after.decoders - before.decoders;
    assert.ok(decoders < 12e6, `from ${before.decoders} to ${after.decoders} bytes`);
    // Some versions of Chromium count the memory of WebAssembly as well.
    const scripts = after.bytes - before.bytes - Math.max(0, decoders);
    assert.ok(scripts < 2e6, `from ${before.bytes} to ${after.bytes} bytes`);
  }, { headers });
});

test('a strict content security policy, for files and for what bundlers take', async () => {
  harness.routes['/csp.gip'] = file(picture);
  const policy = (worker) =>
    `default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; connect-src 'self'; worker-src ${worker}`;
  const embedded = script.replace('/dist/', '/dist/embedded/');
  for (const [html, worker, workers] of [
    [script, "'self'", 1],
    [script, "'none'", 0],
    [embedded, 'blob:', 1],
    [embedded, "'self'", 0],
  ]) {
    const headers = { 'Content-Security-Policy': policy(worker) };
    await withPage(`${html}<gip-image src="/csp.gip"></gip-image>`, async (page) => {
      await settled(page);
      await until(() => page.locator('gip-image canvas').count(), `a picture with worker-src ${worker}`);
      assert.equal(page.workers().length, workers, worker);
    }, { headers, quiet: true });
  }
});

test('the script may come from another server', async () => {
  harness.routes['/elsewhere.gip'] = file(picture);
  const other = harness.server.origin.replace('127.0.0.1', 'localhost');
  const html = `<script type="module" src="${other}/dist/gip-image.js"></script>
    <gip-image src="/elsewhere.gip"></gip-image>`;
  await withPage(html, async (page) => {
    await settled(page);
    await until(() => page.locator('gip-image canvas').count(), 'a picture');
    assert.equal(page.workers().length, 1);
  }, { quiet: true });
});

test('an ICC profile is applied', async () => {
  // It takes red for green, and the other way round.
  harness.routes['/plain.gip'] = file(picture);
  harness.routes['/profile.gip'] = file(
    makePicture({ width: 96, height: 64, layers: [40, 160], chunks: [['iCCP', swappedProfile()]] }),
  );
  const colors = async (src) =>
    withPage(`${script}<gip-image src="${src}"></gip-image>`, async (page) => {
      await settled(page);
      return page.evaluate(() => {
        const canvas = document.querySelector('gip-image').shadowRoot.querySelector('canvas');
        const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
        return [...data];
      });
    });
  const [plain, managed] = [await colors('/plain.gip'), await colors('/profile.gip')];
  let [same, swapped] = [0, 0];
  for (let at = 0; at < plain.length; at += 4) {
    same += Math.abs(plain[at] - managed[at]) + Math.abs(plain[at + 1] - managed[at + 1]);
    swapped += Math.abs(plain[at] - managed[at + 1]) + Math.abs(plain[at + 1] - managed[at]);
  }
  const samples = plain.length / 2;
  assert.ok(swapped / samples < 1.5, `${swapped / samples} from what is expected`);
  assert.ok(same / samples > 5, 'the profile changes the picture');
});
