// Where the decoder is in a worker that is a text: it is sent there.

export const source = () => undefined;
export const starts = [];
