// Builds the package into `dist/`: `npm run build`.
//
// It needs a Rust toolchain with the target wasm32-unknown-unknown, Python, and the npm packages of
// `npm ci`. The command line tool of wasm-bindgen comes from crates.io, in exactly the version that
// Cargo.lock has.

import { execFileSync } from 'node:child_process';
import { copyFileSync, cpSync, existsSync, mkdirSync, readFileSync, readdirSync, rmSync, symlinkSync, writeFileSync } from 'node:fs';
import { homedir } from 'node:os';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { deflateSync } from 'node:zlib';

import { build } from 'esbuild';

const root = dirname(fileURLToPath(import.meta.url));
const target = join(root, 'target');
const dist = join(root, 'dist');
const { version } = JSON.parse(readFileSync(join(root, 'package.json'), 'utf8'));
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

/**
 * What makes the files the same wherever the package is built. By the place of a crate outside of this workspace Cargo names its
 * functions, which then are in another order, so it is found by a link inside; and the compiler calls folders by other names.
 */
const source = join(target, 'source');
mkdirSync(target, { recursive: true });
rmSync(source, { force: true });
// Windows links folders without special rights only this way.
symlinkSync(join(root, '../..'), source, 'junction');
const folders = { [root]: 'image-gip', [process.env.CARGO_HOME ?? join(homedir(), '.cargo')]: 'cargo' };
const renamed = Object.entries(folders).map(([folder, name]) => `--remap-path-prefix=${folder}=${name}`);
const settings = [
  `patch.crates-io.image-gip.path=${JSON.stringify(source)}`,
  `target.wasm32-unknown-unknown.rustflags=${JSON.stringify(renamed)}`,
].flatMap((setting) => ['--config', setting]);

const bindgen = wasmBindgen();
// The scripts beside those of wasm-bindgen, from where they are bundled.
const scripts = join(target, 'scripts');
rmSync(scripts, { recursive: true, force: true });
cpSync(join(root, 'js'), scripts, { recursive: true });
rmSync(dist, { recursive: true, force: true });
mkdirSync(dist);

/**
 * Builds a crate to a module of WebAssembly in `dist/`, and its script to those that are bundled. The module is optimized
 * in so many rounds.
 */
function buildModule(crate, name, rounds, ...optimizations) {
  const place = ['--target', 'wasm32-unknown-unknown', '--target-dir', target];
  // One crate at a time, so that none has what only another one needs.
  run('cargo', 'build', '--release', '--locked', ...settings, '--package', crate, ...place);
  const module = join(target, 'wasm32-unknown-unknown', 'release', `${name}.wasm`);
  run(bindgen, '--target', 'web', '--no-typescript', '--out-dir', scripts, module);
  for (let round = 1; round <= rounds; round += 1) {
    const [from, to] = [round === 1 ? scripts : dist, dist].map((place) => join(place, `${name}_bg.wasm`));
    run(
      join(root, 'node_modules', '.bin', 'wasm-opt'),
      // The features are those that the module says it has.
      ...optimizations,
      // What several branches end with is there once: 0.7 kB less.
      '--code-folding',
      '--strip-debug',
      '--strip-producers',
      ...(round === rounds ? ['--strip-target-features'] : []),
      from,
      '--output',
      to,
    );
  }
}
buildModule(
  'image-gip-wasm',
  'image_gip',
  1,
  // With `-O3`, it is as fast and 16 kB larger; without the second, 0.2 kB.
  '-O2',
  '--shrink-level=1',
  // Once more while the module shrinks: it is 2 kB smaller when compressed.
  '--converge',
);
// All of the above takes a minute; a second round takes seconds, and the module is 2.5 kB smaller.
buildModule('image-gip-wasm-encoder', 'image_gip_encoder', 2, '-O1');

const minified = { bundle: true, target: 'es2022', minify: true, legalComments: 'none' };
const paths = (names) => names.map((name) => join(scripts, `${name}.js`));

/** Takes the scripts of a folder in place of those of the same name. */
const instead = (folder) => ({
  name: folder,
  setup(build) {
    build.onResolve({ filter: /^\.\/[\w-]+\.js$/ }, ({ path, importer }) => {
      const other = join(scripts, folder, path);
      return existsSync(other) && dirname(importer) === scripts ? { path: other } : undefined;
    });
  },
});

