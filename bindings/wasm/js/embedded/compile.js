// WebAssembly that is in a script: compressed with deflate, and written with base64, of which the compression of a
// server makes as few bytes as of the file.

async function compile(text) {
  const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
  const inflated = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return WebAssembly.compile(await new Response(inflated).arrayBuffer());
}

/** A function that gives the module, and compiles it when it is called first. */
export function compiledOnce(text) {
  let module = null;
  return () => (module ??= compile(text));
}
