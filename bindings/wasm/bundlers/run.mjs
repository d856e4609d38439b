// Builds a small page with each bundler, and loads it in Chromium: `npm run bundlers`, or with some of the names below.
//
// The versions are fixed. Each project is built in a folder of its own outside of this one, from the package as npm
// would publish it, and served from a folder below the root. What cannot be installed is skipped, and said to be.

import { execFileSync, spawn } from 'node:child_process';
import { cpSync, existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { tmpdir } from 'node:os';
import { dirname, extname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

import { launch } from '../tests/browser.js';
import { checks } from './site-checks.mjs';

const here = dirname(fileURLToPath(import.meta.url));
const root = dirname(here);

const vite = (version) => ({
  files: 'vite',
  needs: { vite: version },
  build: ['vite', 'build', '--base', './'],
  output: 'dist',
  develop: ['vite', '--host', '127.0.0.1', '--port', '0', '--strictPort'],
});

/** Whether the package was built with threads. */
const hasThreads = existsSync(join(root, 'dist', 'encoder-threads.js'));

/** Ten pictures that the plug-in for Vite encodes. */
const site = (version) => ({
  ...vite(version),
  files: 'site',
  needs: { vite: version, sharp: '0.35.5' },
  prepare: ['pictures.mjs'],
  expects: 'shown 11 pictures, layout shift 0',
  isVisited: true,
});

const projects = {
  // Without a bundler: the files of the package, in any folder.
  'script-tags': { files: 'files', needs: {}, output: '.', copies: 'lib' },
  // The types of all modules, and of the element in templates; nothing is run.
  types: {
    files: 'types',
    needs: {
      typescript: '7.0.2',
      '@types/react': '19.3.3',
      react: '19.3.1',
      preact: '10.29.8',
      vue: '3.5.45',
      svelte: '5.57.3',
    },
    build: ['tsc'],
  },
  'vite-6': vite('6.4.6'),
  'vite-7': vite('7.3.8'),
  'vite-8': vite('8.3.8'),
  site: site('7.3.8'),
  'site-8': site('8.3.8'),
  'webpack-5': {
    files: 'webpack',
    needs: { webpack: '5.113.0', 'webpack-cli': '7.3.1' },
    build: ['webpack'],
    output: 'dist',
    page: 'main.js',
  },
  esbuild: {
    files: 'common',
    needs: { esbuild: '0.28.2' },
    build: ['esbuild', 'main.js', '--bundle', '--format=esm', '--outfile=dist/main.js'],
    output: 'dist',
    page: 'main.js',
  },
  'next-16': {
    files: 'next',
    needs: { next: '16.4.6', react: '19.3.1', 'react-dom': '19.3.1' },
    build: ['next', 'build'],
    output: 'out',
    // Its pages name their scripts from the root.
    base: '/',
    server: true,
  },
  astro: {
    files: 'astro',
    needs: { astro: '5.18.2' },
    build: ['astro', 'build'],
    output: 'dist',
    base: '/',
    server: true,
  },
};

const types = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css', '.wasm': 'application/wasm' };

/** Serves a folder at a path. With `?isolated`, pages may have threads. */
async function serve(folder, base) {
  const server = createServer((request, response) => {
    const { pathname, search } = new URL(request.url, 'http://localhost');
    const path = pathname.startsWith(base) ? pathname.slice(base.length) || 'index.html' : null;
    if (pathname === '/favicon.ico') return void response.writeHead(204).end();
    if (path === null || !existsSync(join(folder, path))) return void response.writeHead(404).end();
    const isPage = extname(path) === '.html';
    if (!isPage || search === '?isolated') response.setHeader('Cross-Origin-Embedder-Policy', 'require-corp');
    if (isPage && search === '?isolated') response.setHeader('Cross-Origin-Opener-Policy', 'same-origin');
    response.writeHead(200, { 'Content-Type': types[extname(path)] ?? 'application/octet-stream' });
    response.end(readFileSync(join(folder, path)));
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  return { url: `http://127.0.0.1:${server.address().port}${base}`, close: () => server.close() };
}

/** Starts a development server, and finds out where it is. */
async function develop(folder, [program, ...args]) {
  const child = spawn(join(folder, 'node_modules', '.bin', program), args, { cwd: folder });
  let output = '';
  const url = await new Promise((resolve, reject) => {
    child.stdout.on('data', (data) => {
      // Without the codes of colours.
      output += String(data).replace(/\x1b\[\d+m/g, '');
      const match = /http:\/\/127\.0\.0\.1:\d+\//.exec(output);
      if (match) resolve(match[0]);
    });
    child.on('exit', () => reject(new Error(output)));
  });
  return { url, close: () => child.kill() };
}

/** Loads a page, and waits for its title. Throws if it does not show the picture, logs an error, or has too few workers. */
async function load(browser, url, expects, least = 1) {
  const page = await browser.newPage();
  const errors = [];
  page.on('pageerror', (error) => errors.push(error.message));
  page.on('console', (message) => message.type() === 'error' && errors.push(`${message.text()} ${message.location().url}`));
  try {
    await page.goto(url);
    await page.waitForFunction(() => /^(shown|failed)/.test(document.title), null, { timeout: 60_000 });
    const [title, workers] = [await page.title(), page.workers().length];
    if (!title.startsWith(expects)) errors.push(title);
    if (workers < least) errors.push(`there are ${workers} workers`);
    if (errors.length > 0) throw new Error(errors.join('; '));
    return `${title}, with ${workers} workers`;
  } finally {
    await page.close();
  }
}

function install(folder, needs, packed) {
  cpSync(join(here, 'projects', 'common'), folder, { recursive: true });
  const dependencies = { ...needs, 'image-gip': `file:${packed}` };
  writeFileSync(join(folder, 'package.json'), JSON.stringify({ private: true, type: 'module', dependencies }));
  execFileSync('npm', ['install', '--no-audit', '--no-fund'], { cwd: folder, stdio: 'pipe' });
}

async function test(browser, name, packed, scratch) {
  const { files, needs, prepare, build, output, copies, page, base = '/some/where/', server = false } = projects[name];
  const { develop: start, expects = 'shown 64 x 48', isVisited = false } = projects[name];
  const encodes = expects === 'shown 64 x 48';
  const folder = join(scratch, name);
  cpSync(join(here, 'projects', files), folder, { recursive: true });
  try {
    install(folder, needs, packed);
  } catch (error) {
    console.log(`skipped: ${name} cannot be installed: ${String(error.stderr).trim().split('\n')[0]}`);
    return;
  }
  if (prepare) execFileSync('node', prepare, { cwd: folder, stdio: 'pipe' });
  if (build) {
    const [program, ...args] = build;
    const env = { ...process.env, NEXT_TELEMETRY_DISABLED: '1', ASTRO_TELEMETRY_DISABLED: '1' };
    execFileSync(join(folder, 'node_modules', '.bin', program), args, { cwd: folder, stdio: 'pipe', env });
  }
  if (copies) cpSync(join(folder, 'node_modules', 'image-gip', 'dist'), join(folder, copies), { recursive: true });
  if (!output) return void console.log(`${name}: no errors`);
  const place = join(folder, output);
  if (page) writeFileSync(join(place, 'index.html'), `<!doctype html><title>test</title><script type="module" src="./${page}"></script>`);
  if (server && !readFileSync(join(place, 'index.html'), 'utf8').includes('From the server')) {
    throw new Error('the element is not in what the server renders');
  }
  const built = await serve(place, base);
  console.log(`${name}: ${await load(browser, built.url, expects)}`);
  // One decodes, and two are threads of the encoder.
  if (encodes && hasThreads) console.log(`${name}, isolated: ${await load(browser, `${built.url}?isolated`, expects, 3)}`);
  if (isVisited) {
    for await (const line of checks(browser, built.url, place)) console.log(`${name}: ${line}`);
  }
  built.close();
  if (start) {
    const served = await develop(folder, start);
    try {
      console.log(`${name}, development: ${await load(browser, served.url, expects)}`);
    } finally {
      served.close();
    }
  }
}

const chosen = process.argv.slice(2);
const unknown = chosen.filter((name) => !Object.hasOwn(projects, name));
if (unknown.length > 0) throw new Error(`there is no ${unknown}; there are ${Object.keys(projects)}`);
const scratch = mkdtempSync(join(tmpdir(), 'image-gip-'));
const browser = await launch();
let failed = false;
try {
  const packs = execFileSync('npm', ['pack', '--json', '--pack-destination', scratch], { cwd: root });
  const packed = join(scratch, JSON.parse(packs)[0].filename);
  for (const name of chosen.length > 0 ? chosen : Object.keys(projects)) {
    try {
      await test(browser, name, packed, scratch);
    } catch (error) {
      failed = true;
      console.log(`failed: ${name}: ${error.message}\n${error.stdout ?? ''}${error.stderr ?? ''}`);
    }
  }
} finally {
  await browser.close();
  rmSync(scratch, { recursive: true, force: true });
}
process.exit(failed ? 1 : 0);
