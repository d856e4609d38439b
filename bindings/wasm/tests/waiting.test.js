// What tells that a picture is there: `load`, `complete` and `decode()`, as those of `<img>` do.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { file, harness, script, settled, until, withPage } from './harness.js';
import { makePicture } from './picture.js';

const picture = makePicture({ width: 96, height: 64, layers: [40, 160, 400] });
harness.routes['/picture.gip'] = file(picture);

/** Holds the answers to questions for the number of Gaussians back, until `release()`. */
const heldBack = `<script>
  const { postMessage } = Worker.prototype;
  const held = new Promise((resolve) => { globalThis.release = resolve; });
  Worker.prototype.postMessage = function (message, ...rest) {
    const send = () => postMessage.call(this, message, ...rest);
    if (message.method === 'gaussiansFor') void held.then(send);
    else send();
  };
</script>`;

test('load waits for pixels, however late it is known how many Gaussians they need', async () => {
  let open = false;
  harness.routes['/gated.gip'] = async (_, response) => {
    response.writeHead(200, { 'Content-Length': picture.length });
    // The signature, the header, and the letter of the first layer.
    const first = 8 + 2 + picture[9] + 4 + 1;
    response.write(picture.subarray(0, first));
    await until(() => open, 'the rest');
    response.end(picture.subarray(first));
  };
  const watch = `<script>
    const seen = () => {
      const image = document.querySelector('gip-image');
      return [image.complete, !!image.shadowRoot.querySelector('canvas')];
    };
    document.addEventListener('load', (event) => {
      if (event.target.localName === 'gip-image') globalThis.atLoad = seen();
    }, true);
  </script>`;
  const html = `${heldBack}${watch}${script}<gip-image src="/gated.gip"></gip-image>`;
  await withPage(html, async (page) => {
    await until(() => page.evaluate(() => document.querySelector('gip-image').clientWidth === 96), 'the size');
    const early = await page.evaluate(async () => {
      document.querySelector('gip-image').decode().then(() => (globalThis.decoded = seen()));
      for (let frames = 0; frames < 5; frames += 1) await new Promise(requestAnimationFrame);
      return [seen(), globalThis.atLoad ?? null, globalThis.decoded ?? null];
    });
    assert.deepEqual(early, [[false, false], null, null]);
    await page.evaluate(() => globalThis.release());
    open = true;
    await settled(page);
    const late = await page.evaluate(() => [globalThis.atLoad, globalThis.decoded]);
    assert.deepEqual(late, [[true, true], [true, true]]);
  });
});

test('decode() settles in every case, as that of <img>', async () => {
  // It answers when the page is closed.
  harness.routes['/never.gip'] = () => {};
  harness.routes['/broken.gip'] = file(Buffer.from('<!doctype html>'));
  await withPage(script, async (page) => {
    const outcomes = await page.evaluate(async () => {
      await customElements.whenDefined('gip-image');
      const outcome = (promise) =>
        promise.then(
          () => 'resolved',
          (error) => `${error.name}${error.cause ? `, ${error.cause.name}` : ''}`,
        );
      /** An element, and what becomes of `decode` after something happens to it. */
      const after = async (src, happens, inPage = true) => {
        const image = document.createElement('gip-image');
        if (src !== null) image.setAttribute('src', src);
        if (inPage) document.body.append(image);
        const decoded = outcome(image.decode());
        await happens?.(image);
        const result = [await decoded, image.complete];
        image.remove();
        return result;
      };
      return {
        none: await after(null),
        detachedNone: await after(null, null, false),
        empty: await after('', null),
        broken: await after('/broken.gip', null),
        shown: await after('/picture.gip', null),
        detached: await after('/picture.gip', null, false),
        detachedBroken: await after('/broken.gip', null, false),
        inserted: await after('/picture.gip', (image) => document.body.append(image), false),
        lazy: await after('/picture.gip', (image) => (image.loading = 'lazy'), false),
        removed: await after('/never.gip', (image) => image.remove()),
        sourceRemoved: await after('/never.gip', (image) => image.removeAttribute('src')),
        changed: await after('/never.gip', (image) => (image.src = '/picture.gip')),
        detachedChanged: await after('/never.gip', (image) => (image.src = '/picture.gip'), false),
        again: await after('/never.gip', async (image) => {
          image.src = '/picture.gip';
          await image.decode();
        }),
      };
    });
    const changed = ['EncodingError', false];
    assert.deepEqual(outcomes, {
      none: ['EncodingError', true],
      detachedNone: ['EncodingError', true],
      empty: ['EncodingError, TypeError', true],
      broken: ['EncodingError, SignatureError', true],
      shown: ['resolved', true],
      detached: ['resolved', true],
      detachedBroken: ['EncodingError, SignatureError', true],
      inserted: ['resolved', true],
      lazy: ['resolved', true],
      removed: changed,
      sourceRemoved: ['EncodingError', true],
      changed,
      detachedChanged: changed,
      again: ['EncodingError', true],
    });
  });
});

test('what was decoded outside of the page is not fetched again in it', async () => {
  let requests = 0;
  harness.routes['/once.gip'] = (request, response) => {
    requests += 1;
    file(picture)(request, response);
  };
  await withPage(script, async (page) => {
    const natural = await page.evaluate(async () => {
      await customElements.whenDefined('gip-image');
      const image = document.createElement('gip-image');
      image.src = '/once.gip';
      await image.decode();
      document.body.append(image);
      return [image.naturalWidth, image.complete];
    });
    assert.deepEqual(natural, [96, true]);
    const width = () => page.evaluate(() => document.querySelector('gip-image').shadowRoot.querySelector('canvas')?.width);
    await until(async () => (await width()) === 96, 'the picture');
    assert.equal(requests, 1);
  });
});
