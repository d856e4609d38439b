// Uses the package as a TypeScript program does. It is compiled, not run.

import { decode, GipError, LimitError, open, StreamDecoder } from '../dist/index.js';
import type { Header, Picture, Region, Samples, Source } from '../dist/index.js';
import { Decoder, load, memorySize } from '../dist/core.js';
import { encode } from '../dist/encoder.js';
import { encode as encodeHere, load as loadEncoder } from '../dist/encoder-core.js';
import { placeholder, prefix, prefixes } from '../dist/prefix.js';
import { ready } from '../dist/print.js';
import { watch } from '../dist/img.js';
import { install } from '../dist/transparent.js';
import type { GipImageElement } from '../dist/gip-image.js';

export async function everything(source: Source, signal: AbortSignal): Promise<void> {
  const region: Region = { x: 0, y: 0, width: 8, height: 8 };
  const image: ImageData = await decode(source, { width: 64, region, signal, limits: { work: 1e9 } });
  const picture: Picture = await open(new Response(), { statistics: true });
  const header: Header = picture.header;
  const samples: Samples = await picture.samples({ color: 'rgba', depth: 16 });
  const map: Float32Array | null = await picture.textureMap();
  const numbers: Float32Array = await picture.gaussians({ start: 0, end: 10, orientation: 'from-image' });
  const turned: boolean = picture.orientation > 4 && picture.naturalWidth === header.height;
  const { layers, attributeBits } = await picture.statistics();
  const shape: number | undefined = attributeBits?.shape;
  const stream = new StreamDecoder();
  const { complete } = await stream.feed(new Uint8Array());
  const maybe: Header | null = stream.header;
  const unknown: boolean = stream.orientation === null;
  await load(new URL('https://example.com/'));
  const decoder = new Decoder({ limits: { memory: 1e6 } });
  const data: Uint8ClampedArray = decoder.render({ gaussians: 3, orientation: 'none', texture: false }).data;
  const element: GipImageElement = document.createElement('gip-image');
  element.loading = 'lazy';
  element.texture = 'off';
  element.detail = 'full';
  await ready;
  watch(document);
  element.limits = { height: 2 ** 20, work: Infinity };
  await element.decode();
  const png: Blob = await picture.png({ width: 10 });
  const bytes: number = memorySize();
  const small: Uint8Array = prefix(new Uint8Array(), prefixes(new Uint8Array())[0].bytes);
  const { masteringDisplay } = await picture.metadata();
  void [small, masteringDisplay, map, turned, unknown, png, bytes, image, header, samples, numbers, layers, shape, complete, maybe, data];
  // @ts-expect-error: not a source
  await decode(12);
  // @ts-expect-error: there is no such orientation
  await decode(source, { orientation: 6 });
  // @ts-expect-error: there is no such colour model
  await picture.samples({ color: 'cmyk' });
}

export async function encoding(image: ImageData, signal: AbortSignal): Promise<string> {
  const onprogress = ({ fraction }: { fraction: number }) => void fraction;
  const { file, report } = await encode(new Blob(), { quality: 60, effort: 2, threads: 2, signal, onprogress, colorSpace: 'display-p3' });
  const shortfall: string | null = report.shortfall;
  await loadEncoder();
  const other: Uint8Array = encodeHere({ ...image, channels: 4 }, { bytes: 300, metadata: { cicp: [12, 13] } }).file;
  const registration: ServiceWorkerRegistration = await install('/service-worker.js', { scope: '/' });
  void [shortfall, other, registration];
  // @ts-expect-error: there is no such tuning
  await encode(image, { tune: 'loud' });
  return placeholder(file, 400);
}

export function chunkOf(error: unknown): string | null {
  if (error instanceof LimitError) return `${error.limit} ${error.wanted}`;
  return error instanceof GipError ? error.chunk : null;
}
