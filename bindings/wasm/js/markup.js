// The HTML of a picture. It stands in the modules of `vite.js` as text, so it uses nothing outside of it.

export function markup({ src, fallback, width, height, placeholder }, attributes = {}) {
  const escaped = (value) => String(value).replaceAll('&', '&amp;').replaceAll('"', '&quot;').replaceAll('<', '&lt;');
  const listed = (all) =>
    Object.entries(all)
      .filter(([, value]) => value !== null && value !== undefined && value !== false)
      .map(([name, value]) => (value === true ? ` ${name}` : ` ${name}="${escaped(value)}"`))
      .join('');
  const { alt = '' } = attributes;
  const inside = fallback ? `<noscript><img${listed({ src: fallback, width, height, alt })}></noscript>` : '';
  return `<gip-image${listed({ placeholder, src, width, height, alt, ...attributes })}>${inside}</gip-image>`;
}
