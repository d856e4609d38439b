// An ICC profile for the tests: sRGB with the primaries red and green exchanged, so that whoever ignores
// it shows other colours.

const fixed = (value) => {
  const bytes = Buffer.alloc(4);
  bytes.writeInt32BE(Math.round(value * 65536));
  return bytes;
};

const tag = (type, ...parts) => Buffer.concat([Buffer.from(type, 'latin1'), Buffer.alloc(4), ...parts]);
const xyz = (...values) => tag('XYZ ', ...values.map(fixed));

export function swappedProfile() {
  // The curve of sRGB, of which type 3 of a parametric curve has the five numbers.
  const kind = Buffer.from([0, 3, 0, 0]);
  const curve = tag('para', kind, ...[2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045].map(fixed));
  const text = (value) => {
    const letters = Buffer.from(value, 'utf16le').swap16();
    const header = Buffer.alloc(20);
    header.writeUInt32BE(1, 0);
    header.writeUInt32BE(12, 4);
    header.write('enUS', 8, 'latin1');
    header.writeUInt32BE(letters.length, 12);
    header.writeUInt32BE(28, 16);
    return tag('mluc', header, letters);
  };
  const tags = [
    ['desc', text('test')],
    ['cprt', text('none')],
    ['wtpt', xyz(0.9642, 1, 0.8249)],
    ['rXYZ', xyz(0.38515, 0.71687, 0.09708)],
    ['gXYZ', xyz(0.43607, 0.22249, 0.01392)],
    ['bXYZ', xyz(0.14307, 0.06061, 0.7141)],
    ['rTRC', curve],
    ['gTRC', curve],
    ['bTRC', curve],
  ];
  const table = Buffer.alloc(4 + 12 * tags.length);
  table.writeUInt32BE(tags.length);
  const bodies = [];
  let at = 128 + table.length;
  tags.forEach(([name, body], index) => {
    table.write(name, 4 + 12 * index, 'latin1');
    table.writeUInt32BE(at, 8 + 12 * index);
    table.writeUInt32BE(body.length, 12 + 12 * index);
    const padded = Buffer.concat([body, Buffer.alloc((4 - (body.length % 4)) % 4)]);
    bodies.push(padded);
    at += padded.length;
  });
  const header = Buffer.alloc(128);
  header.writeUInt32BE(at, 0);
  header.writeUInt32BE(0x04300000, 8);
  header.write('mntrRGB XYZ ', 12, 'latin1');
  header.write('acsp', 36, 'latin1');
  Buffer.concat([fixed(0.9642), fixed(1), fixed(0.8249)]).copy(header, 68);
  return Buffer.concat([header, table, ...bodies]);
}
