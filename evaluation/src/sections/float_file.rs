//! `.gip` files of Gaussians as 32-bit floats, written without the encoder: to change the Gaussians
//! of a file, and to make files that no encoder would write.

use anyhow::{Result, ensure};
use image_gip::{ColorModel, Kernel};

use crate::gip;

/// The signature (specification, section 4.1).
const SIGNATURE: [u8; 8] = *b"\xC7GIP\r\n\x1A\n";
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

    /// The file.
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let count = self.gaussians.len() as u32;
        let kernel_code = u8::from(self.kernel == Kernel::Quartic);
        // Version 1, coding 0 (packed), RGB, 8 bits.
        let mut header = vec![1, 0, 2, 8];
        header.extend([self.size.0, self.size.1, count].map(u32::to_le_bytes).concat());
        // One layer, or none.
        header.extend(u16::from(count > 0).to_le_bytes());
        // Parameterization 1: Cholesky.
        header.extend([kernel_code, 1]);
        header.extend(self.kernel.cutoff().to_le_bytes());
        header.extend([0; 4]);
        header.extend(self.base.map(u16::to_le_bytes).concat());
        header.extend([0; 2]);

        // Every component: kind 0 (float), 32 bits, scale 1, offset 0.
        let float = [[0, 32, 0, 0], 1_f32.to_le_bytes(), 0_f32.to_le_bytes()].concat();
        let mut file = [SIGNATURE.to_vec(), chunk(b"GHDR", &header)].concat();
        file.extend(chunk(b"QNTZ", &float.repeat(COMPONENTS)));
        if count > 0 {
            let values = self.gaussians.iter().flatten().flat_map(|value| value.to_le_bytes());
            let layer: Vec<u8> = count.to_le_bytes().into_iter().chain(values).collect();
            file.extend(chunk(b"GAUS", &layer));
        }
        file.extend(chunk(b"GEND", &[]));
        file
    }
}

fn chunk(kind: &[u8; 4], payload: &[u8]) -> Vec<u8> {
    let body = [kind, payload].concat();
    let length = (payload.len() as u32).to_le_bytes();
    [&length[..], &body, &crc32fast::hash(&body).to_le_bytes()].concat()
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
                FloatFile { base: [1, 2, 65_535], ..FloatFile::new((6, 4), kernel, gaussians) };
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
        // The header's payload begins after the signature, a length and a kind.
        let (kind, payload, end) = (12, 16, 16 + 36);
        bytes[payload + 19] = 0;
        let crc = crc32fast::hash(&bytes[kind..end]).to_le_bytes();
        bytes[end..end + 4].copy_from_slice(&crc);
        let read = FloatFile::read(&bytes).expect("it is RGB");
        assert_eq!(read.gaussians, [[3.0, 2.0, 2.0, 1.0, 1.0, 0.5, 0.0, -0.5]]);
    }
}
