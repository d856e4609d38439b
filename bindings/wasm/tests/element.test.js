// `<gip-image>` while it loads.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { file, harness, script, settled, slow, until, withPage } from './harness.js';
import { leastChunk, makePicture, texture } from './picture.js';
import { swappedProfile } from './profile.js';

const picture = makePicture({ width: 96, height: 64, layers: [40, 160, 400] });
/** So large that a small display needs a sixth of it. */
const large = makePicture({ width: 1200, height: 800, layers: [400, 1600, 4000, 6000] });

const element = (attributes) => `${script}<gip-image ${attributes}></gip-image>`;

/** Shows a picture when the decoder is loaded, so that the time for that does not count. */
async function show(page, src) {
  await page.evaluate(async (src) => {
    const { decode } = await import('/dist/index.js');
    await decode('/picture.gip');
    document.querySelector('gip-image').src = src;
  }, src);
  await settled(page);
}

/** The size of the canvas, and the mean of its samples' differences from another picture of it. */
const canvasOf = (page) =>
  page.evaluate(() => {
    const canvas = document.querySelector('gip-image').shadowRoot.querySelector('canvas');
    if (!canvas) return null;
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    return { width: canvas.width, height: canvas.height, data: [...data] };
  });

const difference = (a, b) =>
  a.data.reduce((sum, value, index) => sum + Math.abs(value - b.data[index]), 0) / a.data.length;

harness.routes['/picture.gip'] = file(picture);

test('it shows the samples of the decoder', async () => {
  await withPage(element('src="/picture.gip"'), async (page) => {
    await settled(page);
    const { width, height, data } = await page.evaluate(async () => {
      const { decode } = await import('/dist/index.js');
      const { width, height, data } = await decode('/picture.gip');
      return { width, height, data: [...data] };
    });
    const canvas = await canvasOf(page);
    assert.deepEqual([canvas.width, canvas.height], [width, height]);
    assert.equal(difference(canvas, { data }), 0);
    assert.ok(new Set(data).size > 100, 'there is a picture to compare');
  });
});

test('texture is shown, and left out and shown again as the attribute says', async () => {
  harness.routes['/textured.gip'] = file(makePicture({ layers: [40], chunks: [['tXTR', texture]] }));
  await withPage(element('src="/textured.gip"'), async (page) => {
    await settled(page);
    const wanted = await page.evaluate(async () => {
      const { decode } = await import('/dist/index.js');
      const images = [{}, { texture: false }].map((options) => decode('/textured.gip', options));
      return (await Promise.all(images)).map(({ data }) => ({ data: [...data] }));
    });
    assert.ok(difference(...wanted) > 1);
    const shows = (image) => until(async () => difference(await canvasOf(page), image) === 0, 'the picture');
    const property = (set) =>
      page.evaluate((set) => {
        const image = document.querySelector('gip-image');
        if (set) image.texture = set;
        return [image.texture, image.getAttribute('texture')];
      }, set);
    await shows(wanted[0]);
    assert.deepEqual(await property(), ['on', null]);
    assert.deepEqual(await property('off'), ['off', 'off']);
    await shows(wanted[1]);
    assert.deepEqual(await property('On'), ['on', 'On']);
    await shows(wanted[0]);
  });
});

test('the header gives the size, and pixels follow while they arrive', async () => {
  // The gate opens as the test goes on: first for the header, and less of a layer than a Gaussian.
  let allowed = 50;
  const gate = async (sent) => until(() => sent < allowed, 'the next piece');
  const { route } = slow(picture, { piece: 50, gate });
  harness.routes['/slow.gip'] = route;
  await withPage(element('src="/slow.gip"'), async (page) => {
    const size = () => page.evaluate(() => {
      const { width, height } = document.querySelector('gip-image').getBoundingClientRect();
      return [width, height];
    });
    await until(async () => (await size())[0] === 96, 'the size');
    assert.deepEqual(await size(), [96, 64]);
    assert.equal(await canvasOf(page), null);

    const seen = [];
    for (const part of [0.15, 0.5, 1]) {
      allowed = part === 1 ? Infinity : picture.length * part;
      await until(async () => {
        const canvas = await canvasOf(page);
        const last = seen.at(-1);
        return canvas && (!last || difference(canvas, last) > 0);
      }, 'a better picture');
      if (part === 1) await settled(page);
      seen.push(await canvasOf(page));
    }
    const [first, second] = seen.map((canvas) => difference(canvas, seen.at(-1)));
    assert.ok(first > second && second > 0, `${first}, ${second}`);
  });
});

