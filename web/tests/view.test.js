// The view without a page.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { View, visibleRegion } from '../js/view.js';

function windowOf(width, height, ratio) {
  return { width, height, ratio, device: { width: width * ratio, height: height * ratio } };
}

function viewOf(picture, window = windowOf(800, 600, 2)) {
  const view = new View();
  view.setWindow(window);
  view.setPicture(picture);
  return view;
}

test('the whole picture fits, in the middle', () => {
  for (const picture of [{ width: 4000, height: 10 }, { width: 3, height: 2000 }, { width: 1, height: 1 }]) {
    const { frame } = viewOf(picture);
    const { window, level, left, top } = frame;
    assert.deepEqual(visibleRegion(frame), { x: 0, y: 0, ...level });
    assert.ok(Math.abs(2 * left + level.width - window.width) <= 1);
    assert.ok(Math.abs(2 * top + level.height - window.height) <= 1);
  }
});

test('zooming keeps the point under the pointer', () => {
  const view = viewOf({ width: 640, height: 480 });
  view.zoomTo(3, { x: 400, y: 300 });
  const at = { x: 431, y: 287 };
  const before = view.toPicture(at);
  view.zoomTo(40, at);
  const after = view.toPicture(at);
  assert.ok(Math.hypot(before.x - after.x, before.y - after.y) < 1e-9);
});

test('the scale ends at 100, and at half of the whole', () => {
  const view = viewOf({ width: 640, height: 480 });
  view.zoomTo(1e9);
  assert.equal(view.scale, 100);
  view.zoomTo(0);
  assert.equal(view.scale, view.fitScale / 2);
});

test('no level is larger than what the decoder renders', () => {
  const view = viewOf({ width: 1_000_000, height: 1 });
  view.zoomTo(1e9);
  assert.ok(view.frame.level.width <= 2 ** 23);
});

test('a picture larger than the window covers it, a smaller one stays in its middle', () => {
  const view = viewOf({ width: 640, height: 480 });
  view.zoomTo(10);
  view.panBy(1e6, 1e6);
  assert.deepEqual([view.frame.left, view.frame.top], [0, 0]);
  view.panBy(-1e6, -1e6);
  const { window, level, left, top } = view.frame;
  assert.deepEqual([left + level.width, top + level.height], [window.width, window.height]);
  view.zoomTo(0);
  view.panBy(100, 0);
  assert.equal(view.x, 320);
});

test('another size of the window keeps the whole picture in view, or else its centre', () => {
  const view = viewOf({ width: 640, height: 480 });
  view.setWindow(windowOf(300, 500, 1));
  assert.ok(view.isFitted);
  view.zoomTo(20);
  const { x, y, scale } = view;
  view.setWindow(windowOf(500, 300, 1));
  assert.deepEqual([view.x, view.y, view.scale], [x, y, scale]);
});
