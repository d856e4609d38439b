/** What a file says of its picture before the first Gaussian. */
export interface Header {
  version: number;
  coding: 'packed' | 'entropy' | 'unknown';
  /** In pixels. */
  width: number;
  /** In pixels. */
  height: number;
  color: 'gray' | 'gray-alpha' | 'rgb' | 'rgba' | 'unknown';
  /** The number of channels, 1 to 4. */
  channels: number;
  /** Bits per sample of the picture that was encoded, 8 or 16. */
  depth: number;
  /** The number of Gaussians in all layers. */
  gaussians: number;
  layers: number;
  /**
   * The weight of a Gaussian at the squared Mahalanobis distance q: exp(-q / 2) or (1 - q / 4)^2,
   * and 0 for every q over `cutoff`.
   */
  kernel: 'exponential' | 'quartic' | 'unknown';
  cutoff: number;
  parameterization: 'covariance' | 'cholesky' | 'rotation-scale' | 'unknown';
  /** The colour that the Gaussians are added to, one value per channel, 0 to 65535. */
  baseColor: number[];
}

export interface Metadata {
  /** The ICC profile of the colours; without one they are sRGB. */
  iccProfile: Uint8Array | null;
  exif: Uint8Array | null;
  xmp: string | null;
  texts: { keyword: string; text: string }[];
}

/** What has arrived. */
export interface Progress {
  header: Header | null;
  /** The number of Gaussians that have arrived. */
  gaussians: number;
  /** Whether the whole file has arrived. */
  complete: boolean;
}

/** A rectangle in pixels of the output, inside of it. */
export interface Region {
  x: number;
  y: number;
  width: number;
  height: number;
}

export interface RenderOptions {
  /**
   * The size in pixels at which the whole picture is rendered, 1 to 2^23: the Gaussians are
   * evaluated there, and nothing is resampled. Default: the stored size; with one of them, the other
   * follows from the proportions.
   */
  width?: number;
  height?: number;
  /** The part of that output to render. Its samples are those of the whole, bit for bit. */
  region?: Region;
  /** Render only the first Gaussians of the file. Default: all that have arrived. */
  gaussians?: number;
}

export interface SampleOptions extends RenderOptions {
  /** Gray can become RGB, and an alpha channel can be added; none is dropped. Default: the file's. */
  color?: 'gray' | 'gray-alpha' | 'rgb' | 'rgba';
  /** Default: that of the file. */
  depth?: 8 | 16;
}

/** Interleaved samples: height x width x channels, rows from the top. Alpha is straight. */
export interface Samples {
  width: number;
  height: number;
  color: 'gray' | 'gray-alpha' | 'rgb' | 'rgba';
  channels: number;
  depth: 8 | 16;
  /** 0 to 255, or 0 to 65535. */
  data: Uint8ClampedArray | Uint16Array;
}

/**
 * Nine numbers for each Gaussian:
 *
 * - 0, 1: x and y of its centre, in pixels of the stored size; that of the first pixel is (0.5, 0.5);
 * - 2, 3, 4: l11, l21 and l22 of the Cholesky factor L of its covariance L L^T, in pixels. The
 *   covariance is (l11 l11, l11 l21, l21 l21 + l22 l22) as (xx, xy, yy). The outline of the
 *   Mahalanobis distance r is the centre plus r L (cos t, sin t): x = l11 cos t,
 *   y = l21 cos t + l22 sin t, times r;
 * - 5 to 8: its amplitude in each channel, where 1 is a full sample; it may be negative. 0 in channels
 *   that the picture lacks.
 */
export type Gaussian9 = Float32Array;

export interface Statistics {
  /** The complete chunks by type. `bytes` includes length, type and CRC. */
  chunks: { type: string; count: number; bytes: number }[];
  /** The layers that have arrived: their Gaussians, and where their chunks are in the file. */
  layers: { gaussians: number; start: number; end: number }[];
  /** The bits of all Gaussians by attribute; `null` without the option `statistics`. */
  attributeBits: { position: number; precision: number; shape: number; color: number } | null;
  /** The quantization steps of the entropy coding; `null` with the packed coding. */
  latticeSteps: {
    position: number;
    size: number;
    ratio: number;
    slant: number;
    color: Float64Array;
  } | null;
}

/** What a file may cost at most. What is left out has the value of `defaultLimits`. */
export interface Limits {
  /** Most pixels that the header may declare. Default 2^28. */
  pixels?: number;
  /** Most pixels of one rendering. Default 2^26: 256 MiB of RGBA. */
  outputPixels?: number;
  /** Default 2^21. */
  gaussians?: number;
  /** Bytes that the decoder may hold, the output not counted. Default 256 MiB. */
  memory?: number;
  /** Kernel evaluations of one rendering. Default 2^32: some ten seconds. */
  work?: number;
}