/** Serves a file, of which the part from `at` on waits for the page. `open` lets it go on. */
function gated(path, bytes, at) {
  let isOpen = false;
  harness.routes[path] = async (_, response) => {
    response.writeHead(200, { 'Content-Length': bytes.length });
    response.write(bytes.subarray(0, at));
    await until(() => isOpen, 'the rest');
    response.end(bytes.subarray(at));
  };
  return () => {
    isOpen = true;
  };
}

/** Waits until the canvas shows exactly this file, in which nothing is to come. */
async function shows(page, path) {
  const wanted = await page.evaluate(async (path) => {
    const { decode } = await import('/dist/index.js');
    const { data } = await decode(path);
    return { data: [...data] };
  }, path);
  await until(async () => {
    const canvas = await canvasOf(page);
    return canvas?.data.length === wanted.data.length && difference(canvas, wanted) === 0;
  }, `the picture of ${path}`);
}

/** Whether `load` has fired. */
const isLoaded = (page) => page.evaluate(() => document.querySelector('gip-image').complete);

test('texture that comes after all Gaussians is shown, and waited for', async () => {
  const layers = [40, 160];
  const bytes = makePicture({ layers, later: [[2, 'tXTR', texture]] });
  const plain = makePicture({ layers });
  harness.routes['/plain.gip'] = file(plain);
  harness.routes['/late-at-once.gip'] = file(bytes);
  const open = gated('/late-texture.gip', bytes, plain.length - leastChunk);
  await withPage(element('src="/late-texture.gip"'), async (page) => {
    await shows(page, '/plain.gip');
    assert.equal(await isLoaded(page), false);
    open();
    await settled(page);
    await shows(page, '/late-at-once.gip');
  });
});

test('all Gaussians are shown before the metadata after them', async () => {
  // Of so few more, one waits for more while a picture arrives.
  const layers = [400, 20];
  const text = Buffer.concat([Buffer.from('Comment\0'), Buffer.alloc(2000, 97)]);
  const bytes = makePicture({ layers, later: [[2, 'tEXt', text]] });
  const plain = makePicture({ layers });
  harness.routes['/plain-400.gip'] = file(plain);
  const open = gated('/late-text.gip', bytes, plain.length + 500);
  await withPage(element('src="/late-text.gip"'), async (page) => {
    await shows(page, '/plain-400.gip');
    assert.equal(await isLoaded(page), false);
    open();
    await settled(page);
  });
});

for (const gamut of ['srgb', 'p3']) {
  test(`an ICC profile is applied, on a screen of ${gamut}`, async () => {
    const layers = [40, 160];
    const profiled = makePicture({ layers, chunks: [['iCCP', swappedProfile()]] });
    harness.routes['/unprofiled.gip'] = file(makePicture({ layers }));
    harness.routes['/profiled.gip'] = file(profiled);
    await withPage(element('src="/profiled.gip"'), async (page) => {
      const client = await page.context().newCDPSession(page);
      await client.send('Emulation.setEmulatedMedia', { features: [{ name: 'color-gamut', value: gamut }] });
      const spaceOf = () => page.evaluate(() => {
        const canvas = document.querySelector('gip-image').shadowRoot.querySelector('canvas');
        return canvas.getContext('2d').getContextAttributes().colorSpace;
      });
      const expected = gamut === 'p3' ? 'display-p3' : 'srgb';
      await settled(page);
      assert.equal(await spaceOf(), expected);
      const shown = await canvasOf(page);
      await page.evaluate(() => document.querySelector('gip-image').setAttribute('src', '/unprofiled.gip'));
      await settled(page);
      assert.ok(difference(await canvasOf(page), shown) > 3);
      assert.equal(await spaceOf(), 'srgb');
    });
  });
}

