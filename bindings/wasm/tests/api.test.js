// `decode`, `open` and `StreamDecoder` in the browser.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { file, harness, inPage, slow, until } from './harness.js';
import { makePicture } from './picture.js';

test('every line of the test vectors, in a worker', async () => {
  const { lines, wrong } = await inPage(async ({ StreamDecoder }) => {
    const { parseIndex, resultOf, unlimited } = await import('/tests/vectors.js');
    const lines = parseIndex(await (await fetch('/vectors/index.tsv')).text());
    const wrong = [];
    for (const line of lines) {
      const bytes = new Uint8Array(await (await fetch(`/vectors/${line.file}`)).arrayBuffer());
      const found = await resultOf(new StreamDecoder({ limits: unlimited }), bytes, line);
      if (found !== line.result) wrong.push({ ...line, found });
    }
    return { lines: lines.length, wrong };
  });
  assert.ok(lines > 150);
  assert.deepEqual(wrong, []);
});

const picture = makePicture({ width: 96, height: 64, layers: [40, 160] });

test('every kind of source gives the same picture', async () => {
  harness.routes['/picture.gip'] = file(picture);
  const results = await inPage(async ({ decode }) => {
    const buffer = await (await fetch('/picture.gip')).arrayBuffer();
    const sources = {
      string: '/picture.gip',
      url: new URL('/picture.gip', location.href),
      request: new Request('/picture.gip'),
      response: await fetch('/picture.gip'),
      blob: new Blob([buffer]),
      objectUrl: URL.createObjectURL(new Blob([buffer])),
      buffer,
      view: new Uint8Array(buffer),
      dataView: new DataView(buffer),
      stream: new Blob([buffer]).stream(),
      smallPieces: new ReadableStream({
        start(controller) {
          for (let at = 0; at < buffer.byteLength; at += 7) {
            controller.enqueue(new Uint8Array(buffer.slice(at, at + 7)));
          }
          controller.close();
        },
      }),
    };
    const first = await decode(buffer);
    const equal = ({ width, height, data }) =>
      width === 96 && height === 64 && data.every((value, at) => value === first.data[at]);
    const out = {};
    for (const [name, source] of Object.entries(sources)) {
      const image = await decode(source);
      out[name] = image instanceof ImageData && equal(image);
    }
    out.kept = buffer.byteLength > 0;
    return out;
  });
  for (const [name, equal] of Object.entries(results)) assert.ok(equal, name);
  assert.equal(Object.keys(results).length, 12);
});

test('errors have a class, a kind and a chunk', async () => {
  const results = await inPage(
    async (gip, damaged) => {
      const outcome = (promise) =>
        promise.then(
          () => 'no error',
          (error) => {
            const isClass = gip[error.name] ? error instanceof gip[error.name] : true;
            return [error.name, error.kind ?? null, error.chunk ?? null, isClass];
          },
        );
      const bytes = new Uint8Array(damaged);
      const closed = await gip.open(bytes);
      closed.close();
      return {
        signature: await outcome(gip.decode(new Uint8Array(20))),
        malformed: await outcome(gip.decode(bytes.map((byte, at) => (at === 500 ? byte ^ 1 : byte)))),
        end: await outcome(gip.open(bytes.subarray(0, 1000))),
        network: await outcome(gip.decode('/nowhere.gip')),
        unreachable: await outcome(gip.decode('http://127.0.0.1:1/')),
        limit: await outcome(gip.decode(bytes, { limits: { gaussians: 10 } })),
        output: await outcome(gip.decode(bytes, { width: 100_000, height: 100_000 })),
        work: await outcome(gip.decode(bytes, { width: 1, height: 1, limits: { work: 1000 } })),
        region: await outcome(gip.decode(bytes, { region: { x: 90, y: 0, width: 7, height: 1 } })),
        width: await outcome(gip.decode(bytes, { width: 1.5 })),
        source: await outcome(gip.decode(12)),
        bytes: await outcome(new gip.StreamDecoder().feed(new ArrayBuffer(8))),
        closed: await outcome(closed.render()),
      };
    },
    [...picture],
    { quiet: true },
  );
  assert.deepEqual(results, {
    signature: ['SignatureError', 'signature', null, true],
    malformed: ['MalformedError', 'malformed', 'L', true],
    end: ['UnexpectedEndError', 'unexpected-end', 'L', true],
    network: ['NetworkError', 'network', null, true],
    unreachable: ['NetworkError', 'network', null, true],
    limit: ['LimitError', 'limit', null, true],
    output: ['LimitError', 'limit', null, true],
    work: ['LimitError', 'limit', null, true],
    region: ['RangeError', null, null, true],
    width: ['RangeError', null, null, true],
    source: ['TypeError', null, null, true],
    bytes: ['TypeError', null, null, true],
    closed: ['GipError', 'failed', null, true],
  });
});

