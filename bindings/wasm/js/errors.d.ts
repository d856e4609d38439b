import type { Limits } from './types.js';

/** Why a file was not decoded. `kind` is for programs, `message` for people. */
export class GipError extends Error {
  readonly kind:
    | 'signature'
    | 'malformed'
    | 'unsupported'
    | 'unexpected-end'
    | 'limit'
    | 'network'
    | 'failed';
  /** The letters of the chunk that the error is in, such as `L` for a layer; `null` if it is in none. */
  readonly chunk: string | null;
}

/** Not a .gip file. */
export class SignatureError extends GipError {}
/** The file breaks a rule of the format. */
export class MalformedError extends GipError {}
/** The file requires something that this version does not have. */
export class UnsupportedError extends GipError {}
/** The file ends too early. */
export class UnexpectedEndError extends GipError {}

/** The file or the request requires more than a limit allows. */
export class LimitError extends GipError {
  /** Which one, as the option `limits` names it. */
  readonly limit: keyof Limits;
  readonly wanted: number;
  readonly allowed: number;
}

/** The file could not be fetched. */
export class NetworkError extends GipError {
  /** The status of the response; 0 if there was none. */
  readonly status: number;
}