test('the download stops when the size has what it needs, and goes on when it grows', async () => {
  const { route, log } = slow(large, { piece: 4096, interval: 30 });
  harness.routes['/large.gip'] = route;
  await withPage(element('width="60"'), async (page) => {
    await show(page, '/large.gip');
    await until(() => log.open === 0, 'the end of the transfer');
    const small = log.sent;
    assert.ok(small < 0.35 * large.length, `${small} of ${large.length} bytes`);
    assert.ok(small >= large.length / 6);

    await page.evaluate(() => document.querySelector('gip-image').setAttribute('width', '360'));
    await until(() => log.requests.length === 2 && log.open === 0, 'the rest');
    const [, range] = log.requests;
    const start = Number(/^bytes=(\d+)-$/.exec(range)[1]);
    assert.ok(start > 0 && start <= small, 'it goes on where it was');
    assert.ok(log.sent <= large.length + small - start, `${log.sent} of ${large.length} bytes`);
    await until(async () => (await canvasOf(page)).width === 360, 'a sharper picture');

    // Smaller again: nothing more is fetched.
    await page.evaluate(() => document.querySelector('gip-image').setAttribute('width', '100'));
    await until(async () => (await canvasOf(page)).width === 100, 'a smaller picture');
    assert.equal(log.requests.length, 2);
  });
});

/** For those who want few bytes. */
const saving = `<script>
  Object.defineProperty(NetworkInformation.prototype, 'saveData', { get: () => true });
</script>`;

test('with few bytes wanted, the first layers are loaded of what is close to the screen, and the rest when it is asked for', async () => {
  const { route, log } = slow(large, { piece: 4096, interval: 15 });
  harness.routes['/few.gip'] = route;
  const seen = [];
  for (const name of ['far', 'full']) {
    harness.routes[`/${name}.gip`] = (request, response) => {
      seen.push(name);
      file(picture)(request, response);
    };
  }
  const below = '<gip-image src="/far.gip"></gip-image><gip-image src="/full.gip" detail="full"></gip-image>';
  const html = `${element('width="600"')}<div style="height: 8000px"></div>${below}`;
  await withPage(saving + html, async (page) => {
    await show(page, '/few.gip');
    await until(() => log.open === 0, 'the end of the transfer');
    const few = log.sent;
    assert.ok(few >= large.length / 6 && few < large.length / 2, `${few} of ${large.length} bytes`);
    assert.deepEqual(seen, ['full']);
    await page.evaluate(() => (document.querySelector('gip-image').detail = 'full'));
    await until(() => log.requests.length === 2 && log.open === 0, 'the rest');
    assert.ok(log.sent >= large.length, `${log.sent} of ${large.length} bytes`);
    await page.evaluate(() => document.querySelector('[src="/far.gip"]').scrollIntoView());
    await until(() => seen.includes('far'), 'the request');
  });
});

test('without ranges it begins again when it grows', async () => {
  const { route, log } = slow(large, { piece: 4096, interval: 15, ranges: false });
  harness.routes['/whole.gip'] = route;
  await withPage(element('width="60"'), async (page) => {
    await show(page, '/whole.gip');
    await until(() => log.open === 0, 'the end of the transfer');
    await page.evaluate(() => document.querySelector('gip-image').setAttribute('width', '1200'));
    const complete = () => page.evaluate(async () => {
      const { decode } = await import('/dist/index.js');
      const image = await decode('/large-at-once.gip');
      const canvas = document.querySelector('gip-image').shadowRoot.querySelector('canvas');
      if (canvas.width !== image.width) return false;
      const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
      return data.every((value, index) => value === image.data[index]);
    });
    harness.routes['/large-at-once.gip'] = file(large);
    await until(complete, 'the whole picture');
    assert.equal(log.requests.length, 2);
  });
});

test('a file that was replaced meanwhile is loaded from its beginning', async () => {
  const other = makePicture({ width: 1200, height: 800, layers: [400, 1600, 4000, 6000], seed: 2 });
  const [old, now] = [large, other].map((bytes) => slow(bytes, { piece: 4096, interval: 15 }));
  harness.routes['/replaced.gip'] = old.route;
  harness.routes['/other.gip'] = file(other);
  await withPage(element('width="60"'), async (page) => {
    await show(page, '/replaced.gip');
    await until(() => old.log.open === 0, 'the end of the transfer');
    harness.routes['/replaced.gip'] = now.route;
    await page.evaluate(() => document.querySelector('gip-image').setAttribute('width', '1200'));
    await until(() => page.evaluate(async () => {
      const { decode } = await import('/dist/index.js');
      const image = await decode('/other.gip');
      const canvas = document.querySelector('gip-image').shadowRoot.querySelector('canvas');
      if (canvas?.width !== image.width) return false;
      const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
      return data.every((value, index) => value === image.data[index]);
    }), 'the other picture');
  });
});

