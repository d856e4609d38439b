// How many workers encode at the same time in a page.

/** Each takes some ten megabytes, and more for large pictures. One core is left to the page. */
export const mostWorkers = Math.max(1, Math.min(4, (globalThis.navigator?.hardwareConcurrency ?? 2) - 1));
