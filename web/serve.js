// Builds the viewer and serves it on this machine: `node web/serve.js [PORT]`.

import { readFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import { extname, join, normalize } from 'node:path';
import { pathToFileURL } from 'node:url';

import { assemble, buildDecoder } from './build.js';

const types = {
  '.css': 'text/css; charset=utf-8',
  '.gip': 'image/vnd.gip',
  '.html': 'text/html; charset=utf-8',
  '.js': 'text/javascript; charset=utf-8',
  '.md': 'text/plain; charset=utf-8',
  '.svg': 'image/svg+xml',
  '.ts': 'text/plain; charset=utf-8',
  '.wasm': 'application/wasm',
  '.wgsl': 'text/plain; charset=utf-8',
};

/** With these, pages are cross-origin isolated, and pictures are encoded with threads. The page needs nothing else of them. */
const isolation = { 'Cross-Origin-Opener-Policy': 'same-origin', 'Cross-Origin-Embedder-Policy': 'require-corp' };

/**
 * Serves a folder on 127.0.0.1, on any free port by default. `routes` maps further paths to
 * `(request, response) => ...`.
 */
export async function serve(site, { port = 0, routes = {} } = {}) {
  const server = createServer(async (request, response) => {
    try {
      const { pathname } = new URL(request.url, 'http://localhost');
      if (routes[pathname]) {
        await routes[pathname](request, response);
        return;
      }
      const path = normalize(decodeURIComponent(pathname));
      const file = join(site, path.endsWith('/') ? `${path}index.html` : path);
      const content = await readFile(file);
      // A new build is seen at once.
      const type = types[extname(file)] ?? 'application/octet-stream';
      response.writeHead(200, { 'Content-Type': type, 'Cache-Control': 'no-cache', ...isolation }).end(content);
    } catch {
      response.writeHead(404, { 'Content-Type': 'text/plain' }).end('not found');
    }
  });
  await new Promise((resolve, reject) => {
    server.on('error', reject);
    server.listen(port, '127.0.0.1', resolve);
  });
  return {
    origin: `http://127.0.0.1:${server.address().port}`,
    close() {
      server.closeAllConnections();
      return new Promise((resolve) => server.close(resolve));
    },
  };
}

if (import.meta.url === pathToFileURL(process.argv[1]).href) {
  const port = Number(process.argv[2] ?? 8000);
  buildDecoder();
  const { origin } = await serve(assemble(), { port });
  console.log(`The viewer is at ${origin}/ (Ctrl+C ends it).`);
}
