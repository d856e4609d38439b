// Numbers for people.

const whole = new Intl.NumberFormat('en');

export const integer = (value) => whole.format(value);

/** A number with so many digits after the point. */
export const decimal = (value, digits) =>
  value.toLocaleString('en', { minimumFractionDigits: digits, maximumFractionDigits: digits });

/** A number of things, whose name gets an s if there is not one. */
export const count = (number, name) => `${integer(number)} ${name}${number === 1 ? '' : 's'}`;

export const bytes = (number) => count(number, 'byte');

/** A share of a whole, 0 to 1. */
export const percent = (share) => `${decimal(share * 100, share < 0.1 ? 1 : 0)} %`;

/** A scale, where 1 is 100 %. */
export const zoom = (scale) => (scale < 0.1 ? `${decimal(scale * 100, 1)} %` : `${integer(Math.round(scale * 100))} %`);
