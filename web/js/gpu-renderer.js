// Runs the shader of `gpu` with WebGPU: all Gaussians, anew for each frame.

import { mostOverlap } from './overlap.js';

/** Most evaluations of the kernel in a frame: more could stop the GPU for seconds. */
const MOST_WORK = 2 ** 34;
/** Width and height of a tile of the shader in pixels, and the most bins along a side. */
const TILE = 16;
const MOST_BINS = 16;
/** Gaussians of a workgroup of `prepare`. */
const PREPARE = 256;
const KERNELS = { exponential: 0, quartic: 1 };

/** Most pixels of the grid for one of the output along an axis. */
const MOST_PER_PIXEL = 8;

/** How the shader says what turned a picture, by the value in Exif. From 5 on, its axes are exchanged. */
const TURNS = { 1: 0, 2: 1, 3: 3, 4: 2, 5: 4, 6: 6, 7: 7, 8: 5 };

/** One axis of the grid that an output is evaluated on, and what of it a part covers (spec, section 9.2). */
function axis(stored, output, start, length) {
  let divisor = 1;
  while (MOST_PER_PIXEL * (output + 1) * divisor < stored) divisor *= 2;
  const grid = Math.max(output, Math.ceil(stored / divisor));
  const ratio = grid / output;
  const first = Math.floor((start * grid) / output);
  const end = Math.ceil(((start + length) * grid) / output);
  return { scale: grid / stored, ratio, first, length: end - first, offset: start * ratio - first };
}

/** The tiles and bins of what is evaluated of the grid, as the shader divides it. */
function divide(width, height) {
  const [columns, rows] = [Math.ceil(width / TILE), Math.ceil(height / TILE)];
  const binTiles = Math.ceil(Math.max(columns, rows) / MOST_BINS);
  return { binTiles, bins: Math.ceil(columns / binTiles) * Math.ceil(rows / binTiles) };
}

export class GpuRenderer {
  #device;
  #layout;
  #prepare;
  #render;
  #view;
  /** { header, hasTexture, gaussians, splats, bins, map, overlap }: the picture and its buffers. */
  #picture = null;

  /** Compiles the shader: `code` is that of render.wgsl. */
  static async create(device, code) {
    const binding = (index, resource) => ({ binding: index, visibility: GPUShaderStage.COMPUTE, ...resource });
    const layout = device.createBindGroupLayout({
      entries: [
        binding(0, { buffer: { type: 'uniform' } }),
        binding(1, { buffer: { type: 'read-only-storage' } }),
        binding(2, { buffer: { type: 'storage' } }),
        binding(3, { buffer: { type: 'storage' } }),
        binding(4, { storageTexture: { format: 'rgba8unorm' } }),
        binding(5, { buffer: { type: 'read-only-storage' } }),
      ],
    });
    const module = device.createShaderModule({ code });
    const pipelineLayout = device.createPipelineLayout({ bindGroupLayouts: [layout] });
    const pipelines = ['prepare', 'render'].map((entryPoint) =>
      device.createComputePipelineAsync({ layout: pipelineLayout, compute: { module, entryPoint } }),
    );
    return new GpuRenderer(device, layout, await Promise.all(pipelines));
  }

  constructor(device, layout, [prepare, render]) {
    this.#device = device;
    this.#layout = layout;
    this.#prepare = prepare;
    this.#render = render;
    this.#view = device.createBuffer({ size: 112, usage: GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST });
  }

  /**
   * Takes a picture: its header and nine numbers for each Gaussian, both turned, and the map of its texture as
   * stored, or `null`. Returns whether it can.
   */
  setPicture(header, numbers, map) {
    this.clear();
    const count = Math.max(1, numbers.length / 9);
    const words = Math.ceil(count / 32);
    const sizes = {
      gaussians: 36 * count,
      splats: 48 * count,
      bins: 4 * words * MOST_BINS ** 2,
      map: map?.byteLength ?? 4,
    };
    const { maxStorageBufferBindingSize, maxBufferSize } = this.#device.limits;
    const most = Math.min(maxStorageBufferBindingSize, maxBufferSize);
    if (!(header.kernel in KERNELS) || Math.max(...Object.values(sizes)) > most) return false;
    const usage = GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_DST;
    this.#picture = { header, hasTexture: map !== null, overlap: mostOverlap(numbers, header) };
    for (const [name, size] of Object.entries(sizes)) {
      this.#picture[name] = this.#device.createBuffer({ size, usage });
    }
    this.#device.queue.writeBuffer(this.#picture.gaussians, 0, numbers);
    if (map) this.#device.queue.writeBuffer(this.#picture.map, 0, map);
    return true;
  }

