// Decoders by number, for whoever calls from another thread: the other end of `remote.js`.

import { Decoder, load } from './core.js';

export class Host {
  #decoders = new Map();

  /** Loads the decoder. */
  load() {
    return load();
  }

  /** Calls a method of the decoder with this number. Returns the result and what to transfer. */
  async call(id, method, argument) {
    if (method === 'create') {
      this.#decoders.set(id, new Decoder(argument));
      return [];
    }
    const decoder = this.#decoders.get(id);
    switch (method) {
      case 'close':
        this.#decoders.delete(id);
        decoder?.close();
        return [];
      case 'metadata':
        return [decoder.metadata];
      case 'gaussiansFor':
        return [decoder.gaussiansFor(...argument)];
      case 'png': {
        const file = await decoder.png(argument);
        return [file, [file.buffer]];
      }
      case 'gaussians': {
        const numbers = decoder.gaussians(argument);
        return [numbers, [numbers.buffer]];
      }
      case 'render':
      case 'samples': {
        const image = decoder[method](argument);
        return [image, [image.data.buffer]];
      }
      default:
        return [decoder[method](argument)];
    }
  }
}
