/** What a file says of its picture before the first Gaussian. */
export interface Header {
  version: number;
  coding: 'packed' | 'entropy' | 'unknown';
  /** In pixels, as stored: before the picture is turned. */
  width: number;
  /** In pixels, as stored. */
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
  /**
   * The colour space: the codes of its primaries and of its transfer characteristics in Rec. ITU-T H.273, such as
   * 12 and 13 for Display P3, 9 and 16 for PQ, 9 and 18 for HLG. It counts before the ICC profile.
   */
  cicp: Uint8Array | null;
  /**
   * The display on which the picture was made: the payload of PNG's chunk `mDCV`, 24 bytes. They are CIE 1931 x and y of
   * red, green, blue and white, in 0.00002, in 16 bits each, then the most and the least luminance, in 0.0001 cd/m², in
   * 32 bits each. The most significant byte stands first.
   */
  masteringDisplay: Uint8Array | null;
  /**
   * How bright the picture is: the payload of PNG's chunk `cLLI`, 8 bytes. They are the luminance of the brightest pixel
   * and the mean of the picture, in 0.0001 cd/m², 0 if it is not known, as the luminances above.
   */
  contentLight: Uint8Array | null;
  /** The ICC profile of the colours; without one, and without codes, they are sRGB. */
  iccProfile: Uint8Array | null;
  exif: Uint8Array | null;
  xmp: string | null;
  texts: { keyword: string; text: string }[];
}

/**
 * How the picture is turned for display: the value in its Exif, 1 to 8, or 1 without one. It is 6 if the
 * picture is turned by 90 degrees clockwise. From 5 on, width and height are exchanged.
 */
export type Orientation = 1 | 2 | 3 | 4 | 5 | 6 | 7 | 8;

/** What has arrived. */
export interface Progress {
  header: Header | null;
  /** `null` until it is known, which may be later than the header, but before the first Gaussian. */
  orientation: Orientation | null;
  /** The number of Gaussians that have arrived. */
  gaussians: number;
  /**
   * Whether a colour space has arrived, in codes or as an ICC profile, and whether the texture has. Both may come after Gaussians: a picture that
   * was rendered before is to be rendered anew.
   */
  colorSpace: boolean;
  texture: boolean;
  /** Whether the whole file has arrived. */
  complete: boolean;
}

/** Whether the output is upright, as `createImageBitmap` has it in `imageOrientation`, or as stored. */
export type OrientationOption = 'from-image' | 'none';

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
   * evaluated there, and nothing is resampled. Default: the picture's own size; with one of them, the
   * other follows from the proportions.
   */
  width?: number;
  height?: number;
  /** The part of that output to render. Its samples are those of the whole, bit for bit. */
  region?: Region;
  /** Render only the first Gaussians of the file. Default: all that have arrived. */
  gaussians?: number;
  /**
   * Whether the picture's texture is rendered: noise in place of what the file has no samples of, such as sand
   * and water. Without it the picture is smoother, and nearer to the source sample by sample. Default: true.
   */
  texture?: boolean;
  /**
   * `from-image`: the output is upright, and so are the sizes and the region above. `none`: all are as
   * stored. Default: `from-image` for pictures, `none` for `samples`.
   */
  orientation?: OrientationOption;
}

export interface GaussianOptions {
  /** Which ones, in the order of the file. Default: all that have arrived. */
  start?: number;
  end?: number;
  /** The frame of their places: that of the upright picture, or as stored. Default `none`. */
  orientation?: OrientationOption;
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
 * - 0, 1: x and y of its centre, in pixels of the picture's own size; that of the first pixel is
 *   (0.5, 0.5);
 * - 2, 3, 4: l11, l21 and l22 of the Cholesky factor L of its covariance L L^T, in pixels. The
 *   covariance is (l11 l11, l11 l21, l21 l21 + l22 l22) as (xx, xy, yy). The outline of the
 *   Mahalanobis distance r is the centre plus r L (cos t, sin t): x = l11 cos t,
 *   y = l21 cos t + l22 sin t, times r;
 * - 5 to 8: its amplitude in each channel, where 1 is a full sample; it may be negative. 0 in channels
 *   that the picture lacks.
 */
export type Gaussian9 = Float32Array;

/**
 * The map of a texture, for programs that make the texture themselves (spec, section 9.7): three planes of
 * ceil(height / 8) + 1 rows of ceil(width / 8) + 1 nodes, of the picture's stored size. They are the sums m0 to
 * m2, of which the strengths of two octaves follow, and the direction.
 */
export type TextureMap = Float32Array;

/** The small file that the first layers of a file make. */
export interface Prefix {
  /** How many layers it has: 0 in a file without Gaussians. */
  layers: number;
  /** How many Gaussians these have. */
  gaussians: number;
  /** How many bytes it has. */
  bytes: number;
  /** Where these layers end in the file that they are taken from: so many bytes of that are enough. */
  end: number;
}

export interface Statistics {
  /** The complete chunks by type. `type` are its letters, and `bytes` includes type, length and CRC. */
  chunks: { type: string; count: number; bytes: number }[];
  /** The layers that have arrived: their Gaussians, and where their chunks are in the file. */
  layers: { gaussians: number; start: number; end: number }[];
  /** The bits of all Gaussians by attribute; `null` without the option `statistics`. */
  attributeBits: { position: number; precision: number; shape: number; color: number } | null;
  /** The quantization steps of the entropy coding; `null` with the packed coding. */
  quantizationSteps: {
    position: number;
    size: number;
    ratio: number;
    slant: number;
    color: Float64Array;
  } | null;
}

/**
 * What a file may cost at most, each a number from 0 to `Infinity`, which removes a limit. What is left out
 * has the value of `defaultLimits`, which are those of the other decoders of the format. A `LimitError` names
 * the one to raise.
 */
export interface Limits {
  /** Largest width in pixels, of the file and of one rendering, as stored. Default 65,536. */
  width?: number;
  /** Largest height in pixels, of the file and of one rendering, as stored. Default 65,536. */
  height?: number;
  /** Most pixels, of the file and of one rendering. Default 2^28. */
  pixels?: number;
  /** Most pixels of one rendering. Default 2^26: 256 MiB of RGBA. */
  outputPixels?: number;
  /** Default 2^22. */
  gaussians?: number;
  /** Bytes that the decoder may hold, the output not counted. Default 512 MiB. */
  memory?: number;
  /** Kernel evaluations of one rendering beyond 64 for each pixel. Default 2^32: some ten seconds. */
  work?: number;
}
