// The worker: loads the decoder that it is given, takes calls, and answers them in their order.

import { Decoder, Host, load } from './core.js';
import { pack } from './errors.js';

const host = new Host(Decoder);

async function answer({ call, id, method, argument }) {
  try {
    const [result, transfer = []] = await host.call(id, method, argument);
    self.postMessage({ call, result }, transfer);
  } catch (error) {
    self.postMessage({ call, error: pack(error) });
  }
}

self.onmessage = async ({ data }) => {
  if (!('module' in data)) return answer(data);
  self.postMessage(await load(data.module).then(() => 'ready', () => 'failed'));
};
