// What can go wrong. Errors cross from a worker to the page as plain objects, and become these again.

/** Why a file was not decoded. `kind` is for programs, `message` for people. */
export class GipError extends Error {
  constructor(message, kind = 'failed', chunk = null, options = undefined) {
    super(message, options);
    this.kind = kind;
    this.chunk = chunk;
  }

  // The names of classes change when scripts are made small.
  get name() {
    return 'GipError';
  }
}

/** Not a .gip file. */
export class SignatureError extends GipError {
  get name() {
    return 'SignatureError';
  }
}
/** The file breaks a rule of the format. */
export class MalformedError extends GipError {
  get name() {
    return 'MalformedError';
  }
}
/** The file requires something that this version does not have. */
export class UnsupportedError extends GipError {
  get name() {
    return 'UnsupportedError';
  }
}
/** The file ends too early. */
export class UnexpectedEndError extends GipError {
  get name() {
    return 'UnexpectedEndError';
  }
}

/** The file or the request requires more than a limit allows; `limit` is its name in `defaultLimits`. */
export class LimitError extends GipError {
  get name() {
    return 'LimitError';
  }

  constructor(message, limit, wanted, allowed) {
    super(message, 'limit');
    this.limit = limit;
    this.wanted = wanted;
    this.allowed = allowed;
  }
}

/** The file could not be fetched. `status` is that of the response; 0 if there was none. */
export class NetworkError extends GipError {
  get name() {
    return 'NetworkError';
  }

  constructor(message, status = 0, options = undefined) {
    super(message, 'network', null, options);
    this.status = status;
  }
}

const classes = {
  signature: SignatureError,
  malformed: MalformedError,
  unsupported: UnsupportedError,
  'unexpected-end': UnexpectedEndError,
};

/** The decoder calls this. */
export function decodeError(kind, message, chunk = null) {
  if (kind === 'request') return new RangeError(message);
  if (kind === 'type') return new TypeError(message);
  return new (classes[kind] ?? GipError)(message, kind, chunk);
}

/** The decoder calls this. */
export function limitError(message, limit, wanted, allowed) {
  return new LimitError(`${message}; limits: { ${limit}: ... } raises it`, limit, wanted, allowed);
}

/** A plain object for an error of the decoder, or whatever `origin` is. */
export function pack(error, origin = 'decoder') {
  const { message, kind, chunk, limit, wanted, allowed } = error;
  if (kind === 'limit') return { kind, message, limit, wanted, allowed };
  if (error instanceof GipError) return { kind, message, chunk };
  if (error instanceof RangeError) return { kind: 'request', message };
  if (error instanceof TypeError) return { kind: 'type', message };
  // WebAssembly traps when its memory is exhausted.
  return { kind: 'failed', message: `the ${origin} failed: ${message}`, chunk: null };
}

/** The error of a plain object. */
export function unpack({ kind, message, chunk, limit, wanted, allowed }) {
  if (kind === 'limit') return new LimitError(message, limit, wanted, allowed);
  return decodeError(kind, message, chunk);
}
