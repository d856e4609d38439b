// Decoders by number, for whoever calls from another thread: the other end of `remote.js`.

export class Host {
  #Decoder;
  #decoders = new Map();

  /** `Decoder` is that of `core.js`, which has been loaded. */
  constructor(Decoder) {
    this.#Decoder = Decoder;
  }

  /** Calls a method of the decoder with this number. Returns the result and what to transfer. */
  async call(id, method, argument) {
    if (method === 'create') {
      this.#decoders.set(id, new this.#Decoder(argument));
      return [];
    }
    const decoder = this.#decoders.get(id);
    switch (method) {
      case 'close':
        this.#decoders.delete(id);
        decoder?.close();
        return [];
      case 'metadata':
      case 'progress':
        return [decoder[method]];
      case 'gaussiansFor':
        return [decoder.gaussiansFor(...argument)];
      default: {
        const result = await decoder[method](argument);
        // An array of samples, or of numbers or bytes, is nobody else's.
        const { buffer } = result?.data ?? result ?? {};
        return [result, buffer && [buffer]];
      }
    }
  }
}
