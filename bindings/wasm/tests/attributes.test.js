// The attributes that say how the file is fetched: the same keywords as those of `<img>`, in any case.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { file, harness, script, withPage } from './harness.js';
import { makePicture } from './picture.js';
import { serve } from './server.js';

const picture = makePicture({ width: 96, height: 64, layers: [40] });
harness.routes['/picture.gip'] = file(picture);

const values = {
  crossorigin: ['anonymous', '', 'bogus', 'use-credentials', 'USE-CREDENTIALS'],
  fetchpriority: ['high', 'HIGH', 'Low', 'auto', '', 'bogus'],
  referrerpolicy: ['no-referrer', 'NO-REFERRER', 'Origin', 'unsafe-url', '', ' origin', 'bogus'],
  loading: ['lazy', 'LAZY', 'eager', '', 'bogus'],
};
const properties = {
  crossorigin: 'crossOrigin',
  fetchpriority: 'fetchPriority',
  referrerpolicy: 'referrerPolicy',
  loading: 'loading',
};

test('enumerated attributes mean what they mean for <img>', async () => {
  await withPage(script, async (page) => {
    const differences = await page.evaluate(async ([values, properties]) => {
      await customElements.whenDefined('gip-image');
      const wrong = [];
      for (const [attribute, all] of Object.entries(values)) {
        for (const value of [null, ...all]) {
          const both = ['img', 'gip-image'].map((name) => {
            const element = document.createElement(name);
            if (value !== null) element.setAttribute(attribute, value);
            return element;
          });
          // The one is the older name of the other.
          const [img, gip] = both.map((element) => element[properties[attribute]]?.replace('eager', 'auto'));
          if (img !== gip) wrong.push([attribute, value, img, gip]);
          both[1].src = '/picture.gip';
          await both[1].decode().catch((error) => wrong.push([attribute, value, error.message]));
        }
      }
      // What frameworks do when an attribute goes.
      const image = document.createElement('gip-image');
      for (const property of [...Object.values(properties), 'src', 'alt', 'width', 'height', 'placeholder', 'texture', 'detail']) {
        for (const nothing of [null, undefined]) {
          image[property] = '1';
          image[property] = nothing;
        }
      }
      return [wrong, image.getAttributeNames()];
    }, [values, properties]);
    assert.deepEqual(differences, [[], []]);
  });
});

test('cookies go to another origin, and the referrer to a server, as the attributes say', async () => {
  const seen = [];
  const other = await serve({
    '/picture.gip': ({ headers }, response) => {
      seen.push([headers.cookie ?? null, headers.referer ?? null]);
      file(picture, {
        'Access-Control-Allow-Origin': harness.server.origin,
        'Access-Control-Allow-Credentials': 'true',
        'Cache-Control': 'no-store',
      })(null, response);
    },
  });
  try {
    await withPage(script, async (page) => {
      await page.context().addCookies([{ name: 'key', value: 'value', url: other.origin }]);
      await page.evaluate(async (src) => {
        await customElements.whenDefined('gip-image');
        const image = document.createElement('gip-image');
        image.src = src;
        for (const [crossorigin, referrerpolicy] of [
          ['anonymous', ''],
          ['use-credentials', ''],
          ['USE-CREDENTIALS', 'No-Referrer'],
        ]) {
          image.setAttribute('crossorigin', crossorigin);
          image.setAttribute('referrerpolicy', referrerpolicy);
          await image.decode();
        }
      }, `${other.origin}/picture.gip`);
    });
  } finally {
    await other.close();
  }
  const referrer = `${harness.server.origin}/`;
  assert.deepEqual(seen, [
    [null, referrer],
    ['key=value', referrer],
    ['key=value', null],
  ]);
});
