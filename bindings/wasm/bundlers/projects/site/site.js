// A page of ten pictures that the plug-in encodes, which measures itself. `?visit` has it as visitors do: nothing is loaded
// that they do not see. `&canvas` leaves out what is beside the element, and `&original` has the originals in its place.

import 'image-gip/element';
import large from './picture0.jpg?gip&bpp=0.7';

const pictures = Object.values(import.meta.glob('./picture*.{jpg,png}', { query: '?gip', import: 'default', eager: true }));

const asked = new URLSearchParams(location.search);
const isPlain = asked.has('canvas') || asked.has('original');
const extras = isPlain ? [] : [import('image-gip/img'), import('image-gip/print').then(({ ready }) => ready)];

let shift = 0;
new PerformanceObserver((list) => {
  for (const { value } of list.getEntries()) shift += value;
}).observe({ type: 'layout-shift', buffered: true });

/** What is wrong with what the plug-in gives. */
function problems() {
  const wrong = pictures.filter(({ src, fallback, width, height, placeholder }) => {
    const bytes = atob(placeholder).length;
    return !src.includes('.gip') || !fallback || width !== 480 || height !== 320 || bytes < 80 || bytes > 300;
  });
  return wrong.length === 0 && pictures.length === 10 ? [] : [JSON.stringify(wrong), `${pictures.length} pictures`];
}

async function main() {
  const all = pictures.map((picture, at) => picture.markup({ alt: `Hills, number ${at}`, loading: at > 1 ? 'lazy' : null }));
  const original = ({ fallback, width, height }) => `<img src="${fallback}" width="${width}" height="${height}" alt="Hills">`;
  const last = large.markup({ alt: 'Once more, "better" & <larger>', loading: asked.has('visit') ? 'lazy' : null });
  document.querySelector('main').innerHTML = (asked.has('original') ? pictures.map(original) : [...all, last]).join('');
  await Promise.all(extras);
  if (asked.has('visit')) {
    document.title = 'visited';
    return;
  }
  const images = [...document.querySelectorAll('gip-image')];
  await Promise.all(images.map((image) => image.decode()));
  const wrong = problems();
  if (images.some((image) => image.naturalWidth !== 480)) wrong.push('a size');
  if (images.at(-1).alt !== 'Once more, "better" & <larger>') wrong.push('an alt');
  if (images[0].querySelector('noscript') === null) wrong.push('no fallback');
  await new Promise((resolve) => setTimeout(resolve, 300));
  if (shift > 0) wrong.push(`a layout shift of ${shift}`);
  document.title = wrong.length > 0 ? `failed: ${wrong.join('; ')}` : `shown 11 pictures, layout shift ${shift}`;
}

main().catch((error) => {
  document.title = `failed: ${error.stack}`;
});
