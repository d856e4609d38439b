// A service worker that makes `.gip` a format of the browser's own: wherever a page shows a picture whose address ends
// in `.gip`, in `<img>`, `<picture>`, styles or SVG, the browser gets a PNG. `transparent.js` installs it.

import { Decoder, load } from './core.js';
import { pieces } from './source.js';

const wasm = new URLSearchParams(location.search).get('wasm') ?? 'image_gip_bg.wasm';

/** The picture of a response, upright and in its own size, as PNG. */
async function pngOf(response) {
  await load(new URL(wasm, location));
  const decoder = new Decoder();
  let png;
  try {
    try {
      for await (const bytes of pieces(response.body)) decoder.feed(bytes);
      decoder.finish();
    } catch (error) {
      // As browsers do, it shows the part that has arrived.
      if (!(decoder.progress.gaussians > 0)) throw error;
    }
    png = await decoder.png();
  } finally {
    decoder.close();
  }
  return new Response(png, { headers: { 'Content-Type': 'image/png' } });
}

async function answer(request) {
  // What a page may show without asking, a script may not read: of another origin, it asks.
  const isForeign = request.mode === 'no-cors' && new URL(request.url).origin !== location.origin;
  const response = await fetch(isForeign ? new Request(request.url, { mode: 'cors', credentials: 'omit' }) : request);
  if (!response.ok) return response;
  const copy = response.clone();
  try {
    return await pngOf(response);
  } catch {
    // It may be a picture of another kind, whatever it is called.
    return copy;
  }
}

addEventListener('install', () => skipWaiting());
for (const type of ['activate', 'message']) addEventListener(type, (event) => event.waitUntil(clients.claim()));
addEventListener('fetch', (event) => {
  const { request } = event;
  // `<gip-image>` and other scripts get the file itself.
  const isPicture = request.destination === 'image' && /\.gip$/i.test(new URL(request.url).pathname);
  if (isPicture) event.respondWith(answer(request));
});
