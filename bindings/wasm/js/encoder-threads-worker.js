// A worker of an encoder with threads. The first loads the encoder, gives the others its module and memory, and takes one
// picture after the other; the others are threads of its pool, and hear nothing after that.

import init, { initSync, runThread, startPool } from './image_gip_encoder_threads.js';
import { answer, trying } from './encoder-answer.js';
import { load } from './encoder-core.js';
import { port } from './port.js';

/** Starts this worker, and returns what to answer. */
async function start({ module = null, memory = null, threads = 0 }) {
  if (memory) {
    initSync({ module, memory });
    return 'ready';
  }
  if (threads > 0) {
    startPool(threads);
    return 'ready';
  }
  // Of nothing, it is the file beside this script.
  module ??= await WebAssembly.compileStreaming(fetch(new URL('image_gip_encoder_threads_bg.wasm', import.meta.url)));
  await load(module);
  return { module, memory: (await init()).memory };
}

port.listen(async (message) => {
  if ('image' in message) return answer(message);
  try {
    port.postMessage(await start(message));
  } catch {
    port.postMessage('failed');
    return;
  }
  if (message.memory) trying(runThread);
});