const broken = {
  'not-a-picture.gip': ['signature', Buffer.from('<!doctype html>')],
  'damaged-early.gip': ['malformed', Buffer.concat([picture.subarray(0, 60), Buffer.alloc(picture.length - 60)])],
  'truncated-early.gip': ['unexpected-end', picture.subarray(0, 30)],
  'empty.gip': ['unexpected-end', Buffer.alloc(0)],
  'missing.gip': ['network', null],
};

for (const [name, [kind, bytes]] of Object.entries(broken)) {
  test(`${name}: the alternative text, and an error event`, async () => {
    if (bytes) harness.routes[`/${name}`] = file(bytes);
    const watch = `<script>
      addEventListener('error', (event) => { globalThis.kind = event.error?.kind; }, true);
    </script>`;
    await withPage(`${watch}<p>${element(`src="/${name}" alt="A mountain"`)}`, async (page) => {
      await settled(page);
      assert.equal(await page.evaluate(() => globalThis.kind), kind);
      assert.equal(await canvasOf(page), null);
      const text = await page.evaluate(() => {
        const image = document.querySelector('gip-image');
        return [image.shadowRoot.textContent, image.getBoundingClientRect().width > 50, image.complete];
      });
      assert.deepEqual(text, ['A mountain', true, true]);
      await assert.rejects(page.evaluate(() => document.querySelector('gip-image').decode()));
      // Another source is another chance.
      await page.evaluate(() => document.querySelector('gip-image').setAttribute('src', '/picture.gip'));
      await settled(page);
      assert.equal((await canvasOf(page)).width, 96);
    }, { quiet: true });
  });
}

test('in place of a broken picture there is what is inside the element, if there is something', async () => {
  const inside = '<noscript>never</noscript><b style="display: inline-block; width: 70px">fallback</b>';
  await withPage(`${script}<gip-image src="/missing.gip" alt="A mountain">${inside}</gip-image>`, async (page) => {
    const width = () => page.evaluate(() => document.querySelector('b').getBoundingClientRect().width);
    await settled(page);
    await until(async () => (await width()) === 70, 'the fallback');
    await page.evaluate(() => document.querySelector('gip-image').setAttribute('src', '/picture.gip'));
    await settled(page);
    assert.equal(await width(), 0);
    assert.equal((await canvasOf(page)).width, 96);
  }, { quiet: true });
});

const partial = {
  'damaged.gip': ['malformed', Buffer.concat([picture.subarray(0, 3000), Buffer.alloc(picture.length - 3000)])],
  'truncated.gip': ['unexpected-end', picture.subarray(0, picture.length / 2)],
};

for (const [name, [kind, bytes]] of Object.entries(partial)) {
  test(`${name}: the part that arrived, and an event that says so`, async () => {
    // All at once, and in pieces.
    const routes = [file(bytes), slow(bytes, { piece: 700 }).route];
    for (const route of routes) {
      harness.routes[`/${name}`] = route;
      const watch = `<script>
        globalThis.events = [];
        for (const type of ['incomplete', 'error', 'load']) {
          document.addEventListener(type, ({ target, error }) => {
            if (target.localName === 'gip-image') events.push([type, error?.kind ?? null, target.incomplete]);
          }, true);
        }
      </script>`;
      await withPage(`${watch}${element(`src="/${name}" alt="A mountain"`)}`, async (page) => {
        await settled(page);
        assert.deepEqual(await page.evaluate(() => globalThis.events), [['incomplete', kind, true], ['load', null, true]]);
        const wanted = await page.evaluate(async (name) => {
          const { StreamDecoder } = await import('/dist/index.js');
          const bytes = new Uint8Array(await (await fetch(name)).arrayBuffer());
          const decoder = new StreamDecoder();
          await decoder.feed(bytes).catch(() => {});
          const { data } = await decoder.render();
          return { data: [...data], arrived: decoder.arrived, declared: decoder.header.gaussians };
        }, `/${name}`);
        assert.ok(wanted.arrived >= 40 && wanted.arrived < wanted.declared, wanted.arrived);
        assert.equal(difference(await canvasOf(page), wanted), 0);
        await page.evaluate(() => document.querySelector('gip-image').decode());
        // Another source has nothing of it.
        await page.evaluate(() => document.querySelector('gip-image').setAttribute('src', '/picture.gip'));
        await settled(page);
        assert.equal(await page.evaluate(() => document.querySelector('gip-image').incomplete), false);
      });
    }
  });
}

