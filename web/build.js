// Puts the viewer together in `dist/`, which any web server can serve: the page, the decoder of
// `bindings/wasm`, and the shader of `gpu`. `node web/build.js` also builds the decoder.

import { execFileSync } from 'node:child_process';
import { cpSync, existsSync, mkdirSync, rmSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const wasm = join(here, '..', 'bindings', 'wasm');

/** Everything of the site, and where it comes from. */
const contents = {
  'index.html': join(here, 'index.html'),
  'style.css': join(here, 'style.css'),
  'icon.svg': join(here, 'icon.svg'),
  js: join(here, 'js'),
  sample: join(here, 'sample'),
  decoder: join(wasm, 'dist'),
  shader: join(here, 'shader'),
  'shader/render.wgsl': join(here, '..', 'gpu', 'src', 'render.wgsl'),
};

const hasDecoder = () => existsSync(join(wasm, 'dist', 'image_gip_bg.wasm'));

/** Builds the decoder, if that was not done yet. */
export function buildDecoder() {
  if (hasDecoder()) return;
  console.log('Building the decoder first, which takes some minutes.');
  const run = (...args) => execFileSync('npm', args, { cwd: wasm, stdio: 'inherit' });
  run('ci');
  run('run', 'build');
}

/** Puts the site together in a folder, and returns that. */
export function assemble(site = join(here, 'dist')) {
  if (!hasDecoder()) throw new Error('first build the decoder: npm ci && npm run build in bindings/wasm');
  rmSync(site, { recursive: true, force: true });
  for (const [place, source] of Object.entries(contents)) {
    mkdirSync(dirname(join(site, place)), { recursive: true });
    cpSync(source, join(site, place), { recursive: true });
  }
  return site;
}

if (import.meta.url === pathToFileURL(process.argv[1]).href) {
  buildDecoder();
  console.log(assemble());
}
