//! What a caller can ask of the encoder.

/// What the file shall meet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Target {
    /// As many Gaussians as the picture needs for a sensible quality: the same as
    /// `Quality(75.0)`.
    #[default]
    Auto,
    /// At most this many Gaussians.
    Gaussians(u32),
    /// A file of this many bytes.
    Bytes(u64),
    /// A file of this many bits per pixel.
    BitsPerPixel(f64),
    /// A PSNR of the decoded file, in dB.
    Psnr(f64),
    /// A quality from 0 to 100.
    Quality(f64),
}

/// How attributes are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Precision {
    /// 32-bit floats: the fit exactly as it is.
    Float,
    /// Quantization-aware training and bit packing.
    Packed,
}
