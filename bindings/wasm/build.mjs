// Builds the package into `dist/`: `npm run build`. To test all the rest, `npm run build -- --without-threads` leaves out the
// encoder with threads, which takes more time than everything else; such a package is not published.
//
// It needs a Rust toolchain with the target wasm32-unknown-unknown and the component rust-src, Python, and the npm packages
// of `npm ci`. The command line tool of wasm-bindgen comes from crates.io, in exactly the version that Cargo.lock has.

import { execFileSync } from 'node:child_process';
import { copyFileSync, cpSync, existsSync, mkdirSync, readFileSync, readdirSync, realpathSync, rmSync, symlinkSync, writeFileSync } from 'node:fs';
import { homedir, tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { deflateSync } from 'node:zlib';

import { build } from 'esbuild';

const root = dirname(fileURLToPath(import.meta.url));
const target = join(root, 'target');
const dist = join(root, 'dist');
const { version } = JSON.parse(readFileSync(join(root, 'package.json'), 'utf8'));
const run = (program, ...args) => execFileSync(program, args, { cwd: root, stdio: 'inherit' });
const told = (program, ...args) => execFileSync(program, args, { cwd: root, encoding: 'utf8' });

const hasThreads = !process.argv.includes('--without-threads');
/** The standard library's source, of which one is made for threads: that which comes with the compiler has none. */
const rust = join(told('rustc', '--print', 'sysroot').trim(), 'lib/rustlib/src/rust');
if (hasThreads && !existsSync(join(rust, 'library'))) {
  console.error('The encoder with threads needs the source of the standard library: rustup component add rust-src');
  process.exit(1);
}

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
const linked = (name, folder) => linkTo(join(target, name), folder);

/** A link to a folder, which may be there from an earlier build, or for another one that runs. */
function linkTo(link, folder) {
  const isThere = existsSync(link) && realpathSync(link) === realpathSync(folder);
  if (isThere) return link;
  rmSync(link, { force: true });
  // Windows links folders without special rights only this way.
  symlinkSync(folder, link, 'junction');
  return link;
}

/**
 * The standard library's source. Cargo names its crates by the whole path, so that it needs one that is the same for all
 * copies of this folder.
 */
const compiler = told('rustc', '--version', '--verbose').match(/^commit-hash: (.*)$/m)[1];
const library = join(tmpdir(), `image-gip-rust-${compiler}`);
mkdirSync(target, { recursive: true });
const source = linked('source', join(root, '../..'));
const folders = {
  [root]: 'image-gip',
  [process.env.CARGO_HOME ?? join(homedir(), '.cargo')]: 'cargo',
  // By this name the compiler calls it where it is not installed.
  [rust]: `/rustc/${compiler}`,
  [library]: `/rustc/${compiler}/library`,
};
const renamed = Object.entries(folders).map(([folder, name]) => `--remap-path-prefix=${folder}=${name}`);
const configured = (settings) => Object.entries(settings).flatMap(([name, value]) => ['--config', `${name}=${JSON.stringify(value)}`]);

const bindgen = wasmBindgen();
// The scripts beside those of wasm-bindgen, from where they are bundled.
const scripts = join(target, 'scripts');
rmSync(scripts, { recursive: true, force: true });
cpSync(join(root, 'js'), scripts, { recursive: true });
rmSync(dist, { recursive: true, force: true });
mkdirSync(dist);

/**
 * Builds a crate to a module of WebAssembly in `dist/`, and its script to those that are bundled. The module is optimized
 * in so many rounds. `flags` are for the compiler, `options` for Cargo, which builds in `folder`.
 */
function buildModule(crate, name, rounds, optimizations, { flags = [], options = [], env = {}, folder = target } = {}) {
  const place = ['--target', 'wasm32-unknown-unknown', '--target-dir', folder];
  const settings = configured({
    'patch.crates-io.image-gip.path': source,
    'target.wasm32-unknown-unknown.rustflags': [...renamed, ...flags],
  });
  // One crate at a time, so that none has what only another one needs.
  const args = ['build', '--release', '--locked', ...settings, '--package', crate, ...place, ...options];
  execFileSync('cargo', args, { cwd: root, stdio: 'inherit', env: { ...process.env, ...env } });
  const module = join(folder, 'wasm32-unknown-unknown', 'release', `${name}.wasm`);
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
buildModule('image-gip-wasm', 'image_gip', 1, [
  // With `-O3`, it is as fast and 16 kB larger; without the second, 0.2 kB.
  '-O2',
  '--shrink-level=1',
  // Once more while the module shrinks: it is 2 kB smaller when compressed.
  '--converge',
]);
// All of the above takes a minute; a second round takes seconds, and the module is 2.5 kB smaller.
buildModule('image-gip-wasm-encoder', 'image_gip_encoder', 2, ['-O1']);
/** Memory that is imported and shared, and of what wasm-bindgen makes the stack and the variables of each thread. */
const shared = [
  '--shared-memory',
  '--import-memory',
  ...['__wasm_init_tls', '__tls_size', '__tls_align', '__tls_base'].map((name) => `--export=${name}`),
];
if (hasThreads) {
  buildModule('image-gip-wasm-encoder-threads', 'image_gip_encoder_threads', 2, ['-O1'], {
    flags: ['-Ctarget-feature=+atomics,+bulk-memory,+mutable-globals', ...shared.map((option) => `-Clink-arg=${option}`)],
    // With the features of the standard library, it would have what prints a backtrace.
    options: ['-Zbuild-std=std,panic_abort', '-Zbuild-std-features='],
    env: {
      // So the compiler takes what is for nightly ones only, and all modules are made by the same one.
      RUSTC_BOOTSTRAP: '1',
      __CARGO_TESTS_ONLY_SRC_ROOT: linkTo(library, join(rust, 'library')),
    },
    // Crates that find out what the compiler takes are not the same as for the other modules.
    folder: join(target, 'threads'),
  });
}

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

/** Takes the encoder with threads in place of the one without. */
const withThreads = {
  name: 'with threads',
  setup(build) {
    const path = join(scripts, 'image_gip_encoder_threads.js');
    build.onResolve({ filter: /^\.\/image_gip_encoder\.js$/ }, () => ({ path }));
  },
};

/** What leaves out the threads, if they are. */
const chosen = hasThreads ? [] : [instead('without-threads')];

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
const threads = hasThreads ? ['encoder-threads'] : [];
await bundle(['encoder', 'encoder-core', 'encoder-worker', ...threads], { chunkNames: 'encoder-[hash]', plugins: chosen });
if (hasThreads) await bundle(['encoder-threads-worker'], { plugins: [withThreads] });
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
    ...chosen,
    instead('embedded'),
    embedded({
      'worker.js': worker,
      'encoder-worker.js': await workerText('encoder-worker', 'browser'),
      ...(hasThreads && { 'encoder-threads-worker.js': await workerText('encoder-threads-worker', 'browser', withThreads) }),
    }),
  ],
});
await bundle(['encoder', 'vite'], {
  outdir: join(dist, 'node'),
  platform: 'node',
  define: { ...noFiles, PACKAGE_VERSION: JSON.stringify(version) },
  plugins: [
    ...chosen,
    instead('node'),
    embedded({
      'encoder-worker.js': await workerText('encoder-worker', 'node', instead('node')),
      ...(hasThreads && {
        'encoder-threads-worker.js': await workerText('encoder-threads-worker', 'node', withThreads, instead('node')),
      }),
    }),
  ],
});

for (const file of readdirSync(scripts)) {
  if (/\.(d\.ts|json)$/.test(file)) cpSync(join(scripts, file), join(dist, file));
}
// npm packs no links.
for (const file of ['LICENSE-APACHE', 'LICENSE-MIT']) copyFileSync(join(root, file), join(dist, file));
// What else the files depend on, besides the source and the versions that are locked.
const rustc = told('rustc', '--version').trim();
writeFileSync(join(dist, 'built-with.json'), `${JSON.stringify({ rustc, node: process.version })}\n`);
const crates = ['--locked', '--target', 'wasm32-unknown-unknown'];
run('python3', '../../packaging/notices', join(dist, 'LICENSE-THIRD-PARTY'), ...crates);
