// Builds the package into `dist/`: `npm run build`.
//
// It needs a Rust toolchain with the target wasm32-unknown-unknown, and the npm packages of
// `npm ci`. The command line tool of wasm-bindgen comes from crates.io, in exactly the version that
// Cargo.lock has.

import { execFileSync } from 'node:child_process';
import { copyFileSync, cpSync, existsSync, mkdirSync, readFileSync, readdirSync, rmSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

import { build } from 'esbuild';

const root = dirname(fileURLToPath(import.meta.url));
const target = join(root, 'target');
const dist = join(root, 'dist');
const run = (program, ...args) => execFileSync(program, args, { cwd: root, stdio: 'inherit' });

/** The command line tool of wasm-bindgen. It is installed if it is not there. */
function wasmBindgen() {
  const [, version] = readFileSync(join(root, 'Cargo.lock'), 'utf8').match(
    /name = "wasm-bindgen"\nversion = "(.*)"/,
  );
  const folder = join(target, `wasm-bindgen-${version}`);
  const program = join(folder, 'bin', 'wasm-bindgen');
  if (!existsSync(program)) {
    const place = ['--root', folder, '--target-dir', join(target, 'tools')];
    // It runs for seconds; to optimize it would take minutes.
    const tool = ['wasm-bindgen-cli', '--version', `=${version}`, '--bin', 'wasm-bindgen', '--debug'];
    run('cargo', 'install', '--quiet', ...tool, ...place);
  }
  return program;
}

const bindgen = wasmBindgen();
run('cargo', 'build', '--release', '--locked', '--target', 'wasm32-unknown-unknown', '--target-dir', target);
// The scripts beside those of wasm-bindgen, from where they are bundled.
const scripts = join(target, 'scripts');
rmSync(scripts, { recursive: true, force: true });
cpSync(join(root, 'js'), scripts, { recursive: true });
const module = join(target, 'wasm32-unknown-unknown', 'release', 'image_gip.wasm');
run(bindgen, '--target', 'web', '--no-typescript', '--out-dir', scripts, module);

rmSync(dist, { recursive: true, force: true });
mkdirSync(dist);
const wasm = join(dist, 'image_gip_bg.wasm');
run(
  join(root, 'node_modules', '.bin', 'wasm-opt'),
  // The features are those that the module says it has. With `-O3`, it is as fast and 16 kB larger.
  '-O2',
  // Once more while the module shrinks: it is 2 kB smaller when compressed.
  '--converge',
  // What several branches end with is there once: 0.7 kB less.
  '--code-folding',
  '--strip-debug',
  '--strip-producers',
  '--strip-target-features',
  join(scripts, 'image_gip_bg.wasm'),
  '--output',
  wasm,
);

// What a page loads is few and small files. The worker is one by itself.
const bundle = (names) =>
  build({
    entryPoints: names.map((name) => join(scripts, `${name}.js`)),
    outdir: dist,
    bundle: true,
    splitting: true,
    format: 'esm',
    target: 'es2022',
    minify: true,
    legalComments: 'none',
  });
await bundle(['index', 'core', 'gip-image', 'worker']);
// It is used without the decoder, and shares no file with it: a page would load more and smaller ones.
await bundle(['prefix']);
for (const file of readdirSync(scripts)) {
  if (file.endsWith('.d.ts')) cpSync(join(scripts, file), join(dist, file));
}
// npm packs no links.
for (const file of ['LICENSE-APACHE', 'LICENSE-MIT']) copyFileSync(join(root, file), join(dist, file));
