// A page of ten pictures that the plug-in encodes, which measures itself.

import 'image-gip/element';
import large from './picture0.jpg?gip&bpp=0.7';

const pictures = Object.values(import.meta.glob('./picture*.{jpg,png}', { query: '?gip', import: 'default', eager: true }));

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
  document.querySelector('main').innerHTML = [...all, large.markup({ alt: 'Once more, "better" & <larger>' })].join('');
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
