// Placeholders in `<gip-image>`: the first bytes of the file, in the page.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { placeholder, prefixes } from 'image-gip/prefix';

import { file, harness, script, settled, slow, until, withPage } from './harness.js';
import { makePicture } from './picture.js';

const picture = makePicture({ width: 96, height: 64, layers: [20, 160, 400] });
const [{ end }] = prefixes(picture);
const early = placeholder(picture, end);

/** What the canvas shows. */
const canvasOf = (page) =>
  page.evaluate(() => {
    const canvas = document.querySelector('gip-image').shadowRoot?.querySelector('canvas');
    return canvas && [...canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data];
  });

/** What a decoder makes of the first bytes of the picture. */
const decoded = (page, bytes) =>
  page.evaluate(async (bytes) => {
    const { StreamDecoder } = await import('/dist/index.js');
    const decoder = new StreamDecoder();
    await decoder.feed(new Uint8Array(bytes));
    return [...(await decoder.render()).data];
  }, [...bytes]);

/** Waits until the canvas shows exactly that. */
async function shows(page, bytes) {
  const wanted = JSON.stringify(await decoded(page, bytes));
  await until(async () => JSON.stringify(await canvasOf(page)) === wanted, 'the picture');
}

/** Pages whose element has the placeholder, and a file that waits until the test lets it come. */
function gatedPage({ bytes = picture, attributes = '', text = early, ranges = true, before = '' } = {}, run) {
  let isOpen = false;
  const { route, log } = slow(bytes, { ranges, piece: 4096, interval: 0 });
  harness.routes['/held.gip'] = async (request, response) => {
    await until(() => isOpen, 'the file');
    return route(request, response);
  };
  const html = `${script}${before}<gip-image src="/held.gip" placeholder="${text}" ${attributes}></gip-image><p>text</p>`;
  return withPage(html, (page) => run(page, { log, open: () => (isOpen = true) }));
}

test('the helper gives the first bytes of a file, up to the end of a layer', () => {
  assert.deepEqual(Buffer.from(early, 'base64'), Buffer.from(picture.subarray(0, end)));
  const [, { end: second }] = prefixes(picture);
  assert.equal(Buffer.from(placeholder(picture, second - 1), 'base64').length, end);
  assert.equal(Buffer.from(placeholder(picture, second), 'base64').length, second);
  assert.throws(() => placeholder(picture, end - 1), {
    name: 'RangeError',
    message: `the file up to the first layer has ${end} bytes; maxBytes is ${end - 1}, and must be ${end} at least`,
  });
  assert.throws(() => placeholder(picture, NaN), { name: 'RangeError' });
});

for (const text of [early, `data:image/vnd.gip;base64,${early}`]) {
  test(`it is shown before the file comes, which goes on after it: ${text.slice(0, 12)}`, async () => {
    await gatedPage({ text }, async (page, { log, open }) => {
      const top = () => page.evaluate(() => document.querySelector('p').getBoundingClientRect().top);
      await shows(page, picture.subarray(0, end));
      assert.equal(await page.evaluate(() => document.querySelector('gip-image').complete), false);
      const before = await top();
      open();
      await settled(page);
      await shows(page, picture);
      // The CRC of the layer comes once more, so that another file is noticed; nothing else does.
      assert.deepEqual(log.requests, [`bytes=${end - 4}-`]);
      assert.equal(log.sent, picture.length - end + 4);
      assert.equal(await top(), before, 'nothing moves');
    });
  });
}

test('of a server without ranges, what is here already is not decoded once more', async () => {
  // A decoder of its own for the file would be made by another call.
  const before = `<script>
    globalThis.created = 0;
    const post = Worker.prototype.postMessage;
    Worker.prototype.postMessage = function (message, ...rest) {
      if (message.method === 'create') globalThis.created += 1;
      return post.call(this, message, ...rest);
    };
  </script>`;
  await gatedPage({ ranges: false, before }, async (page, { log, open }) => {
    open();
    await settled(page);
    assert.deepEqual([log.requests.length, log.sent], [1, picture.length]);
    assert.equal(await page.evaluate(() => globalThis.created), 1);
    assert.deepEqual(await canvasOf(page), await decoded(page, picture));
  });
});

for (const ranges of [true, false]) {
  test(`a file with another beginning is loaded whole, ${ranges ? 'with' : 'without'} ranges`, async () => {
    // Its chunks end where those of the other one do.
    const other = makePicture({ width: 96, height: 64, layers: [20, 160, 400], seed: 2 });
    assert.equal(prefixes(other)[0].end, end);
    await gatedPage({ bytes: other, ranges }, async (page, { open }) => {
      await until(async () => (await canvasOf(page)) !== null, 'the placeholder');
      open();
      await settled(page);
      assert.deepEqual(await canvasOf(page), await decoded(page, other));
    });
  });
}

for (const text of ['***', btoa('no picture at all'), btoa('x'), early.slice(0, 24)]) {
  test(`what is no placeholder costs nothing: ${text.slice(0, 12)}`, async () => {
    await gatedPage({ text }, async (page, { open }) => {
      open();
      await settled(page);
      assert.deepEqual(await canvasOf(page), await decoded(page, picture));
    });
  });
}

