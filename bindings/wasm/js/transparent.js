// Makes `.gip` a format of the browser's own on a site, by a service worker; see the declarations.

const isGip = (address) => /\.gip($|[?#])/i.test(address);

/** Has the pictures fetched once more that came before there was a service worker. */
function again() {
  for (const image of document.images) {
    if (isGip(image.currentSrc || image.src) && image.naturalWidth === 0) {
      // A `<source>` is chosen anew when anything of it changes.
      image.src = image.getAttribute('src') ?? '';
    }
  }
  for (const sheet of document.querySelectorAll('link[rel~="stylesheet"], style')) {
    const copy = sheet.cloneNode(true);
    // The old one goes when the new one is there, so that the page is never without.
    if (sheet.localName === 'link') copy.addEventListener('load', () => sheet.remove(), { once: true });
    sheet.after(copy);
    if (sheet.localName === 'style') sheet.remove();
  }
}

export async function install(script = '/service-worker.js', options = {}) {
  const { serviceWorker } = navigator;
  if (!serviceWorker) throw new Error('there are no service workers here: they need https:, and no private window of Firefox');
  const address = new URL(script, document.baseURI);
  address.searchParams.set('wasm', new URL(options.wasm ?? './image_gip_bg.wasm', options.wasm ? document.baseURI : import.meta.url).href);
  const wasControlled = serviceWorker.controller !== null;
  const registration = await serviceWorker.register(address, { scope: options.scope });
  if (wasControlled) return registration;
  if (!serviceWorker.controller) {
    await new Promise((resolve) => serviceWorker.addEventListener('controllerchange', resolve, { once: true }));
  }
  again();
  return registration;
}
