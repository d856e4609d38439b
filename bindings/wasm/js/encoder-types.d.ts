// What both interfaces of the encoder take and give.

/** Interleaved samples, rows from the top: `width` x `height` x `channels` of them. An `ImageData` is one. */
export interface Pixels {
  width: number;
  height: number;
  /** 0 to 255 in an array of bytes, 0 to 65535 in a `Uint16Array`. Alpha is straight. */
  data: Uint8Array | Uint8ClampedArray | Uint16Array;
  /**
   * 1 gray; 2 gray, alpha; 3 red, green, blue; 4 red, green, blue, alpha. Without it there are 4, and of 8 bits
   * alpha is left out where all is opaque, and colour where all is gray.
   */
  channels?: 1 | 2 | 3 | 4;
  /** `display-p3` is stored as codes (cICP); all else is taken for sRGB. */
  colorSpace?: string;
}

/** At most one of these may be given; without any it is `quality: 75`. */
export interface Target {
  /** Visual quality, 0 to 100, on the scale of SSIMULACRA2: about 50 is medium, 70 high. No more than 97 is aimed at. */
  quality?: number;
  /** Most bytes of the file, 1 to 2^30. */
  bytes?: number;
  /** Most bits per pixel of the file, 1e-6 to 1e6. */
  bpp?: number;
  /** PSNR of the decoded file without its texture in dB, 1 to 120. */
  psnr?: number;
  /** Most Gaussians, 1 to 2^22. */
  gaussians?: number;
}

export interface EncodeOptions extends Target {
  /** How much time to spend, 1 (least) to 7 (most); each takes about twice as long as the one before. Default 4. */
  effort?: number;
  /** What to minimize: the error that a person sees, or the squared error. Default `visual`. */
  tune?: 'visual' | 'psnr';
  /** The strength of the texture in place of fine irregular detail, 0 (none) to 100. Default 50. */
  texture?: number;
  /**
   * Most bytes, 80 to 65536, of the file that the first layer makes: the placeholder, with which the file begins.
   * By default it has about a tenth of the file.
   */
  firstLayer?: number;
  /** The seed of all random numbers, 0 to 2^32 - 1. Default 0. */
  seed?: number;
  /** Whether colours are kept where alpha is 0. Default `false`: what does not show takes the colours around it. */
  keepInvisible?: boolean;
  /** What is stored with the picture, as it is. */
  metadata?: {
    /** Colour primaries and transfer characteristics, as H.273 has them. It counts before the ICC profile. */
    cicp?: [number, number];
    iccProfile?: Uint8Array;
    /** A TIFF stream. An orientation in it says how the samples are to be turned. */
    exif?: Uint8Array;
    xmp?: string;
    texts?: { keyword: string; text: string }[];
  };
}

export interface Progress {
  /** The share of the work that is done, 0 to 1; it never falls. */
  fraction: number;
  /** Iterations of training, done and planned. */
  iteration: number;
  iterations: number;
  /** The present number of Gaussians, and their PSNR in dB. */
  gaussians: number;
  psnr: number;
}

export interface Encoded {
  /** The whole `.gip` file. */
  file: Uint8Array<ArrayBuffer>;
  report: {
    gaussians: number;
    /** PSNR in dB of the decoded file without its texture; infinite for an exact copy. */
    psnr: number;
    /** An estimate of SSIMULACRA2, 0 to 100, within about 2. */
    quality: number;
    textureBytes: number;
    iterations: number;
    /** Why the file misses its target by more than the tolerance, in words; `null` if it does not. */
    shortfall: string | null;
  };
}