test('misuse is refused in plain words', async () => {
  const results = await inPage(async (gip, bytes) => {
    const outcome = async (run) => {
      try {
        await run();
        return 'no error';
      } catch (error) {
        return `${error.name}: ${error.message}`;
      }
    };
    const empty = new gip.StreamDecoder();
    const closed = new gip.StreamDecoder();
    closed.close();
    const limits = [NaN, -1, '5', 5n, {}, Symbol('s')];
    return {
      early: await Promise.all(['render', 'samples', 'png'].map((method) => outcome(() => empty[method]()))),
      closed: await Promise.all(['feed', 'finish', 'png'].map((method) => outcome(() => closed[method](new Uint8Array())))),
      limits: await Promise.all(
        limits.map((height) => outcome(() => gip.decode(new Uint8Array(bytes), { limits: { height } }))),
      ),
      infinite: await outcome(() => gip.decode(new Uint8Array(bytes), { limits: { work: Infinity, width: undefined } })),
      none: await outcome(() => gip.decode(new Uint8Array(bytes), { limits: null })),
    };
  }, [...picture]);
  const [end] = results.early;
  assert.match(end, /^UnexpectedEndError: /);
  const limit = (value) => `RangeError: limits.height is ${value}; it must be a number from 0 to Infinity`;
  assert.deepEqual(results, {
    early: [end, end, end],
    closed: Array(3).fill('GipError: the decoder is closed'),
    limits: ['NaN', '-1', '5', '5', '[object Object]', 'Symbol(s)'].map(limit),
    infinite: 'no error',
    none: 'no error',
  });
});

test('what is called before close() is answered, and bytes are taken at the call', async () => {
  const results = await inPage(async ({ StreamDecoder }, bytes) => {
    const decoder = new StreamDecoder();
    const buffer = new Uint8Array(bytes.length + 10);
    buffer.set(bytes, 5);
    const fed = decoder.feed(buffer.subarray(5, 5 + bytes.length));
    buffer.fill(0);
    const calls = [decoder.finish(), decoder.png(), decoder.render(), decoder.samples(), decoder.gaussians()];
    decoder.close();
    const late = decoder.render().catch(({ message }) => message);
    const [, png, image, samples, numbers] = await Promise.all(calls);
    return [(await fed).complete, png.type, image.width, samples.width, numbers.length, await late, buffer.length];
  }, [...picture]);
  const wanted = [true, 'image/png', 96, 96, 200 * 9, 'the decoder is closed', picture.length + 10];
  assert.deepEqual(results, wanted);
});

test('an abort ends the download and the wait', async () => {
  const { route, log } = slow(picture, { piece: 500, gate: () => new Promise(() => {}) });
  harness.routes['/never.gip'] = route;
  const reasons = await inPage(async ({ decode, open }) => {
    const out = [];
    for (const call of [decode, open]) {
      const controller = new AbortController();
      const waiting = call('/never.gip', { signal: controller.signal });
      setTimeout(() => controller.abort(), 200);
      out.push(await waiting.catch((error) => error.name));
      out.push(await call('/never.gip', { signal: AbortSignal.abort('early') }).catch((reason) => reason));
    }
    const stream = new ReadableStream({ cancel: (reason) => out.push(reason) });
    const controller = new AbortController();
    setTimeout(() => controller.abort('because'), 50);
    out.push(await decode(stream, { signal: controller.signal }).catch((reason) => reason));
    return out;
  });
  assert.deepEqual(reasons, ['AbortError', 'early', 'AbortError', 'early', 'because', 'because']);
  await until(() => log.open === 0, 'the end of the transfers');
  assert.equal(log.requests.length, 2);
});

test('a picture is rendered again and again, in parts and from prefixes', async () => {
  const result = await inPage(async ({ open, decode }, bytes) => {
    const file = new Uint8Array(bytes);
    const picture = await open(file, { statistics: true });
    const whole = await picture.render({ width: 300, height: 200 });
    const part = await picture.render({
      width: 300,
      height: 200,
      region: { x: 100, y: 50, width: 64, height: 32 },
    });
    let equal = true;
    for (let y = 0; y < 32; y += 1) {
      for (let x = 0; x < 64 * 4; x += 1) {
        equal &&= part.data[y * 256 + x] === whole.data[(y + 50) * 1200 + 400 + x];
      }
    }
    const some = await picture.render({ gaussians: 40 });
    const few = await decode(file, { width: 48 });
    const { layers, attributeBits } = await picture.statistics();
    const gaussiansIn = await Promise.all(layers.map(({ end }) => picture.gaussiansIn(end)));
    const numbers = await picture.gaussians({ start: 1, end: 3 });
    picture.close();
    return {
      equal,
      differ: some.data.some((value, at) => value !== whole.data[at]),
      few: [few.width, few.height],
      bits: attributeBits.position,
      gaussiansIn,
      numbers: numbers.length,
      header: picture.header.color,
    };
  }, [...picture]);
  assert.deepEqual(result, {
    equal: true,
    differ: true,
    few: [48, 32],
    bits: 200 * 64,
    gaussiansIn: [40, 200],
    numbers: 18,
    header: 'rgb',
  });
});

test('a stream is shown while it arrives', async () => {
  const counts = await inPage(async ({ StreamDecoder }, bytes) => {
    const decoder = new StreamDecoder();
    const out = [];
    for (let at = 0; at < bytes.length; at += 1500) {
      await decoder.feed(new Uint8Array(bytes.slice(at, at + 1500)));
      const { data } = await decoder.render();
      out.push([decoder.arrived, data.reduce((sum, value) => sum + value, 0)]);
    }
    await decoder.finish();
    return [...out, decoder.complete];
  }, [...picture]);
  assert.equal(counts.pop(), true);
  assert.equal(counts.at(-1)[0], 200);
  assert.equal(new Set(counts.map(String)).size, counts.length, 'every piece adds to the picture');
});