test('what exceeds a limit is refused, until a page raises it', async () => {
  harness.routes['/tall.gip'] = file(makePicture({ width: 2, height: 65_537, layers: [3] }));
  await withPage(element('alt="Tall"'), async (page) => {
    const outcomes = await page.evaluate(async () => {
      await customElements.whenDefined('gip-image');
      const image = document.querySelector('gip-image');
      const outcome = () =>
        new Promise((resolve) => {
          image.addEventListener('load', () => resolve(image.naturalHeight), { once: true });
          image.addEventListener('error', ({ error }) => resolve([error.limit, error.message]), { once: true });
          image.src = '/tall.gip';
        });
      const refused = await outcome();
      image.limits = { [refused[0]]: 70_000 };
      return [refused, await outcome()];
    });
    const message = 'limit exceeded: height: 65537 required, 65536 allowed; limits: { height: ... } raises it';
    assert.deepEqual(outcomes, [['height', message], 65_537]);
  });
});

test('an empty source, and one that is no URL', async () => {
  for (const src of ['', 'http://[']) {
    await withPage(element(`src="${src}" alt="None"`), async (page) => {
      await until(() => page.evaluate(() => document.querySelector('gip-image').complete === true), 'the error');
      assert.equal(await page.evaluate(() => document.querySelector('gip-image').shadowRoot.textContent), 'None');
    });
  }
});

test('it can be taken out of the page and put back, and moved', async () => {
  await withPage(element('src="/picture.gip"'), async (page) => {
    await settled(page);
    const widths = await page.evaluate(async () => {
      const image = document.querySelector('gip-image');
      const canvas = () => image.shadowRoot.querySelector('canvas')?.width;
      const div = document.createElement('div');
      document.body.append(div);
      div.append(image);
      await new Promise((resolve) => setTimeout(resolve, 50));
      const moved = [canvas(), image.naturalWidth];
      image.remove();
      await new Promise((resolve) => setTimeout(resolve, 50));
      const removed = [canvas(), image.naturalWidth];
      document.body.append(image);
      await image.decode();
      return [moved, removed, [canvas(), image.naturalWidth]];
    });
    assert.deepEqual(widths, [[96, 96], [undefined, 0], [96, 96]]);
  });
});

for (const [sent, outcome] of [[30, 'error'], [2000, 'incomplete']]) {
  test(`a connection that is lost after ${sent} bytes: ${outcome}`, async () => {
    harness.routes['/lost.gip'] = (_, response) => {
      response.writeHead(200, { 'Content-Length': picture.length });
      response.write(picture.subarray(0, sent), () => setTimeout(() => response.destroy(), 100));
    };
    await withPage(element('src="/lost.gip" alt="Lost"'), async (page) => {
      await settled(page);
      const text = await page.evaluate(() => document.querySelector('gip-image').shadowRoot.textContent);
      assert.equal(text, outcome === 'error' ? 'Lost' : '');
      assert.equal(await page.evaluate(() => document.querySelector('gip-image').incomplete), outcome === 'incomplete');
    }, { quiet: true });
  });
}

test('it is an image with a name to those who do not see it', async () => {
  const html = `${script}<gip-image src="/picture.gip" alt="A mountain"></gip-image>
    <gip-image src="/picture.gip" alt=""></gip-image>`;
  await withPage(html, async (page) => {
    await settled(page);
    const client = await page.context().newCDPSession(page);
    const { nodes } = await client.send('Accessibility.getFullAXTree');
    const images = nodes.filter(({ role }) => role?.value === 'image');
    assert.deepEqual(images.map(({ name }) => name.value), ['A mountain']);
  });
});

