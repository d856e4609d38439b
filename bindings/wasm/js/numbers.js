// Numbers among the options of the encoder.

/** The number, if it is within its range. */
export function number(value, name, least, most, isInteger = true) {
  const fits = typeof value === 'number' && value >= least && value <= most;
  if (!fits || (isInteger && !Number.isInteger(value))) {
    const kind = isInteger ? 'an integer' : 'a number';
    throw new RangeError(`${name} is ${String(value)}; it must be ${kind} from ${least} to ${most}`);
  }
  return value;
}
