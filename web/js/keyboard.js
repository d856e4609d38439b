// The keys. `actions` are those of the toolbar.

/** How far arrows move, in CSS pixels. */
const STEP = 90;

const directions = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/** Keys, and what they do; the help shows this list. */
export const KEYS = [
  { keys: Object.keys(directions), label: '← → ↑ ↓', does: 'move the picture (with Shift: further)' },
  { keys: ['+', '='], label: '+', does: 'zoom in', action: 'zoomIn' },
  { keys: ['-', '_'], label: '−', does: 'zoom out', action: 'zoomOut' },
  { keys: ['0'], label: '0', does: 'the whole picture', action: 'fit' },
  { keys: ['1'], label: '1', does: 'one pixel of the picture on one of the page', action: 'actualSize' },
  { keys: ['t'], label: 't', does: 'texture of the picture, if it has one', action: 'texture' },
  { keys: ['o'], label: 'o', does: 'outlines of the Gaussians', action: 'outlines' },
  { keys: ['c'], label: 'c', does: 'compare with the original', action: 'compare' },
  { keys: [' '], label: 'Space', does: 'play the file from its first byte', action: 'play' },
  { keys: [','], label: ',', does: 'one layer less', action: 'layerBack' },
  { keys: ['.'], label: '.', does: 'one layer more', action: 'layerForward' },
  { keys: ['i'], label: 'i', does: 'what is in the file', action: 'panel' },
  { keys: ['f'], label: 'f', does: 'open a file', action: 'open' },
  { keys: ['?'], label: '?', does: 'this help', action: 'help' },
];

/** Whether a control has the focus that uses the key itself. */
function isOfControl({ key, target }) {
  const moves = /^(Arrow|Page|Home|End)/.test(key);
  // Entries of a menu are chosen by what they begin with as well.
  if (target.closest('select')) return moves || /^[\w ]$/.test(key);
  if (target.closest('input')) return moves;
  return key === ' ' && target.closest('button, summary') !== null;
}

export function listenToKeys(stage, actions) {
  const byKey = new Map(KEYS.flatMap(({ keys, action }) => keys.map((key) => [key, action])));
  addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || document.querySelector('dialog[open]')) return;
    if (isOfControl(event)) return;
    const direction = directions[event.key];
    if (direction && stage.hasPicture) {
      const step = STEP * (event.shiftKey ? 4 : 1);
      stage.glide((view) => view.panBy(direction[0] * step, direction[1] * step));
    } else {
      const action = byKey.get(event.key.length === 1 ? event.key.toLowerCase() : event.key);
      if (!action) return;
      actions[action]();
    }
    event.preventDefault();
  });
}
