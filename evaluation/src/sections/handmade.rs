//! `.gip` files of Gaussians that no encoder would choose.

use anyhow::{Result, ensure};
use image_gip::{ColorModel, Kernel};

use crate::gip;

/// The signature (spec, section 4.1).
const SIGNATURE: [u8; 8] = *b"\xC7GIP\r\n\x1A\n";
/// Components of a Gaussian in colour.
pub(super) const COMPONENTS: usize = 8;

/// A picture of Gaussians as floats.
#[derive(Clone, Debug)]
pub(super) struct Handmade {
    pub(super) size: (u32, u32),
    pub(super) kernel: Kernel,
    /// The colour behind the Gaussians, 65535 being a full sample.
    pub(super) base: [u16; 3],
    /// In the Cholesky chart: x, y, l11, l21, l22 and three amplitudes.
    pub(super) gaussians: Vec<[f32; COMPONENTS]>,
}

impl Handmade {
    /// On mid-gray.
    pub(super) fn new(size: (u32, u32), kernel: Kernel, gaussians: Vec<[f32; COMPONENTS]>) -> Self {
        Self { size, kernel, base: [0x8080; 3], gaussians }
    }

    /// What a file of RGB has, to be changed.
    pub(super) fn from_file(file: &[u8]) -> Result<Self> {
        gip::open(file, |picture| {
            let header = picture.header();
            ensure!(header.color == ColorModel::Rgb, "the file is not RGB");
            let [red, green, blue, _] = header.base_color;
            let gaussians = picture.gaussians().iter().map(|gaussian| {
                let ([x, y], [l11, l21, l22]) = (gaussian.center, gaussian.cholesky);
                let [r, g, b, _] = gaussian.color;
                [x, y, l11, l21, l22, r, g, b]
            });
            Ok(Self {
                size: (header.width, header.height),
                kernel: header.kernel,
                base: [red, green, blue],
                gaussians: gaussians.collect(),
            })
        })
    }

    /// The file.
    pub(super) fn file(&self) -> Vec<u8> {
        let count = self.gaussians.len() as u32;
        let kernel_code = u8::from(self.kernel == Kernel::Quartic);
        // Version 0, fixed-length coding, RGB, 8 bits.
        let mut header = vec![1, 0, 2, 8];
        header.extend([self.size.0, self.size.1, count].map(u32::to_le_bytes).concat());
        header.extend(u16::from(count > 0).to_le_bytes());
        // The Cholesky chart.
        header.extend([kernel_code, 1]);
        header.extend(self.kernel.cutoff().to_le_bytes());
        header.extend([0; 4]);
        header.extend(self.base.map(u16::to_le_bytes).concat());
        header.extend([0; 2]);

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

/// A picture by the formula of the spec (section 9) in `f64`: planes, one after the other.
pub(super) fn in_f64(picture: &image_gip::Picture<'_>) -> Vec<f64> {
    let header = picture.header();
    debug_assert_eq!(header.color, ColorModel::Rgb);
    let (width, height) = (header.width as usize, header.height as usize);
    let base = header.base_color.map(|base| f64::from(base) / 65535.0);
    let mut planes: Vec<f64> =
        base[..3].iter().flat_map(|&base| vec![base; width * height]).collect();
    for gaussian in picture.gaussians().iter().filter(|gaussian| gaussian.is_drawable()) {
        let [x, y] = gaussian.center.map(f64::from);
        let [l11, l21, l22] = gaussian.cholesky.map(f64::from);
        for pixel in 0..width * height {
            let dx = (pixel % width) as f64 + 0.5 - x;
            let dy = (pixel / width) as f64 + 0.5 - y;
            let u = dx / l11;
            let v = (dy - l21 * u) / l22;
            let weight = weight(header.kernel, u * u + v * v);
            for (channel, &amplitude) in gaussian.color[..3].iter().enumerate() {
                planes[channel * width * height + pixel] += f64::from(amplitude) * weight;
            }
        }
    }
    planes
}

fn weight(kernel: Kernel, q: f64) -> f64 {
    if q > f64::from(kernel.cutoff()) {
        0.0
    } else if kernel == Kernel::Quartic {
        (1.0 - q / 4.0).powi(2)
    } else {
        (-0.5 * q).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image_gip::{RenderOptions, StreamDecoder};

    #[test]
    fn the_decoder_reads_the_file_and_agrees_with_the_formula() {
        let gaussians = vec![
            [3.0, 2.0, 1.5, 0.5, 1.0, 0.5, 0.0, -0.5],
            [5.0, 3.5, 1.0, -0.5, 0.75, 0.0, -0.125, 0.875],
        ];
        for kernel in [Kernel::PAPER, Kernel::Quartic] {
            let mut decoder = StreamDecoder::new();
            let file = Handmade::new((6, 4), kernel, gaussians.clone()).file();
            decoder.feed(&file).expect("a sound file");
            assert!(decoder.is_complete());
            let picture = decoder.picture().expect("a picture");
            assert_eq!(picture.gaussians().len(), 2);
            let mut planes = vec![0.0; 6 * 4 * 3];
            picture.render_planes(&RenderOptions::new(), &mut planes).expect("a small picture");
            let expected = in_f64(&picture);
            assert!(expected.iter().any(|&sample| (sample - expected[0]).abs() > 0.1));
            for (sample, expected) in planes.iter().zip(expected) {
                assert!((f64::from(*sample) - expected).abs() < 1e-6, "{sample} {expected}");
            }
            assert_eq!(Handmade::from_file(&file).expect("it is RGB").file(), file);
        }
    }

    #[test]
    fn a_file_without_gaussians_is_gray() {
        let mut decoder = StreamDecoder::new();
        let file = Handmade::new((2, 1), Kernel::Quartic, vec![]).file();
        decoder.feed(&file).expect("a sound file");
        let planes = in_f64(&decoder.picture().expect("a picture"));
        assert_eq!(planes, [32896.0 / 65535.0; 6]);
    }
}
