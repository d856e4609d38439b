// What the boxes around an element make of its size where that is left to them. They treat `<img>` in another
// way than an element with contents, so the styles of `<gip-image>` depend on them.

/** What a style sheet of `<gip-image>` has for `align-self: normal` in a grid, and nobody else has. */
export const unstretched = 'unsafe start';

/** The element in whose box this one is laid out, across shadow roots. */
function parentOf(element) {
  let parent = element;
  do {
    parent = parent.assignedSlot ?? parent.parentElement ?? parent.getRootNode().host;
  } while (parent && getComputedStyle(parent).display === 'contents');
  return parent;
}

/**
 * The `container` of an element, `flex`, `grid`, `absolute` or another one, and how it aligns the element; which
 * sides of an `<img>` are `stretched` there; and along which it would be `kept` from becoming smaller than its
 * contents.
 */
export function surroundings(element) {
  const { position, alignSelf, justifySelf } = getComputedStyle(element);
  const absolute = /absolute|fixed/.test(position);
  const parent = absolute ? null : parentOf(element);
  const { display, flexDirection, alignItems, justifyItems } = parent ? getComputedStyle(parent) : {};
  const container = absolute ? 'absolute' : /flex|grid/.exec(display)?.[0];
  const align = alignSelf === 'auto' || alignSelf === unstretched ? alignItems : alignSelf;
  const justify = justifySelf === 'auto' ? justifyItems : justifySelf;
  if (container === 'flex') {
    const column = flexDirection.startsWith('column');
    const across = /normal|stretch/.test(align);
    const stretched = { inline: column && across, block: !column && across };
    return { container, align, stretched, kept: { inline: !column, block: column } };
  }
  const stretches = (value) => !!container && /stretch/.test(value);
  const stretched = { inline: stretches(justify), block: stretches(align) };
  return { container, align, stretched, kept: stretched };
}
