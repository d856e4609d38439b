// A plug-in for Vite, and all that is built with it: `import hero from './hero.jpg?gip'`.

import { execFile } from 'node:child_process';
import { createHash, randomUUID } from 'node:crypto';
import { mkdir, readFile, rename, rm, writeFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { basename, extname, join, resolve } from 'node:path';
import { promisify } from 'node:util';

import { Cursor, chunksOf, types } from './chunks.js';
import { markup } from './markup.js';

const run = promisify(execFile);

/** Formats that all browsers know: there the picture itself is what is shown without the element. */
const known = { '.jpg': 'image/jpeg', '.jpeg': 'image/jpeg', '.png': 'image/png', '.webp': 'image/webp', '.gif': 'image/gif' };

/** Of these options at most one may be given. */
const targets = ['quality', 'bytes', 'bpp', 'psnr', 'gaussians'];
/** What an import may set, as in `?gip&quality=60`. */
const numbers = [...targets, 'effort', 'texture', 'firstLayer'];
/** The placeholder is a file of its own, whose Gaussians are fitted for it: it shows more than the beginning of the other. */
const placeholderOptions = { bytes: 300, effort: 4 };

/** The options of an import; a target of its own takes the place of another one. */
function optionsOf(query, common) {
  const own = {};
  for (const [name, value] of new URLSearchParams(query)) {
    if (numbers.includes(name)) {
      own[name] = Number(value);
      // Of an empty text it would be 0.
      if (value.trim() === '' || Number.isNaN(own[name])) throw new RangeError(`?gip&${name}=${value}: it must be a number`);
    } else if (name !== 'gip') throw new Error(`?gip&${name}: there is no such option; there are ${numbers}`);
  }
  const hasTarget = targets.some((name) => name in own);
  const kept = Object.entries(common).filter(([name]) => !(hasTarget && targets.includes(name)));
  return { ...Object.fromEntries(kept), ...own };
}

/** Runs the tool. An error is what it says. */
const runTool = (...args) =>
  run('gip', args).catch((cause) => {
    throw new Error(cause.stderr?.trim() || `the tool gip does not run: ${cause.message}`, { cause });
  });

/** Encodes with the tool that is installed. */
async function encodeByTool(source, options, folder) {
  const output = join(folder, `${randomUUID()}.gip`);
  const flags = numbers.filter((name) => options[name] !== undefined).flatMap((name) => {
    const flag = name.replace(/[A-Z]/, (letter) => `-${letter.toLowerCase()}`);
    return [`--${flag}`, String(options[name])];
  });
  try {
    // A page need not tell where a picture was taken, and a placeholder has no room for a profile.
    const metadata = options === placeholderOptions ? 'none' : 'safe';
    await runTool('encode', source, output, '--metadata', metadata, ...flags);
    return await readFile(output);
  } finally {
    await rm(output, { force: true });
  }
}

/** Encodes with WebAssembly, from what the package `sharp` reads: upright, in sRGB, with 8 bits. */
async function encodeByModule(source, options, root) {
  let sharp;
  try {
    // That of the site: nothing else of this package needs it.
    sharp = createRequire(join(root, 'package.json'))('sharp');
  } catch (cause) {
    throw new Error(`to read ${source}, install the npm package sharp, or the tool gip`, { cause });
  }
  const upright = sharp(source).rotate().toColourspace('srgb').raw({ depth: 'uchar' });
  const { data, info } = await upright.toBuffer({ resolveWithObject: true });
  const { encode } = await import('./encoder.js');
  const { width, height, channels } = info;
  return (await encode({ width, height, channels, data: new Uint8Array(data) }, options)).file;
}

/** Whether the tool is there. */
const hasTool = () => runTool('--version').then(() => true, () => false);

/** The size in the header of a file; all that are made here are upright. */
function sizeOf(file) {
  const [{ payload, type }] = chunksOf(file);
  const cursor = new Cursor(payload, type, 1);
  return { width: cursor.number(), height: cursor.number() };
}

/** Whether a file is whole. What lies on a disk for months, and goes from one to another with the caches of builds, may not be. */
function isWhole(file) {
  try {
    const { type, end } = [...chunksOf(file)].at(-1) ?? {};
    return type === types.end && end === file.length;
  } catch {
    return false;
  }
}

/** The plug-in; see the declarations. */
export default function gip({ encoder = 'auto', cache: place, ...common } = {}) {
  const unknown = Object.keys(common).filter((name) => !numbers.includes(name));
  if (unknown.length > 0) throw new TypeError(`there is no option ${unknown}; there are encoder,cache,${numbers}`);
  if (!['auto', 'gip', 'wasm'].includes(encoder)) throw new RangeError(`encoder is ${encoder}; it must be auto, gip or wasm`);
  let [config, cache, byTool] = [null, null, null];
  /** What the development server has: content and type by path. */
  const served = new Map();
  /** Encodings that are under way, so that none is done twice. */
  const running = new Map();

  /** The file of a picture, out of the cache if it was made before. */
  async function encoded(path, original, options) {
    byTool ??= encoder === 'auto' ? hasTool() : Promise.resolve(encoder === 'gip');
    const kind = (await byTool) ? 'gip' : 'wasm';
    const key = createHash('sha256').update(original).update(JSON.stringify([PACKAGE_VERSION, kind, options]));
    const name = `${key.digest('hex').slice(0, 32)}.gip`;
    const stored = join(cache, name);
    const make = async () => {
      const before = await readFile(stored).catch(() => null);
      if (before && isWhole(before)) return before;
      await mkdir(cache, { recursive: true });
      const file = await (kind === 'gip' ? encodeByTool(path, options, cache) : encodeByModule(path, options, config.root));
      // Whole or not at all, whatever happens meanwhile.
      const partial = `${stored}.${randomUUID()}`;
      await writeFile(partial, file);
      await rename(partial, stored);
      return file;
    };
    if (!running.has(name)) running.set(name, make().finally(() => running.delete(name)));
    return running.get(name);
  }

  /** The address of a file as an expression: in what is built, or on the development server. */
  function addressOf(context, name, content, type) {
    if (config.command === 'build') {
      // Vite puts the address there, with its base.
      return `"__VITE_ASSET__${context.emitFile({ type: 'asset', name, source: content })}__"`;
    }
    const hash = createHash('sha256').update(content).digest('hex').slice(0, 16);
    const path = `/@image-gip/${hash}/${encodeURIComponent(name)}`;
    served.set(path, { content, type });
    return JSON.stringify(config.base.replace(/\/$/, '') + path);
  }

  return {
    name: 'image-gip',
    enforce: 'pre',

    configResolved(resolved) {
      config = resolved;
      cache = place ? resolve(config.root, place) : join(config.cacheDir, '.image-gip');
    },

    configureServer(server) {
      server.middlewares.use((request, response, next) => {
        const [path] = request.url.split('?');
        const file = served.get(path.slice(path.indexOf('/@image-gip/')));
        if (!file) return next();
        response.writeHead(200, { 'Content-Type': file.type, 'Content-Length': file.content.length });
        response.end(file.content);
      });
    },

    async load(id) {
      const [path, query] = id.split('?');
      if (!/(^|&)gip(&|=|$)/.test(query ?? '')) return null;
      this.addWatchFile(path);
      const original = await readFile(path);
      const all = [optionsOf(query, common), placeholderOptions];
      const [file, small] = await Promise.all(all.map((options) => encoded(path, original, options)));
      const [name, extension] = [basename(path), extname(path)];
      const type = known[extension.toLowerCase()];
      const facts = { ...sizeOf(file), placeholder: Buffer.from(small).toString('base64') };
      return [
        `const src = ${addressOf(this, `${basename(path, extension)}.gip`, file, 'image/vnd.gip')};`,
        `const fallback = ${type ? addressOf(this, name, original, type) : 'null'};`,
        `const picture = { src, fallback, ...${JSON.stringify(facts)} };`,
        `const of = ${String(markup)};`,
        'export default { ...picture, markup: (attributes) => of(picture, attributes) };',
      ].join('\n');
    },
  };
}