test('that of a lazy picture far below has its place and a few pixels, and no request before it comes close', async () => {
  const attributes = 'loading="lazy"';
  const before = '<div style="height: 5000px"></div>';
  await gatedPage({ attributes, before }, async (page, { log, open }) => {
    open();
    const width = () => page.evaluate(() => document.querySelector('gip-image').getBoundingClientRect().width);
    await until(async () => (await width()) === 96, 'the size');
    assert.equal(await page.evaluate(() => document.querySelector('gip-image').complete), false);
    // It is printed as this.
    await until(async () => (await canvasOf(page))?.length === 4 * 64 * 43, 'a few pixels');
    assert.ok(new Set(await canvasOf(page)).size > 20);
    assert.equal(log.requests.length, 0);
    await page.evaluate(() => document.querySelector('p').scrollIntoView());
    await settled(page);
    assert.deepEqual(log.requests, [`bytes=${end - 4}-`]);
    assert.deepEqual(await canvasOf(page), await decoded(page, picture));
  });
});

test('for those who want few bytes it is enough, until they click on it', async () => {
  const saving = `<script>
    Object.defineProperty(NetworkInformation.prototype, 'saveData', { get: () => true });
  </script>`;
  await gatedPage({ before: saving }, async (page, { log, open }) => {
    open();
    await until(async () => (await canvasOf(page)) !== null, 'the placeholder');
    await page.evaluate(() => new Promise((resolve) => setTimeout(resolve, 100)));
    const isComplete = () => page.evaluate(() => document.querySelector('gip-image').complete);
    assert.deepEqual([log.requests.length, await isComplete()], [0, false]);
    await page.locator('gip-image').click();
    await settled(page);
    assert.deepEqual([log.requests.length, await page.getAttribute('gip-image', 'detail')], [1, 'full']);
    assert.deepEqual(await canvasOf(page), await decoded(page, picture));
  });
});

test('it shows a picture whose file is missing, as the part of it that there is', async () => {
  const html = `${script}<gip-image src="/nowhere.gip" placeholder="${early}" alt="A mountain"></gip-image>`;
  await withPage(html, async (page) => {
    await settled(page);
    assert.equal(await page.evaluate(() => document.querySelector('gip-image').incomplete), true);
    assert.deepEqual(await canvasOf(page), await decoded(page, picture.subarray(0, end)));
  }, { quiet: true });
});

test('it may be replaced by one of another picture, with its source', async () => {
  harness.routes['/next.gip'] = file(makePicture({ width: 48, height: 64, layers: [20] }));
  await gatedPage({}, async (page, { open }) => {
    open();
    await settled(page);
    await page.evaluate(() => {
      const image = document.querySelector('gip-image');
      image.placeholder = '';
      image.src = '/next.gip';
    });
    await settled(page);
    assert.equal(await page.evaluate(() => document.querySelector('gip-image').naturalWidth), 48);
  });
});

test('source and placeholder are replaced together, in whatever order, with one request', async () => {
  const requests = [];
  harness.routes['/other.gip'] = (request) => void requests.push(request.url);
  const own = makePicture({ width: 48, height: 64, layers: [20] });
  await gatedPage({}, async (page, { open }) => {
    open();
    await settled(page);
    for (const [at, names] of [['src', 'placeholder'], ['placeholder', 'src']].entries()) {
      await page.evaluate(([names, values]) => {
        const image = document.querySelector('gip-image');
        for (const name of names) image[name] = values[name];
        image.crossOrigin = names[0] === 'src' ? 'use-credentials' : 'anonymous';
      }, [names, { src: `/other.gip?${at}`, placeholder: own.toString('base64') }]);
      await shows(page, own);
    }
    await until(() => requests.length >= 2, 'the requests');
    assert.deepEqual(requests, ['/other.gip?0', '/other.gip?1']);
  });
});

test('a small file of its own is shown until the other one shows more', async () => {
  const own = makePicture({ width: 96, height: 64, layers: [30], seed: 3 });
  let allowed = 0;
  const { route, log } = slow(picture, { piece: 500, gate: (sent) => until(() => sent < allowed, 'the next piece') });
  harness.routes['/whole.gip'] = route;
  const watch = `<script>
    globalThis.loads = 0;
    document.addEventListener('load', ({ target }) => { globalThis.loads += target.localName === 'gip-image'; }, true);
  </script>`;
  const html = `${watch}${script}<gip-image src="/whole.gip" placeholder="${own.toString('base64')}"></gip-image>`;
  await withPage(html, async (page) => {
    await shows(page, own);
    // The first layer of the file has less than that.
    allowed = prefixes(picture)[1].end - 1000;
    await until(() => log.sent >= allowed, 'the first layer');
    await new Promise((resolve) => setTimeout(resolve, 100));
    await shows(page, own);
    assert.equal(await page.evaluate(() => document.querySelector('gip-image').complete), false);
    allowed = Infinity;
    await shows(page, picture);
    await settled(page);
    assert.deepEqual(log.requests, [null]);
    assert.equal(await page.evaluate(() => globalThis.loads), 1);
  });
});

test('with a small file of its own a picture whose file is missing is that', async () => {
  const own = makePicture({ width: 96, height: 64, layers: [30], seed: 3 });
  const html = `${script}<gip-image src="/nowhere.gip" placeholder="${own.toString('base64')}"></gip-image>`;
  await withPage(html, async (page) => {
    await settled(page);
    assert.equal(await page.evaluate(() => document.querySelector('gip-image').incomplete), true);
    await shows(page, own);
  }, { quiet: true });
});
