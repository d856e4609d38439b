//! The colour models and sample depths that a picture can have (spec, section 5.2).

/// Evaluates an expression in which a constant is the number of channels, 1 to 4.
macro_rules! with_channels {
    ($constant:ident = $channels:expr, $value:expr) => {
        match $channels {
            1 => {
                const $constant: usize = 1;
                $value
            }
            2 => {
                const $constant: usize = 2;
                $value
            }
            3 => {
                const $constant: usize = 3;
                $value
            }
            _ => {
                const $constant: usize = 4;
                $value
            }
        }
    };
}
pub(crate) use with_channels;

/// The channels of a picture, in the order of its samples (spec, section 5.2).
///
/// Colours are sRGB-encoded unless an ICC profile says otherwise. Alpha is straight (colours are
/// not premultiplied by it) and linear.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ColorModel {
    /// One channel.
    Gray,
    /// Gray and alpha.
    GrayAlpha,
    /// Red, green, blue.
    Rgb,
    /// Red, green, blue, alpha.
    Rgba,
}

impl ColorModel {
    /// The number of channels, 1 to 4.
    #[must_use]
    pub const fn channels(self) -> usize {
        match self {
            Self::Gray => 1,
            Self::GrayAlpha => 2,
            Self::Rgb => 3,
            Self::Rgba => 4,
        }
    }

    /// Whether the last channel is alpha.
    #[must_use]
    pub const fn has_alpha(self) -> bool {
        matches!(self, Self::GrayAlpha | Self::Rgba)
    }

    /// The code in the header.
    #[cfg(feature = "encode")]
    pub(crate) const fn code(self) -> u8 {
        self.channels() as u8 - 1
    }

    /// The colour model with the code in the lowest two bits of the header's first byte.
    pub(crate) const fn from_code(byte: u8) -> Self {
        match byte & 3 {
            0 => Self::Gray,
            1 => Self::GrayAlpha,
            2 => Self::Rgb,
            _ => Self::Rgba,
        }
    }
}

/// Bits per sample: of the picture that was encoded, and of the output by default.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum SampleDepth {
    /// 8 bits per sample.
    Eight,
    /// 16 bits per sample.
    Sixteen,
}

impl SampleDepth {
    /// Bits per sample, 8 or 16.
    #[must_use]
    pub const fn bits(self) -> u8 {
        match self {
            Self::Eight => 8,
            Self::Sixteen => 16,
        }
    }

    /// Bytes per sample, 1 or 2.
    #[must_use]
    pub const fn bytes(self) -> usize {
        self.bits() as usize / 8
    }

    /// The largest sample, 255 or 65535: white, or opaque.
    #[must_use]
    pub const fn max_sample(self) -> u16 {
        match self {
            Self::Eight => 0xff,
            Self::Sixteen => 0xffff,
        }
    }
}
