import gip from 'image-gip/vite';

export default { base: './', plugins: [gip({ encoder: 'wasm', effort: 1, bpp: 0.5 })] };