/** A script in one piece, which needs no other file: what a worker runs. */
async function workerText(name, platform, ...plugins) {
  const format = platform === 'node' ? 'cjs' : 'iife';
  const all = [instead('received'), ...plugins];
  const options = { entryPoints: paths([name]), write: false, format, platform, plugins: all, define: noFiles };
  const { outputFiles } = await build({ ...minified, ...options });
  return outputFiles[0].text;
}

/** What a bundler would take for the name of a file is not in scripts that need none. */
const noFiles = { 'import.meta.url': 'undefined' };

/** Modules `embedded:...`: workers as text, and WebAssembly as `js/embedded/compile.js` takes it. */
const embedded = (workers) => ({
  name: 'embedded',
  setup(build) {
    const onlyTheName = ({ path }) => ({ path: path.slice('embedded:'.length), namespace: 'embedded' });
    build.onResolve({ filter: /^embedded:/ }, onlyTheName);
    build.onLoad({ filter: /\.js$/, namespace: 'embedded' }, ({ path }) => ({ contents: workers[path], loader: 'text' }));
    build.onLoad({ filter: /\.wasm$/, namespace: 'embedded' }, ({ path }) => {
      const file = deflateSync(readFileSync(join(dist, path)), { level: 9 });
      return { contents: file.toString('base64'), loader: 'text' };
    });
  },
});

// What a page loads without a bundler is few and small files. The worker is one by itself.
const bundle = (names, options = {}) =>
  build({ ...minified, entryPoints: paths(names), outdir: dist, splitting: true, format: 'esm', ...options });
await bundle(['index', 'core', 'gip-image', 'worker']);
await bundle(['encoder', 'encoder-core', 'encoder-worker'], { chunkNames: 'encoder-[hash]' });
// They are used without the decoder, and share no file with it: a page would load more and smaller ones.
await bundle(['prefix']);
await bundle(['transparent']);
await bundle(['img']);
// The decoder that it takes is the file of the page.
const besideCore = {
  name: 'beside core',
  setup(build) {
    build.onResolve({ filter: /^\.\/core\.js$/ }, ({ path }) => ({ path, external: true }));
  },
};
await bundle(['print'], { plugins: [besideCore] });
await bundle(['print'], { plugins: [besideCore], outdir: join(dist, 'embedded') });
// A service worker is one script of the old kind, which all browsers take.
writeFileSync(join(dist, 'service-worker.js'), await workerText('service-worker', 'browser'));

// What bundlers take needs no file beside it, wherever they put it.
const worker = await workerText('worker', 'browser');
await bundle(['index', 'core', 'gip-image', 'encoder', 'encoder-core'], {
  outdir: join(dist, 'embedded'),
  define: noFiles,
  plugins: [
    instead('embedded'),
    embedded({ 'worker.js': worker, 'encoder-worker.js': await workerText('encoder-worker', 'browser') }),
  ],
});
await bundle(['encoder', 'vite'], {
  outdir: join(dist, 'node'),
  platform: 'node',
  define: { ...noFiles, PACKAGE_VERSION: JSON.stringify(version) },
  plugins: [
    instead('node'),
    embedded({ 'encoder-worker.js': await workerText('encoder-worker', 'node', instead('node')) }),
  ],
});

for (const file of readdirSync(scripts)) {
  if (/\.(d\.ts|json)$/.test(file)) cpSync(join(scripts, file), join(dist, file));
}
// npm packs no links.
for (const file of ['LICENSE-APACHE', 'LICENSE-MIT']) copyFileSync(join(root, file), join(dist, file));
// What else the files depend on, besides the source and the versions that are locked.
const rustc = execFileSync('rustc', ['--version'], { cwd: root }).toString().trim();
writeFileSync(join(dist, 'built-with.json'), `${JSON.stringify({ rustc, node: process.version })}\n`);
const crates = ['--locked', '--target', 'wasm32-unknown-unknown'];
run('python3', '../../packaging/notices', join(dist, 'LICENSE-THIRD-PARTY'), ...crates);
