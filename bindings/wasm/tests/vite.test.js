// The plug-in for Vite, without Vite, and with a program in place of the tool: `npm run bundlers -- site` has both.

import assert from 'node:assert/strict';
import { chmodSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { delimiter, join } from 'node:path';
import { after, test } from 'node:test';

import gip from 'image-gip/vite';

import { makePicture } from './picture.js';

const folder = mkdtempSync(join(tmpdir(), 'image-gip-'));
after(() => rmSync(folder, { recursive: true }));
const original = join(folder, 'Lake & hills.jpg');
writeFileSync(original, 'a picture');
const file = makePicture({ width: 96, height: 64, layers: [3, 40] });
const log = join(folder, 'log');
writeFileSync(join(folder, 'made.gip'), file);
writeFileSync(log, '');
// It takes what is to be its result, and tells how it was called.
const tool = `#!/bin/sh
[ "$1" = --version ] && exit
case "$*" in *'--quality 99'*) echo 'error: no such quality' >&2; exit 1; esac
echo "$@" >>'${log}'
cp '${join(folder, 'made.gip')}' "$3"
`;
writeFileSync(join(folder, 'gip'), tool);
chmodSync(join(folder, 'gip'), 0o755);
process.env.PATH = folder + delimiter + process.env.PATH;

/** A plug-in as Vite sets it up, and what it emitted. */
function pluginFor(command, options) {
  const plugin = gip(options);
  const emitted = [];
  const context = {
    addWatchFile() {},
    emitFile: (file) => `reference${emitted.push(file)}`,
  };
  plugin.configResolved({ command, cacheDir: folder, root: folder, base: '/base/' });
  const load = async (query, path = original) => {
    const code = await plugin.load.call(context, `${path}?${query}`);
    return code && (await import(`data:text/javascript,${encodeURIComponent(code)}#${Math.random()}`)).default;
  };
  return { plugin, emitted, load };
}

test('what is built has the file and the original as assets, and markup of them', async () => {
  const { load, emitted } = pluginFor('build', { effort: 2 });
  const picture = await load('gip&quality=60');
  assert.deepEqual(emitted.map(({ type, name }) => [type, name]), [['asset', 'Lake & hills.gip'], ['asset', 'Lake & hills.jpg']]);
  assert.deepEqual(emitted[0].source, file);
  assert.equal(String(emitted[1].source), 'a picture');
  const { markup, ...facts } = picture;
  const early = file.toString('base64');
  assert.deepEqual(facts, {
    src: '__VITE_ASSET__reference1__',
    fallback: '__VITE_ASSET__reference2__',
    width: 96,
    height: 64,
    placeholder: early,
  });
  assert.equal(
    markup({ alt: '"Hills" & <more>', loading: 'lazy', hidden: true, title: null }),
    `<gip-image placeholder="${early}" src="__VITE_ASSET__reference1__" width="96" height="64" ` +
      'alt="&quot;Hills&quot; &amp; &lt;more>" loading="lazy" hidden>' +
      '<noscript><img src="__VITE_ASSET__reference2__" width="96" height="64" alt="&quot;Hills&quot; &amp; &lt;more>"></noscript></gip-image>',
  );
});

test('a picture is encoded once for each set of options, with those of the import before the others', async () => {
  const calls = () => readFileSync(log, 'utf8').trim().split('\n');
  const before = calls().length;
  const { load } = pluginFor('build', { bytes: 9000, effort: 1 });
  await Promise.all([load('gip'), load('gip'), load('gip&quality=70')]);
  await pluginFor('build', { bytes: 9000, effort: 1 }).load('gip');
  const made = calls().slice(before);
  // The placeholder was made by the test before.
  assert.equal(made.length, 2, made);
  const [first, second] = made.sort((a, b) => a.includes('quality') - b.includes('quality'));
  assert.match(first, /--metadata safe --bytes 9000 --effort 1$/);
  assert.match(second, /--metadata safe --quality 70 --effort 1$/);
  assert.equal(calls().filter((call) => call.endsWith('--metadata none --bytes 300 --effort 4')).length, 1);
});

test('what the tool says is the error, or that there is none', async () => {
  await assert.rejects(pluginFor('build').load('gip&quality=99'), { message: 'error: no such quality' });
  const { PATH } = process.env;
  process.env.PATH = '';
  await assert.rejects(pluginFor('build', { encoder: 'gip' }).load('gip&quality=1'), /the tool gip does not run: spawn gip ENOENT/);
  process.env.PATH = PATH;
});

test('what is damaged in the cache is made again', async () => {
  const options = { cache: 'damaged', effort: 3 };
  const first = pluginFor('build', options);
  await first.load('gip');
  const cached = join(folder, 'damaged');
  const damages = [
    () => Buffer.alloc(0),
    (bytes) => bytes.subarray(0, bytes.length / 2),
    (bytes) => bytes.map((byte, at) => (at === bytes.length - 9 ? byte ^ 1 : byte)),
    (bytes) => Buffer.concat([bytes, bytes]),
  ];
  for (const damage of damages) {
    for (const name of readdirSync(cached)) writeFileSync(join(cached, name), damage(readFileSync(join(cached, name))));
    const { load, emitted } = pluginFor('build', options);
    await load('gip');
    assert.deepEqual(emitted[0].source, file);
    for (const name of readdirSync(cached)) assert.deepEqual(readFileSync(join(cached, name)), file);
  }
});

test('other imports are none of its business, and unknown options are told', async () => {
  const { load } = pluginFor('build');
  assert.equal(await load('url'), null);
  assert.equal(await load('gipsy'), null);
  await assert.rejects(load('gip&size=3'), /gip&size: there is no such option/);
  for (const value of ['', '%20', 'high', 'NaN']) {
    await assert.rejects(load(`gip&quality=${value}`), { name: 'RangeError', message: /it must be a number/ });
  }
  assert.throws(() => gip({ encoder: 'rust' }), { name: 'RangeError' });
  assert.throws(() => gip({ qualty: 60 }), { name: 'TypeError', message: /there is no option qualty/ });
});

test('the development server sends both files', async () => {
  const { plugin, load } = pluginFor('serve');
  const { src, fallback } = await load('gip');
  let handle = null;
  plugin.configureServer({ middlewares: { use: (handler) => (handle = handler) } });
  const get = (url) => {
    const answer = {};
    const response = { writeHead: (_, headers) => (answer.type = headers['Content-Type']), end: (content) => (answer.content = content) };
    handle({ url }, response, () => (answer.type = 'next'));
    return answer;
  };
  assert.ok(src.startsWith('/base/@image-gip/'), src);
  assert.deepEqual(get(src), { type: 'image/vnd.gip', content: file });
  assert.equal(get(fallback).type, 'image/jpeg');
  assert.equal(get('/index.html').type, 'next');
  assert.equal(get('//').type, 'next');
});
