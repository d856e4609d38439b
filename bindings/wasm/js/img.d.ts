/**
 * An `<img>` in place of the canvas of each `<gip-image>` that is complete. Import it for that, beside the element:
 * nothing has to be called.
 */

/**
 * Does so for the elements in this document or shadow root as well, now and later. It is done for those of the page's document
 * outside of shadow roots anyway.
 */
export function watch(root: Document | ShadowRoot): void;
