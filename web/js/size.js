// The size of an element in CSS pixels and in those of the device.

/**
 * Calls back with { width, height, ratio, device } now and whenever it changes, but not while the
 * element does not show. `device` is the exact size in pixels of the device, if the browser tells:
 * then a canvas of this size is shown without resampling. (Where a browser emulates another screen, it
 * may tell the size on the true one.)
 */
export function watchSize(element, onSize) {
  const observer = new ResizeObserver(([{ contentRect, devicePixelContentBoxSize }]) => {
    const { width, height } = contentRect;
    if (width === 0 || height === 0) return;
    const ratio = devicePixelRatio;
    const exact = devicePixelContentBoxSize?.[0];
    const side = (rounded, exact) => (Math.abs(rounded - exact) <= 1 ? exact : rounded);
    const device = {
      width: side(Math.round(width * ratio), exact?.inlineSize),
      height: side(Math.round(height * ratio), exact?.blockSize),
    };
    onSize({ width, height, ratio, device });
  });
  try {
    observer.observe(element, { box: 'device-pixel-content-box' });
  } catch {
    observer.observe(element);
  }
}
