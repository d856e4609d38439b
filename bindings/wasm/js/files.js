// Workers whose script is a file.

const options = { type: 'module', name: 'image-gip' };

/** A worker of the script in a blob, which the browser has read when a minute is over. */
export function workerOfText(text, options) {
  const url = URL.createObjectURL(new Blob([text], { type: 'text/javascript' }));
  const worker = new Worker(url, options);
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
  return worker;
}

/** The ways to start a worker of a script: one of another origin needs one of this origin that imports it. */
export const startsOf = (url) => [
  () => new Worker(url, options),
  () => workerOfText(`import ${JSON.stringify(url.href)};`, options),
];
