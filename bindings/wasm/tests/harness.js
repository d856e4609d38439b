// A browser and a server for a file of tests.

import { after, before } from 'node:test';

import { launch } from './browser.js';
import { serve } from './server.js';

export { slow } from './server.js';

export const harness = { browser: null, server: null, routes: {} };

before(async () => {
  harness.server = await serve(harness.routes);
  harness.browser = await launch();
});

after(async () => {
  await harness.browser?.close();
  await harness.server?.close();
});

let pages = 0;

/**
 * Runs a test on a page with this HTML. Errors that nobody catches, and what the page logs as an
 * error, fail the test, unless `quiet` allows them.
 */
export async function withPage(html, run, { headers = {}, context: options = {}, quiet = false } = {}) {
  const { browser, server, routes } = harness;
  const path = `/page-${(pages += 1)}`;
  routes[path] = (_, response) => {
    response.writeHead(200, { 'Content-Type': 'text/html; charset=utf-8', ...headers });
    response.end(`<!doctype html><html lang="en"><title>test</title>${html}`);
  };
  const context = await browser.newContext({ viewport: { width: 800, height: 600 }, ...options });
  const errors = [];
  try {
    const page = await context.newPage();
    page.setDefaultTimeout(20_000);
    page.on('pageerror', (error) => errors.push(error.message));
    page.on('console', (message) => message.type() === 'error' && errors.push(message.text()));
    await page.goto(server.origin + path, { waitUntil: 'commit' });
    await page.waitForFunction(() => document.readyState !== 'loading');
    const result = await run(page);
    if (errors.length > 0 && !quiet) throw new Error(`on the page: ${errors.join('; ')}`);
    return result;
  } finally {
    await context.close();
  }
}

/** Runs a function on a page, with the package as its first argument. */
export function inPage(run, argument, options) {
  return withPage(
    '',
    (page) =>
      page.evaluate(
        async ([source, argument]) => {
          const gip = await import('/dist/index.js');
          return await eval(`(${source})`)(gip, argument);
        },
        [String(run), argument],
      ),
    options,
  );
}

export const script = '<script type="module" src="/dist/gip-image.js"></script>';

/** Waits for `load` or `error` of an element that has not begun, or is complete already. */
export function settled(page, selector = 'gip-image') {
  return page.evaluate(async (selector) => {
    await customElements.whenDefined('gip-image');
    const element = document.querySelector(selector);
    if (element.complete) return;
    await new Promise((resolve) => {
      element.addEventListener('load', resolve);
      element.addEventListener('error', resolve);
    });
  }, selector);
}

/** A route that answers with a file at once. */
export function file(bytes, headers = {}) {
  return (_, response) => {
    response.writeHead(200, { 'Content-Type': 'image/gip', 'Content-Length': bytes.length, ...headers });
    response.end(bytes);
  };
}

const pause = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));

/** Waits until a condition holds. */
export async function until(condition, what) {
  for (let tries = 0; tries < 1200; tries += 1) {
    if (await condition()) return;
    await pause(25);
  }
  throw new Error(`${what} did not happen within half a minute`);
}