test('it is as sharp as the screen, and is rendered anew when that changes', async () => {
  const html = element('src="/picture.gip" style="width: 60px"');
  await withPage(html, async (page) => {
    await settled(page);
    const width = async () => (await canvasOf(page)).width;
    assert.equal(await width(), 120);
    const client = await page.context().newCDPSession(page);
    const metrics = { width: 700, height: 500, deviceScaleFactor: 2.5, mobile: false };
    await client.send('Emulation.setDeviceMetricsOverride', metrics);
    await until(async () => (await width()) === 150, 'more pixels');
    await page.evaluate(() => document.querySelector('gip-image').style.setProperty('width', '80px'));
    await until(async () => (await width()) === 200, 'a larger picture');
  }, { context: { deviceScaleFactor: 2 } });
});

const fits = [
  'object-fit: contain',
  'object-fit: cover',
  'object-fit: none',
  'object-fit: scale-down; object-position: 0 100%',
  'object-fit: cover; object-position: 10px 0',
  'padding: 7px 20px; object-fit: contain',
  'border-radius: 30px',
];

for (const style of fits) {
  test(`drawn like <img>: ${style}`, async () => {
    const css = `<style>.both { width: 150px; height: 150px; ${style} }</style>`;
    await withPage(css + element('src="/picture.gip" class="both"'), async (page) => {
      await settled(page);
      const other = await page.evaluate(async () => {
        const { open } = await import('/dist/index.js');
        const blob = await (await open('/picture.gip')).png();
        const image = document.createElement('img');
        image.className = 'both';
        image.src = URL.createObjectURL(blob);
        await image.decode();
        document.querySelector('gip-image').after(image);
      });
      assert.equal(other, undefined);
      const shots = [];
      for (const selector of ['gip-image', 'img']) {
        const png = (await page.locator(selector).screenshot()).toString('base64');
        shots.push(await page.evaluate(async (png) => {
          const bitmap = await createImageBitmap(await (await fetch(`data:image/png;base64,${png}`)).blob());
          const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
          context.drawImage(bitmap, 0, 0);
          return { data: [...context.getImageData(0, 0, bitmap.width, bitmap.height).data] };
        }, png));
      }
      assert.equal(shots[0].data.length, shots[1].data.length);
      // The browser resamples, the element renders at the size.
      const found = difference(...shots);
      assert.ok(found < 2, `they differ by ${found}`);
    });
  });
}

test('when the decoder could not be loaded, the next picture tries again', async () => {
  await withPage(script, async (page) => {
    await page.evaluate(() => customElements.whenDefined('gip-image'));
    const outcome = () =>
      page.evaluate(async () => {
        const image = document.createElement('gip-image');
        image.src = '/picture.gip';
        document.body.append(image);
        return image.decode().then(() => 'shown', ({ cause }) => cause.name);
      });
    const ofDecoder = /dist.(core|worker).js/;
    await page.context().route(ofDecoder, (route) => route.abort());
    assert.equal(await outcome(), 'TypeError');
    await page.context().unroute(ofDecoder);
    assert.equal(await outcome(), 'shown');
  }, { quiet: true });
});

test('a picture that is shown stays when more pixels are beyond the limits', async () => {
  await withPage(element(''), async (page) => {
    await page.evaluate(() => {
      document.querySelector('gip-image').limits = { outputPixels: 96 * 64 };
    });
    await show(page, '/picture.gip');
    const image = await canvasOf(page);
    const shown = await page.evaluate(async () => {
      const image = document.querySelector('gip-image');
      image.style.width = '192px';
      const canvas = image.shadowRoot.querySelector('canvas');
      while (canvas.getBoundingClientRect().width < 192) await new Promise(requestAnimationFrame);
      await new Promise((resolve) => setTimeout(resolve, 200));
      return [image.complete, canvas.isConnected];
    });
    assert.deepEqual(shown, [true, true]);
    assert.deepEqual(await canvasOf(page), image);
    // At the size that it had before, nothing is the matter.
    await page.evaluate(() => (document.querySelector('gip-image').style.width = '90px'));
    await until(async () => (await canvasOf(page)).width === 90, 'the picture of another size');
  });
});
