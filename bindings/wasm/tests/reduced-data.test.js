// What is loaded for those who want few bytes.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { placeholder } from 'image-gip/prefix';

import { file, harness, script, settled, slow, until, withPage } from './harness.js';
import { makePicture } from './picture.js';

const large = makePicture({ width: 600, height: 400, layers: [400, 1600, 4000, 6000] });
const saving = `<script>
  Object.defineProperty(NetworkInformation.prototype, 'saveData', { get: () => true });
</script>`;

test('the first layers are loaded, and the rest when it is asked for', async () => {
  const { route, log } = slow(large, { piece: 4096, interval: 15 });
  harness.routes['/large.gip'] = route;
  const element = '<gip-image src="/large.gip"></gip-image>';
  await withPage(saving + script + element, async (page) => {
    await settled(page);
    await until(() => log.open === 0, 'the end of the transfer');
    const few = log.sent;
    assert.ok(few >= large.length / 6 && few < large.length / 2, `${few} of ${large.length} bytes`);
    const shown = () => page.evaluate(() => {
      const element = document.querySelector('gip-image');
      const { width } = element.shadowRoot.querySelector('canvas');
      return [width, element.detail, element.complete, element.incomplete];
    });
    assert.deepEqual(await shown(), [600, 'auto', true, false]);
    await page.evaluate(() => (document.querySelector('gip-image').detail = 'full'));
    await until(() => log.requests.length === 2 && log.open === 0, 'the rest');
    assert.ok(log.sent >= large.length, `${log.sent} of ${large.length} bytes`);
    assert.deepEqual(await shown(), [600, 'full', true, false]);
  });
});

test('what is far from the screen is not fetched, unless the page says so', async () => {
  const seen = [];
  for (const name of ['near', 'far', 'full']) {
    harness.routes[`/${name}.gip`] = (request, response) => {
      seen.push(name);
      file(large)(request, response);
    };
  }
  const element = (name, more = '') => `<gip-image src="/${name}.gip" width="60" height="40" ${more}></gip-image>`;
  const html = `${element('near')}<div style="height: 8000px"></div>${element('far')}${element('full', 'detail="full"')}`;
  await withPage(saving + script + html, async (page) => {
    await page.evaluate(async () => {
      await customElements.whenDefined('gip-image');
      await Promise.all(['near', 'full'].map((name) => document.querySelector(`[src="/${name}.gip"]`).decode()));
    });
    assert.deepEqual(seen.sort(), ['full', 'near']);
    await page.evaluate(() => document.querySelector('[src="/far.gip"]').scrollIntoView());
    await until(() => seen.includes('far'), 'the request');
  });
});

test('with a placeholder nothing is fetched before somebody clicks on it', async () => {
  const { route, log } = slow(large);
  harness.routes['/clicked.gip'] = route;
  const text = placeholder(large, 20_000);
  await withPage(`${saving}${script}<gip-image src="/clicked.gip" placeholder="${text}"></gip-image>`, async (page) => {
    await page.locator('gip-image canvas').waitFor();
    await page.evaluate(() => new Promise((resolve) => setTimeout(resolve, 200)));
    assert.deepEqual([log.requests.length, await page.evaluate(() => document.querySelector('gip-image').complete)], [0, false]);
    await page.locator('gip-image').click();
    await settled(page);
    assert.ok(log.sent > large.length / 2, `${log.sent} of ${large.length} bytes`);
    assert.equal(await page.getAttribute('gip-image', 'detail'), 'full');
  });
});
