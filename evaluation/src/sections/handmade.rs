//! `.gip` files of Gaussians that no encoder would choose.

use image_gip::{ColorModel, Kernel};

/// The signature (spec, section 4.1).
const SIGNATURE: [u8; 8] = *b"\xC7GIP\r\n\x1A\n";
/// Components of a Gaussian in colour.
pub(super) const COMPONENTS: usize = 8;

/// A file of floats in the Cholesky chart: x, y, l11, l21, l22 and three amplitudes, on mid-gray.
pub(super) fn file(
    (width, height): (u32, u32),
    kernel: Kernel,
    gaussians: &[[f32; COMPONENTS]],
) -> Vec<u8> {
    let count = gaussians.len() as u32;
    let kernel_code = u8::from(kernel == Kernel::Quartic);
    // Version 0, fixed-length coding, RGB, 8 bits.
    let mut header = vec![0, 0, 2, 8];
    header.extend([width, height, count].map(u32::to_le_bytes).concat());
    header.extend(u16::from(count > 0).to_le_bytes());
    // The Cholesky chart.
    header.extend([kernel_code, 1]);
    header.extend(kernel.cutoff().to_le_bytes());
    header.extend([0; 4]);
    header.extend([0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0, 0]);

    let float = [[0, 32, 0, 0], 1_f32.to_le_bytes(), 0_f32.to_le_bytes()].concat();
    let mut file = [SIGNATURE.to_vec(), chunk(b"GHDR", &header)].concat();
    file.extend(chunk(b"QNTZ", &float.repeat(COMPONENTS)));
    if count > 0 {
        let values = gaussians.iter().flatten().flat_map(|value| value.to_le_bytes());
        let layer: Vec<u8> = count.to_le_bytes().into_iter().chain(values).collect();
        file.extend(chunk(b"GAUS", &layer));
    }
    file.extend(chunk(b"GEND", &[]));
    file
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
        (1.0 - q / 8.0).powi(4)
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
        let gaussians = [
            [3.0, 2.0, 1.5, 0.5, 1.0, 0.5, 0.0, -0.5],
            [5.0, 3.5, 1.0, -0.5, 0.75, 0.0, -0.125, 0.875],
        ];
        for kernel in [Kernel::PAPER, Kernel::Quartic] {
            let mut decoder = StreamDecoder::new();
            decoder.feed(&file((6, 4), kernel, &gaussians)).expect("a sound file");
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
        }
    }

    #[test]
    fn a_file_without_gaussians_is_gray() {
        let mut decoder = StreamDecoder::new();
        decoder.feed(&file((2, 1), Kernel::Quartic, &[])).expect("a sound file");
        let planes = in_f64(&decoder.picture().expect("a picture"));
        assert_eq!(planes, [32896.0 / 65535.0; 6]);
    }
}
