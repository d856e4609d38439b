/** Sharp pictures of `<gip-image>` on printed pages, also of those that were never on the screen. Import it for that. */

/** Resolves when the decoder is loaded that it needs: pages that are printed before are as without this module. */
export const ready: Promise<void>;
