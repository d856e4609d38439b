// Draws Gaussians as ellipses.

/** Numbers of a Gaussian. */
const NUMBERS = 9;
/** Ellipses smaller than this would only cover the picture; in CSS pixels. */
const LEAST_RADIUS = 1.2;
/** From this radius on, outlines are drawn with their full strength. */
const CLEAR_RADIUS = 10;
const STRENGTHS = 4;

/** What adds light, and what takes it away. */
const COLORS = { more: '255, 186, 73', less: '73, 198, 255' };

/**
 * Draws the outlines at one standard deviation of those Gaussians that show in a region of the
 * output with the size `level`.
 */
export function drawOutlines(context, numbers, { level, region, ratio, picture }) {
  const sx = level.width / picture.width;
  const sy = level.height / picture.height;
  const channels = Math.min(3, picture.channels < 3 ? 1 : 3);
  const paths = {};
  for (let at = 0; at < numbers.length; at += NUMBERS) {
    const l11 = numbers[at + 2] * sx;
    const l21 = numbers[at + 3] * sy;
    const l22 = numbers[at + 4] * sy;
    const x = numbers[at] * sx - region.x;
    const y = numbers[at + 1] * sy - region.y;
    const height = Math.hypot(l21, l22);
    const inside = x + l11 > -2 && x - l11 < region.width + 2 && y + height > -2 && y - height < region.height + 2;
    // The radius of a circle of the same area.
    const radius = Math.sqrt(l11 * l22) / ratio;
    // This also leaves out what is not a number.
    if (!(inside && radius >= LEAST_RADIUS)) continue;
    let light = 0;
    for (let channel = 0; channel < channels; channel += 1) light += numbers[at + 5 + channel];
    const strength = Math.min(STRENGTHS, Math.ceil((STRENGTHS * radius) / CLEAR_RADIUS));
    const path = (paths[`${light < 0 ? 'less' : 'more'} ${strength}`] ??= new Path2D());
    addEllipse(path, x, y, l11, l21, l22);
  }
  for (const [name, path] of Object.entries(paths)) {
    const [sign, strength] = name.split(' ');
    const share = strength / STRENGTHS;
    context.lineWidth = 2.5 * ratio * share;
    context.strokeStyle = `rgba(0, 0, 0, ${0.35 * share})`;
    context.stroke(path);
    context.lineWidth = ratio * (0.5 + 0.5 * share);
    context.strokeStyle = `rgba(${COLORS[sign]}, ${0.3 + 0.6 * share})`;
    context.stroke(path);
  }
}

/** The ellipse (x, y) + L (cos t, sin t), by its axes: the singular values of L. */
function addEllipse(path, x, y, l11, l21, l22) {
  const xx = l11 * l11;
  const xy = l11 * l21;
  const yy = l21 * l21 + l22 * l22;
  const middle = (xx + yy) / 2;
  const distance = Math.hypot((xx - yy) / 2, xy);
  const long = Math.sqrt(middle + distance);
  const short = (l11 * l22) / long;
  const angle = Math.atan2(2 * xy, xx - yy) / 2;
  path.moveTo(x + long * Math.cos(angle), y + long * Math.sin(angle));
  path.ellipse(x, y, long, short, angle, 0, 2 * Math.PI);
}
