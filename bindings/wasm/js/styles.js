// The style sheets inside `<gip-image>`. The page's own styles come before them.

import { surroundings, unstretched } from './surroundings.js';

/**
 * What all elements have. The frame is what gives the element its size: a grid whose only column is as wide as
 * the picture, with nothing in it. It has the page's values of the properties that the drawing follows, which
 * mean nothing to a frame, so that a transition tells when the page changes one.
 */
const common = `
  :host { display: inline-block; }
  :host([hidden]) { display: none; }
  .frame {
    display: grid;
    aspect-ratio: inherit;
    object-fit: inherit;
    object-position: inherit;
    image-orientation: inherit;
    transition: 1ms;
    transition-property: object-fit, object-position, image-orientation;
    transition-behavior: allow-discrete;
  }
  .window { position: absolute; overflow: hidden; }
  canvas { position: absolute; }
`;

/**
 * The style sheet of an element in this document, which no other document takes; `null` if the document is
 * in no window. Unlike a `<style>`, no content security policy refuses it.
 */
export function newSheet({ defaultView }) {
  return defaultView && new defaultView.CSSStyleSheet();
}

/** A length as the attributes `width` and `height` of `<img>` have it, as CSS; `null` for none. */
function length(attribute) {
  const match = /^\s*(\d+(?:\.\d+)?)(%?)/.exec(attribute ?? '');
  return match && { value: Number(match[1]), css: `${match[1]}${match[2] || 'px'}`, percent: !!match[2] };
}

/**
 * The style sheet's text that makes an element's size that of an `<img>`: from the attributes, from the
 * picture's natural size once it is known, and from the alternative text if there is no picture.
 */
export function layoutOf(element, { width, height, natural, broken }) {
  const [w, h] = [length(width), length(height)];
  const { container, stretched, kept, align } = surroundings(element);
  const { maxInlineSize, writingMode } = getComputedStyle(element);
  // Like `<img>`, a picture that is to fit into its container does not make that wider.
  const fits = container !== 'flex' && maxInlineSize.includes('%');
  // A block is to be as wide as the picture, not as the page.
  const rules = [`inline-size: ${stretched.inline ? 'auto' : fits ? 'fit-content' : 'max-content'}`];
  if (!broken) {
    rules.push('contain: layout paint');
    // A minimum of `auto` is larger than that of `<img>` where nothing stretches or flexes.
    if (!kept.inline || fits) rules.push('min-inline-size: 0');
    if (!kept.block) rules.push('min-block-size: 0');
    // What `normal` would stretch, unlike `<img>`.
    if (container === 'absolute' && !stretched.block) rules.push('block-size: fit-content');
    if (container === 'grid' && align === 'normal') rules.push(`align-self: ${unstretched}`);
    const known = w?.value && h?.value && !w.percent && !h.percent;
    const ratio = natural ?? (known && { width: w.value, height: h.value });
    if (ratio) rules.push(`aspect-ratio: auto ${ratio.width} / ${ratio.height}`);
  }
  if (w) rules.push(`width: ${w.css}`);
  if (h) rules.push(`height: ${h.css}`);
  // What is along the lines of text is the picture's height where they are vertical.
  const column = (writingMode.startsWith('vertical') ? natural?.height : natural?.width) ?? 0;
  const frame = `grid-template-columns: minmax(${fits ? 0 : column}px, ${column}px)`;
  return `${common} :host { ${rules.join('; ')} } .frame { ${frame} }`;
}

/** The size of an element's content box in CSS pixels. */
export function contentSize(element) {
  const style = getComputedStyle(element);
  const side = (name, edges) => {
    const outer = style.boxSizing === 'border-box' ? edges : [];
    const size = outer.reduce((sum, edge) => sum - parseFloat(style[edge]), parseFloat(style[name]));
    return size > 0 ? size : 0;
  };
  return {
    width: side('width', ['paddingLeft', 'paddingRight', 'borderLeftWidth', 'borderRightWidth']),
    height: side('height', ['paddingTop', 'paddingBottom', 'borderTopWidth', 'borderBottomWidth']),
  };
}