  /** Frees the picture. */
  clear() {
    for (const name of ['gaussians', 'splats', 'bins', 'map']) this.#picture?.[name].destroy();
    this.#picture = null;
  }

  /** Whether there is a picture, and so many pixels of a level of it are little enough work. */
  canRender(level, pixels) {
    if (this.#picture === null) return false;
    const { header, overlap } = this.#picture;
    const [x, y] = ['width', 'height'].map((side) => axis(header[side], level[side], 0, level[side]).ratio);
    return overlap * pixels * x * y <= MOST_WORK;
  }

  /** What `record` needs to render the picture to a texture. */
  bind(texture) {
    const { gaussians, splats, bins, map } = this.#picture;
    const buffers = [this.#view, gaussians, splats, bins].map((buffer) => ({ buffer }));
    const resources = [...buffers, texture.createView(), { buffer: map }];
    const entries = resources.map((resource, binding) => ({ binding, resource }));
    return this.#device.createBindGroup({ layout: this.#layout, entries });
  }

  /**
   * Records the commands that render a region of a level (both in pixels) with the first Gaussians, and with the
   * picture's texture or without, to the corner of the GPU's texture of `bindings`.
   */
  record(encoder, { level, region, gaussians, texture }, bindings) {
    const { header, hasTexture } = this.#picture;
    const x = axis(header.width, level.width, region.x, region.width);
    const y = axis(header.height, level.height, region.y, region.height);
    const { binTiles, bins } = divide(x.length, y.length);
    const fade = 8 * Math.min(level.width / header.width, level.height / header.height) - 1;
    const strength = texture && hasTexture ? Math.min(Math.max(fade, 0), 1) : 0;
    this.#writeView({ x, y, region, gaussians, binTiles, fade: strength });
    const used = 4 * Math.ceil(gaussians / 32) * bins;
    if (used > 0) encoder.clearBuffer(this.#picture.bins, 0, used);
    const pass = encoder.beginComputePass();
    pass.setBindGroup(0, bindings);
    pass.setPipeline(this.#prepare);
    pass.dispatchWorkgroups(Math.ceil(gaussians / PREPARE));
    pass.setPipeline(this.#render);
    pass.dispatchWorkgroups(Math.ceil(region.width / TILE), Math.ceil(region.height / TILE));
    pass.end();
  }

  /** Fills the uniform `View` of the shader. */
  #writeView({ x, y, region, gaussians, binTiles, fade }) {
    const { header } = this.#picture;
    const { width, height, orientation } = header;
    const stored = orientation > 4 ? [height, width] : [width, height];
    const view = new DataView(new ArrayBuffer(112));
    const floats = (offset, values) =>
      values.forEach((value, index) => view.setFloat32(offset + 4 * index, value, true));
    const integers = (offset, values) =>
      values.forEach((value, index) => view.setUint32(offset + 4 * index, value, true));
    floats(0, [x.scale, y.scale, x.first, y.first]);
    integers(16, [x.length, y.length, gaussians, binTiles]);
    floats(32, header.baseColor.map((value) => value / 65535));
    integers(48, [header.channels, KERNELS[header.kernel]]);
    floats(56, [header.cutoff, fade]);
    floats(64, [x.ratio, y.ratio, x.offset, y.offset]);
    integers(80, [region.width, region.height, ...stored, TURNS[orientation]]);
    this.#device.queue.writeBuffer(this.#view, 0, view.buffer);
  }
}
