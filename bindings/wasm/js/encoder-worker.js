// The worker that encodes: loads the encoder, and then takes one picture after the other.

import { answer } from './encoder-answer.js';
import { load } from './encoder-core.js';
import { port } from './port.js';

port.listen(async (message) => {
  if (!('module' in message)) return answer(message);
  await load(message.module).then(
    () => port.postMessage('ready'),
    () => port.postMessage('failed'),
  );
});
