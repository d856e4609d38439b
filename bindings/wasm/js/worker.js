// The worker: takes calls, and answers them in their order.

import { pack } from './errors.js';
import { Host } from './host.js';

const host = new Host();

self.onmessage = async ({ data: { call, id, method, argument } }) => {
  try {
    const [result, transfer = []] = await host.call(id, method, argument);
    self.postMessage({ call, result }, transfer);
  } catch (error) {
    self.postMessage({ call, error: pack(error) });
  }
};

host.load().then(
  () => self.postMessage('ready'),
  () => self.postMessage('failed'),
);
