// How the cores of a machine are used in a page.

/** Cores for the encoder: one is left to the page. */
export const cores = Math.max(1, (globalThis.navigator?.hardwareConcurrency ?? 2) - 1);

/** Most pictures at the same time; each takes some ten megabytes, and more if it is large. */
export const mostPictures = Math.min(4, cores);

/** Whether threads can share memory. */
export const canShare = globalThis.crossOriginIsolated === true;
