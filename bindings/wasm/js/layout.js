// Where a picture is drawn in its box, as the CSS properties `object-fit` and `object-position` say,
// and which part of it that shows. No part of the page is touched here.

/** Most pixels of a canvas: beyond that, the picture is rendered coarser. */
const mostPixels = 2 ** 24;

/** The size of the picture in the box, in any unit. */
function objectSize(box, natural, fit) {
  const scales = [box.width / natural.width, box.height / natural.height];
  const scaled = (scale) => ({ width: natural.width * scale, height: natural.height * scale });
  switch (fit) {
    case 'contain':
      return scaled(Math.min(...scales));
    case 'cover':
      return scaled(Math.max(...scales));
    case 'none':
      return natural;
    case 'scale-down':
      return scaled(Math.min(1, ...scales));
    default:
      return box;
  }
}

/**
 * What a component of `object-position` means, such as `50%`, `10px` or `calc(100% - 10px)`: a part of
 * the space that is left, and CSS pixels.
 */
function offset(component) {
  let [part, pixels] = [0, 0];
  for (const [, sign, number, unit] of component.matchAll(/([+-]?)\s*([\d.]+)(%|px)/g)) {
    const value = Number(number) * (sign === '-' ? -1 : 1);
    if (unit === '%') part += value / 100;
    else pixels += value;
  }
  return { part, pixels };
}

/**
 * What to render for a box, and where to put it.
 *
 * `css` and `device` are the size of the box in CSS pixels and in pixels of the screen, `natural` that of
 * the picture in CSS pixels; `fit` and `position` are the computed properties. Returns the size of the
 * whole output and the region of it that shows, both in pixels of the screen, and the place of that
 * region in the box in CSS pixels; `null` if nothing shows.
 */
export function plan({ css, device, natural, fit = 'fill', position = '50% 50%' }) {
  if (!(css.width > 0 && css.height > 0 && device.width >= 1 && device.height >= 1)) return null;
  const density = { width: device.width / css.width, height: device.height / css.height };
  const size = objectSize(css, natural, fit);
  const components = position.match(/calc\([^)]*\)|\S+/g) ?? ['50%', '50%'];
  const axis = (side, component) => {
    const { part, pixels } = offset(component);
    const start = Math.round((part * (css[side] - size[side]) + pixels) * density[side]);
    const length = Math.max(1, Math.round(size[side] * density[side]));
    return { start, length, end: start + length };
  };
  const [x, y] = [axis('width', components[0]), axis('height', components[1] ?? '50%')];
  const shown = (along, limit) => [Math.max(0, along.start), Math.min(limit, along.end)];
  const [left, right] = shown(x, device.width);
  const [top, bottom] = shown(y, device.height);
  if (left >= right || top >= bottom) return null;

  const coarser = Math.min(1, Math.sqrt(mostPixels / ((right - left) * (bottom - top))));
  const whole = (length) => Math.min(2 ** 23, Math.max(1, Math.floor(length * coarser)));
  const [width, height] = [whole(x.length), whole(y.length)];
  // The region in pixels of the output, and back again where it is on the screen.
  const cut = (from, to, along, length) => {
    const scale = length / along.length;
    const first = Math.min(length - 1, Math.floor((from - along.start) * scale));
    const last = Math.max(first + 1, Math.min(length, Math.ceil((to - along.start) * scale)));
    return { first, count: last - first, start: along.start + first / scale, shown: (last - first) / scale };
  };
  const columns = cut(left, right, x, width);
  const rows = cut(top, bottom, y, height);
  return {
    width,
    height,
    region: { x: columns.first, y: rows.first, width: columns.count, height: rows.count },
    place: {
      left: columns.start / density.width,
      top: rows.start / density.height,
      width: columns.shown / density.width,
      height: rows.shown / density.height,
    },
  };
}

/** Where a rendered region belongs in another layout of the same picture, in CSS pixels. */
export function moved(from, to) {
  const along = (first, count, length, start, size) => {
    // One pixel of the new layout in CSS pixels, and where its picture begins.
    const unit = size.shown / size.count;
    const origin = start - size.first * unit;
    const scale = (unit * size.length) / length;
    return [origin + first * scale, count * scale];
  };
  const [left, width] = along(from.region.x, from.region.width, from.width, to.place.left, {
    first: to.region.x,
    count: to.region.width,
    length: to.width,
    shown: to.place.width,
  });
  const [top, height] = along(from.region.y, from.region.height, from.height, to.place.top, {
    first: to.region.y,
    count: to.region.height,
    length: to.height,
    shown: to.place.height,
  });
  return { left, top, width, height };
}
