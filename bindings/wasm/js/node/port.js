// The other end of the messages of a worker in Node.

import { parentPort } from 'node:worker_threads';

export const port = {
  listen(listener) {
    parentPort.on('message', listener);
  },
  postMessage: (message, transfer) => parentPort.postMessage(message, transfer),
};
