// Makes `.gip` a format of the browser's own on a site, by a service worker; see the declarations.

const isGip = (address) => /\.gip($|[?#])/i.test(address);

/** Elements with pictures beside `<img>`, and the attribute that has the address. */
const attributes = { input: 'src', video: 'poster', image: 'href', feImage: 'href' };

/** The document, and the open shadow trees in it. */
function* rootsIn(root) {
  yield root;
  for (const { shadowRoot } of root.querySelectorAll('*')) if (shadowRoot) yield* rootsIn(shadowRoot);
}

/** The rules of a style sheet; `null` if it is of another origin, and does not tell. */
function rulesOf(sheet) {
  try {
    return sheet.cssRules;
  } catch {
    return null;
  }
}

/** The declarations of rules, and of those inside them and in the sheets that they import. */
function* declarationsIn(rules) {
  for (const { style, styleSheet, cssRules } of rules ?? []) {
    if (style) yield style;
    if (styleSheet) yield* declarationsIn(rulesOf(styleSheet));
    if (cssRules) yield* declarationsIn(cssRules);
  }
}

/** All declarations in a tree. */
function* declarationsOf(root) {
  for (const sheet of [...root.styleSheets, ...root.adoptedStyleSheets]) yield* declarationsIn(rulesOf(sheet));
  for (const { style } of root.querySelectorAll('[style*=".gip" i]')) yield style;
}

/** Has styles ask for their pictures once more: that takes values that were away. The rest of a style sheet may be a script's. */
function renew(roots) {
  const restore = [];
  for (const style of roots.flatMap((root) => [...declarationsOf(root)])) {
    for (const name of [...style]) {
      const value = style.getPropertyValue(name);
      if (!isGip(value.replaceAll(/["')]/g, '?'))) continue;
      const priority = style.getPropertyPriority(name);
      restore.push(() => style.setProperty(name, value, priority));
      style.removeProperty(name);
    }
  }
  // The styles follow at once.
  for (const element of document.querySelectorAll('*')) void getComputedStyle(element).backgroundImage;
  for (const set of restore) set();
}

/** Has the pictures fetched once more that came before there was a service worker. */
function again() {
  const roots = [...rootsIn(document)];
  for (const root of roots) {
    for (const image of root.querySelectorAll('img')) {
      if (isGip(image.currentSrc || image.src) && image.naturalWidth === 0) {
        // A `<source>` is chosen anew when anything of it changes.
        image.src = image.getAttribute('src') ?? '';
      }
    }
    for (const [name, attribute] of Object.entries(attributes)) {
      for (const element of root.querySelectorAll(`${name}[${attribute}*=".gip" i]`)) {
        element.setAttribute(attribute, element.getAttribute(attribute));
      }
    }
  }
  renew(roots);
  for (const sheet of document.querySelectorAll('link[rel~="stylesheet"]')) {
    if (!sheet.sheet || rulesOf(sheet.sheet)) continue;
    const copy = sheet.cloneNode(true);
    // The old one goes when the new one is there, so that the page is never without.
    copy.addEventListener('load', () => sheet.remove(), { once: true });
    sheet.after(copy);
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
  const { scope } = registration;
  // Nothing would come of waiting.
  if (!location.href.startsWith(scope)) throw new Error(`the service worker is for ${scope}, and not for this page`);
  if (!serviceWorker.controller) {
    const controlled = new Promise((resolve) => serviceWorker.addEventListener('controllerchange', resolve, { once: true }));
    // It is there, and left this page alone, which was loaded anew without the cache.
    registration.active?.postMessage('claim');
    await controlled;
  }
  again();
  return registration;
}
