// What happens to elements on the page: their size, whether they are close to the screen, and how many
// pixels of the screen a CSS pixel has. Observers are shared by all elements.

/** How far from the screen an element is close to it: what lazy images have in browsers. */
const margin = '1250px';

const watched = new Map();

let sizes = null;
let places = null;

function onResize(entries) {
  for (const { target, contentRect, devicePixelContentBoxSize } of entries) {
    const css = { width: contentRect.width, height: contentRect.height };
    watched.get(target)?.onresize(css, deviceSize(target, css, devicePixelContentBoxSize?.[0]));
  }
}

/** A size in pixels of the screen, which some browsers tell exactly. */
function deviceSize(element, css, exact) {
  const computed = inDevicePixels(css);
  if (!exact) return computed;
  const vertical = !getComputedStyle(element).writingMode.startsWith('horizontal');
  const [width, height] = vertical
    ? [exact.blockSize, exact.inlineSize]
    : [exact.inlineSize, exact.blockSize];
  // They differ by rounding, by a zoom of CSS, which only the one has, and by an emulated density, which
  // only the other has.
  const side = (a, b) => (Math.abs(a - b) <= 1 ? a : Math.max(a, b));
  return { width: side(width, computed.width), height: side(height, computed.height) };
}

/** A size in CSS pixels as one in pixels of the screen. */
export function inDevicePixels({ width, height }) {
  const { devicePixelRatio } = globalThis;
  return { width: Math.round(width * devicePixelRatio), height: Math.round(height * devicePixelRatio) };
}

/** How far the page is zoomed in with two fingers, which does not change its layout. */
export const pinch = () => Math.max(1, globalThis.visualViewport?.scale ?? 1);

function onZoom() {
  for (const { onzoom } of watched.values()) onzoom();
}

function watchDensity() {
  const query = matchMedia(`(resolution: ${devicePixelRatio}dppx)`);
  query.addEventListener('change', () => (onZoom(), watchDensity()), { once: true });
}

function start() {
  sizes = new ResizeObserver(onResize);
  places = new IntersectionObserver(
    (entries) => {
      for (const { target, isIntersecting } of entries) watched.get(target)?.onnear(isIntersecting);
    },
    { rootMargin: margin },
  );
  globalThis.visualViewport?.addEventListener('resize', onZoom);
  watchDensity();
}

/** Calls `onresize`, `onnear` and `onzoom` of the listener from now on. */
export function observe(element, listener) {
  if (!sizes) start();
  watched.set(element, listener);
  try {
    sizes.observe(element, { box: 'device-pixel-content-box' });
  } catch {
    sizes.observe(element);
  }
  places.observe(element);
}

export function unobserve(element) {
  watched.delete(element);
  sizes?.unobserve(element);
  places?.unobserve(element);
}
