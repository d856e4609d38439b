// The style sheets inside `<gip-image>`. The page's own styles come before them.

/**
 * What all elements have. The frame has the page's values of the properties that the drawing follows, which
 * mean nothing to a frame, so that a transition tells when the page changes one.
 */
const common = `
  :host { display: inline-block; }
  :host([hidden]) { display: none; }
  .frame {
    position: absolute;
    overflow: hidden;
    object-fit: inherit;
    object-position: inherit;
    image-orientation: inherit;
    transition: 1ms;
    transition-property: object-fit, object-position, image-orientation;
    transition-behavior: allow-discrete;
  }
  canvas { position: absolute; display: block; }
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
 * Makes the element's size that of an `<img>`: from the attributes, from the picture's natural size once
 * it is known, and from the alternative text if there is no picture.
 */
export function layOut(own, { width, height, natural, broken }) {
  const [w, h] = [length(width), length(height)];
  const rules = [];
  // A block is to be as wide as the picture, not as the page.
  rules.push(`width: ${w?.css ?? 'max-content'}`);
  if (h) rules.push(`height: ${h.css}`);
  if (!broken) {
    const intrinsic = natural ?? { width: 0, height: 0 };
    // The contents are placed by hand. What would be their size is the picture's.
    rules.push(
      'contain: size layout paint',
      `contain-intrinsic-size: ${intrinsic.width}px ${intrinsic.height}px`,
      'min-width: 0',
      'min-height: 0',
    );
    if (natural) rules.push(`aspect-ratio: auto ${natural.width} / ${natural.height}`);
    else if (w?.value && h?.value && !w.percent && !h.percent) {
      rules.push(`aspect-ratio: auto ${w.value} / ${h.value}`);
    }
  }
  own.replaceSync(`${common} :host { ${rules.join('; ')} }`);
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
