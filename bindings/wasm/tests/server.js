// The server of the browser tests: the package, the test vectors, and routes of the test's own.

import { readFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import { extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';

const root = fileURLToPath(new URL('..', import.meta.url));
const vectors = fileURLToPath(new URL('../../../spec/vectors', import.meta.url));

const types = {
  '.html': 'text/html; charset=utf-8',
  '.js': 'text/javascript; charset=utf-8',
  '.wasm': 'application/wasm',
  '.tsv': 'text/plain; charset=utf-8',
  '.gip': 'image/vnd.gip',
};

/** Starts a server on a free port. `routes` maps paths to `(request, response) => ...`. */
export async function serve(routes = {}) {
  const server = createServer(async (request, response) => {
    const path = new URL(request.url, 'http://localhost').pathname;
    if (routes[path]) {
      await routes[path](request, response);
      return;
    }
    if (path === '/favicon.ico') return void response.writeHead(204).end();
    const safe = normalize(path);
    const file = safe.startsWith('/vectors/') ? join(vectors, safe.slice(9)) : join(root, safe);
    try {
      const content = await readFile(file);
      const type = types[extname(file)] ?? 'text/plain';
      // Isolated pages start workers of scripts that ask for it as well.
      const isolation = { 'Cross-Origin-Embedder-Policy': 'require-corp' };
      response.writeHead(200, { 'Content-Type': type, 'Access-Control-Allow-Origin': '*', ...isolation });
      response.end(content);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  return {
    routes,
    origin: `http://127.0.0.1:${server.address().port}`,
    close() {
      server.closeAllConnections();
      return new Promise((resolve) => server.close(resolve));
    },
  };
}

const pause = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));

/**
 * A slow server of one file. `sent` counts the bytes that it has sent, `requests` has the ranges that
 * were asked for. It sends `piece` bytes, and then waits for `interval` milliseconds or for `gate`.
 */
export function slow(bytes, { piece = 8192, interval = 5, ranges = true, gate = null } = {}) {
  const log = { sent: 0, requests: [], open: 0 };
  const route = async (request, response) => {
    const range = /^bytes=(\d+)-$/.exec(request.headers.range ?? '');
    log.requests.push(request.headers.range ?? null);
    const start = ranges && range ? Number(range[1]) : 0;
    const headers = { 'Content-Type': 'image/gip', ETag: '"1"', 'Cache-Control': 'no-store' };
    if (ranges && range) {
      headers['Content-Range'] = `bytes ${start}-${bytes.length - 1}/${bytes.length}`;
    }
    response.writeHead(ranges && range ? 206 : 200, headers);
    log.open += 1;
    let closed = false;
    const end = new Promise((resolve) => response.on('close', resolve)).then(() => {
      closed = true;
      log.open -= 1;
    });
    for (let at = start; at < bytes.length && !closed; at += piece) {
      const part = bytes.subarray(at, at + piece);
      log.sent += part.length;
      await Promise.race([new Promise((resolve) => response.write(part, resolve)), end]);
      await (gate?.(log.sent) ?? pause(interval));
    }
    response.end();
  };
  return { route, log };
}
