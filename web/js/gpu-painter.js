// Paints frames to a canvas with WebGPU.

import { GpuRenderer } from './gpu-renderer.js';
import { visibleRegion } from './view.js';

const textOf = async (path) => (await fetch(new URL(path, import.meta.url))).text();

export class GpuPainter {
  /** The GPU in words. */
  name;
  device;
  #canvas;
  #context;
  #renderer;
  #show;
  #place;
  /** The texture with what was rendered, of the size of the window, and the bindings for it. */
  #rendered = null;

  /**
   * A painter for a canvas; `null` where WebGPU is missing, or only a program stands in for a GPU and
   * `anyAdapter` does not allow that: tiles in workers are faster then. `onLost` is called when the
   * GPU fails.
   */
  static async create(canvas, { anyAdapter = false, onLost }) {
    const adapter = await navigator.gpu?.requestAdapter();
    if (!adapter || (adapter.info.isFallbackAdapter && !anyAdapter)) return null;
    const { maxStorageBufferBindingSize, maxBufferSize } = adapter.limits;
    const requiredLimits = { maxStorageBufferBindingSize, maxBufferSize };
    const device = await adapter.requestDevice({ requiredLimits });
    device.lost.then(onLost);
    device.addEventListener('uncapturederror', onLost);
    const [render, show] = await Promise.all(['../shader/render.wgsl', '../shader/show.wgsl'].map(textOf));
    const renderer = await GpuRenderer.create(device, render);
    const { vendor, architecture, description } = adapter.info;
    return new GpuPainter(canvas, device, renderer, show, description || `${vendor} ${architecture}`);
  }

  constructor(canvas, device, renderer, code, name) {
    this.name = name;
    this.device = device;
    this.#canvas = canvas;
    this.#renderer = renderer;
    this.#context = canvas.getContext('webgpu');
    const format = navigator.gpu.getPreferredCanvasFormat();
    this.#context.configure({ device, format, alphaMode: 'premultiplied' });
    const module = device.createShaderModule({ code });
    const fragment = { module, targets: [{ format }] };
    this.#show = device.createRenderPipeline({ layout: 'auto', vertex: { module }, fragment });
    this.#place = device.createBuffer({ size: 16, usage: GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST });
  }

  /** Takes a picture, as `GpuRenderer.setPicture` does. Returns whether it can. */
  setPicture(header, numbers, map) {
    this.#free();
    return this.#renderer.setPicture(header, numbers, map);
  }

  canPaint({ frame: { window, level } }) {
    const { maxTextureDimension2D } = this.device.limits;
    const fits = Math.max(window.width, window.height) <= maxTextureDimension2D;
    return fits && this.#renderer.canRender(level, window.width * window.height);
  }

  /** Paints a frame to the canvas, or to another texture of its format and the window's size. */
  paint({ frame, gaussians, texture }, target = null) {
    const { window, level, left, top } = frame;
    if (this.#canvas.width !== window.width || this.#canvas.height !== window.height) {
      Object.assign(this.#canvas, window);
      this.#free();
    }
    this.#rendered ??= this.#newTexture(window);
    const encoder = this.device.createCommandEncoder();
    const region = visibleRegion(frame);
    if (region) this.#renderer.record(encoder, { level, region, gaussians, texture }, this.#rendered.toRender);
    const place = region ? [left + region.x, top + region.y, region.width, region.height] : [0, 0, 0, 0];
    this.device.queue.writeBuffer(this.#place, 0, Float32Array.from(place));
    const view = (target ?? this.#context.getCurrentTexture()).createView();
    const pass = encoder.beginRenderPass({ colorAttachments: [{ view, loadOp: 'clear', storeOp: 'store' }] });
    pass.setPipeline(this.#show);
    pass.setBindGroup(0, this.#rendered.toShow);
    pass.draw(3);
    pass.end();
    this.device.queue.submit([encoder.finish()]);
  }

  #newTexture({ width, height }) {
    const usage = GPUTextureUsage.STORAGE_BINDING | GPUTextureUsage.TEXTURE_BINDING;
    const texture = this.device.createTexture({ size: [width, height], format: 'rgba8unorm', usage });
    const toShow = this.device.createBindGroup({
      layout: this.#show.getBindGroupLayout(0),
      entries: [
        { binding: 0, resource: { buffer: this.#place } },
        { binding: 1, resource: texture.createView() },
      ],
    });
    return { texture, toShow, toRender: this.#renderer.bind(texture) };
  }

  #free() {
    this.#rendered?.texture.destroy();
    this.#rendered = null;
  }
}
