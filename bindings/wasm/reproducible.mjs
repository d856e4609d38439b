// Builds the package twice, in two copies of the working tree, and compares all files: `npm run reproducible`. The copies are
// in folders of different names, and Cargo's own folder has two names. With the folder of an installed package, its files are
// compared as well:
//
//     npm run reproducible -- node_modules/image-gip
//
// It takes minutes.

import { execFileSync } from 'node:child_process';
import { createHash } from 'node:crypto';
import { cpSync, mkdirSync, mkdtempSync, readFileSync, readdirSync, rmSync, symlinkSync } from 'node:fs';
import { homedir, tmpdir } from 'node:os';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const root = join(here, '../..');
const installed = process.argv[2];
const cargoHome = process.env.CARGO_HOME ?? join(homedir(), '.cargo');

/** The hash of each file below a folder. */
function hashesOf(folder) {
  const names = readdirSync(folder, { recursive: true, withFileTypes: true })
    .filter((entry) => entry.isFile())
    .map((entry) => join(entry.parentPath ?? entry.path, entry.name).slice(folder.length + 1));
  const hash = (name) => createHash('sha256').update(readFileSync(join(folder, name))).digest('hex');
  return new Map(names.sort().map((name) => [name, hash(name)]));
}

/** Copies the working tree to a folder, which must not be there yet. */
function copyTo(folder) {
  const files = execFileSync('git', ['ls-files', '-z', '--cached', '--others', '--exclude-standard'], { cwd: root });
  for (const name of files.toString().split('\0').filter(Boolean)) cpSync(join(root, name), join(folder, name));
}

/** What the package is built to in a copy. */
function built(folder) {
  const place = join(folder, 'bindings/wasm');
  // The tool of wasm-bindgen is a program, which nothing depends on but by what it does: it need not be built twice.
  for (const tool of readdirSync(join(here, 'target')).filter((name) => /^wasm-bindgen-[\d.]+$/.test(name))) {
    cpSync(join(here, 'target', tool), join(place, 'target', tool), { recursive: true });
  }
  symlinkSync(cargoHome, join(folder, 'cargo'));
  const { CARGO_TARGET_DIR: _, ...env } = process.env;
  const options = { cwd: place, stdio: ['ignore', 'ignore', 'inherit'], env: { ...env, CARGO_HOME: join(folder, 'cargo') } };
  execFileSync('npm', ['ci', '--silent'], options);
  execFileSync('npm', ['run', '--silent', 'build'], options);
  return hashesOf(join(place, 'dist'));
}

mkdirSync(join(here, 'target'), { recursive: true });
const scratch = mkdtempSync(join(tmpdir(), 'image-gip-'));
const copies = ['one', 'another/and-longer'].map((name) => join(scratch, name));
for (const folder of copies) copyTo(folder);
const [first, second] = copies.map(built);
const others = { 'the second copy': second };
if (installed) others[installed] = hashesOf(join(resolve(installed), 'dist'));
let differences = 0;
for (const [other, hashes] of Object.entries(others)) {
  for (const name of new Set([...first.keys(), ...hashes.keys()])) {
    if (first.get(name) === hashes.get(name)) continue;
    differences += 1;
    console.error(`${name} is another one in ${other}`);
  }
}
if (differences > 0) {
  console.error(`the copies are in ${scratch}`);
  process.exit(1);
}
rmSync(scratch, { recursive: true });
for (const [name, hash] of first) console.log(`${hash}  ${name}`);
console.log(`${first.size} files are the same`);
