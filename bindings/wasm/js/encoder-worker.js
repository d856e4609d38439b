// The worker that encodes: loads the encoder, and then takes one picture after the other.

import { encode, load } from './encoder-core.js';
import { pack } from './errors.js';
import { port } from './port.js';

/** The least time in milliseconds between two reports of progress. */
const interval = 50;

function run({ image, options }) {
  let last = -Infinity;
  const onprogress = (progress) => {
    const now = performance.now();
    if (now - last < interval) return;
    last = now;
    port.postMessage({ progress });
  };
  const { file, report } = encode(image, { ...options, onprogress });
  port.postMessage({ result: { file, report } }, [file.buffer]);
}

port.listen(async (message) => {
  if ('module' in message) {
    await load(message.module).then(
      () => port.postMessage('ready'),
      () => port.postMessage('failed'),
    );
    return;
  }
  try {
    run(message);
  } catch (error) {
    port.postMessage({ error: pack(error, 'encoder') });
  }
});
