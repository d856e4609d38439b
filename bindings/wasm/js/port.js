// The other end of a worker's messages.

export const port = {
  listen(listener) {
    self.onmessage = ({ data }) => listener(data);
  },
  postMessage: (message, transfer) => self.postMessage(message, transfer),
};
