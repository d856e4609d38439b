//! `.gip` files of Gaussians as 32-bit floats, written without the encoder: to change the Gaussians
//! of a file, and to make files that no encoder would write.

use anyhow::{Result, ensure};
use image_gip::{ColorModel, Kernel};

use crate::gip;

/// The signature (specification, section 4.1).
const SIGNATURE: [u8; 8] = *b"\xC7GIP\r\n\x01\n";
/// Components of a Gaussian in colour.
pub(super) const COMPONENTS: usize = 8;

/// An RGB picture of Gaussians as floats.
#[derive(Clone, Debug)]
pub(super) struct FloatFile {
    pub(super) size: (u32, u32),
    pub(super) kernel: Kernel,
    /// The colour behind the Gaussians; 65535 is a full sample.
    pub(super) base: [u16; 3],
    /// In the Cholesky parameterization: x, y, l11, l21, l22 and three amplitudes.
    pub(super) gaussians: Vec<[f32; COMPONENTS]>,
}

impl FloatFile {
    /// On mid-gray.
    pub(super) fn new(size: (u32, u32), kernel: Kernel, gaussians: Vec<[f32; COMPONENTS]>) -> Self {
        Self { size, kernel, base: [0x8080; 3], gaussians }
    }

    /// The Gaussians of any `.gip` file of an RGB picture, but for those whose covariance has no
    /// Cholesky factor, which are not drawn either.
    pub(super) fn read(file: &[u8]) -> Result<Self> {
        gip::open(file, |picture| {
            let header = picture.header();
            ensure!(header.color == ColorModel::Rgb, "the file is not RGB");
            let [red, green, blue, _] = header.base_color;
            let gaussians = picture.gaussians().iter().map(|gaussian| {
                let ([x, y], [l11, l21, l22]) = (gaussian.center, gaussian.cholesky);
                let [r, g, b, _] = gaussian.color;
                [x, y, l11, l21, l22, r, g, b]
            });
            let gaussians = gaussians.filter(|row| row.iter().all(|value| value.is_finite()));
            Ok(Self {
                size: (header.width, header.height),
                kernel: header.kernel,
                base: [red, green, blue],
                gaussians: gaussians.collect(),
            })
        })
    }

    /// The file. It is one of 16 bits, as a colour behind the Gaussians may be between those of 8 bits.
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let count = self.gaussians.len() as u32;
        // RGB, 16 bits, packed coding, this kernel, parameterization 1: Cholesky.
        let kernel = u8::from(self.kernel == Kernel::Quartic);
        let mut header = vec![2 | 1 << 2 | kernel << 4 | 1 << 5];
        header.extend([self.size.0, self.size.1, count].map(number).concat());
        if count > 0 {
            header.extend(number(1));
        }
        header.extend(self.base.map(u16::to_le_bytes).concat());
        if let Kernel::Exponential { cutoff } = self.kernel {
            header.extend(cutoff.to_le_bytes());
        }
        if count > 0 {
            // Every component: kind 0 (float), 32 bits.
            header.extend([0, 32].repeat(COMPONENTS));
        }
        let mut file = [SIGNATURE.to_vec(), chunk(b'H', &header)].concat();
        if count > 0 {
            let values = self.gaussians.iter().flatten().flat_map(|value| value.to_le_bytes());
            file.extend(chunk(b'L', &values.collect::<Vec<u8>>()));
        }
        file.extend(chunk(b'E', &[]));
        file
    }
}

fn chunk(kind: u8, payload: &[u8]) -> Vec<u8> {
    let body = [&[kind], &number(payload.len() as u32)[..], payload].concat();
    [&body[..], &crc32fast::hash(&body).to_le_bytes()].concat()
}

/// A number as a file has it: seven bits in each byte, the lowest first (specification, section 2).
fn number(mut value: u32) -> Vec<u8> {
    let mut bytes = vec![];
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
    bytes
}

#[cfg(test)]
mod tests {
    use image_gip::StreamDecoder;

    use super::*;

    #[test]
    fn the_decoder_reads_what_is_written() {
        let gaussians = vec![
            [3.0, 2.0, 1.5, 0.5, 1.0, 0.5, 0.0, -0.5],
            [5.0, 3.5, 1.0, -0.5, 0.75, 0.0, -0.125, 0.875],
        ];
        for (kernel, gaussians) in [
            (Kernel::PAPER, gaussians.clone()),
            (Kernel::Quartic, gaussians),
            (Kernel::Quartic, vec![]),
        ] {
            let written =
                FloatFile { base: [1, 2, 65_535], ..FloatFile::new((300, 4), kernel, gaussians) };
            let bytes = written.to_bytes();
            let mut decoder = StreamDecoder::new();
            decoder.feed(&bytes).expect("a valid file");
            assert!(decoder.is_complete());
            let read = FloatFile::read(&bytes).expect("it is RGB");
            assert_eq!((read.size, read.kernel), (written.size, written.kernel));
            assert_eq!((read.base, read.gaussians), (written.base, written.gaussians));
        }
    }

    #[test]
    fn covariances_without_a_cholesky_factor_are_left_out() {
        // In the covariance parameterization: x, y, xx, xy, yy and three amplitudes.
        let sound = [3.0, 2.0, 4.0, 2.0, 2.0, 0.5, 0.0, -0.5];
        let indefinite = [3.0, 2.0, 4.0, 2.0, 0.5, 0.5, 0.0, -0.5];
        let mut bytes = FloatFile::new((6, 4), Kernel::Quartic, vec![sound, indefinite]).to_bytes();
        // After the signature come the letter and the length of the header, and then its format.
        let (start, format) = (SIGNATURE.len(), SIGNATURE.len() + 2);
        let crc = format + usize::from(bytes[start + 1]);
        bytes[format] &= !(0b11 << 5);
        let corrected = crc32fast::hash(&bytes[start..crc]).to_le_bytes();
        bytes[crc..crc + 4].copy_from_slice(&corrected);
        let read = FloatFile::read(&bytes).expect("it is RGB");
        assert_eq!(read.gaussians, [[3.0, 2.0, 2.0, 1.0, 1.0, 0.5, 0.0, -0.5]]);
    }
}
