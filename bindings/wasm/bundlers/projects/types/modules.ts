/// <reference types="image-gip/client" />

import gip from 'image-gip/vite';
import { encode } from 'image-gip/encoder';
import { encode as encodeHere, load } from 'image-gip/encoder/core';
import { watch } from 'image-gip/img';
import { placeholder } from 'image-gip/prefix';
import { ready } from 'image-gip/print';
import { install } from 'image-gip/files/transparent.js';
import hero from './hero.jpg?gip';

export const text: string = hero.markup({ alt: hero.fallback ?? '', width: hero.width, class: null });
export const plugin: { name: string } = gip({ quality: 60, encoder: 'wasm' });

export async function all(image: ImageData, signal: AbortSignal): Promise<string> {
  await load();
  await ready;
  watch(document);
  await install('/service-worker.js', { scope: '/' });
  const { report } = encodeHere(image, { bytes: 2000, onprogress: ({ fraction }) => fraction < 0.5 });
  const { file } = await encode(new Blob(), { quality: 60, effort: 2, firstLayer: 300, signal, transfer: true });
  // @ts-expect-error: there is no such tuning
  await encode(image, { tune: 'loud' });
  return placeholder(file, report.gaussians);
}
