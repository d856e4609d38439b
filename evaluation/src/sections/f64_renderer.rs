//! The formula of the specification in `f64`, without any of the decoder's code.

use image_gip::{ColorModel, Kernel, Picture};

/// An RGB picture by the formula of the specification (section 9): planes, one after the other.
pub(super) fn render(picture: &Picture<'_>) -> Vec<f64> {
    let header = picture.header();
    assert_eq!(header.color, ColorModel::Rgb, "only RGB is rendered");
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

/// The kernel at a squared Mahalanobis distance `q`.
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
    use image_gip::RenderOptions;

    use super::*;
    use crate::gip;
    use crate::sections::float_file::FloatFile;

    #[test]
    fn the_decoder_agrees_with_the_formula() {
        let gaussians = vec![
            [3.0, 2.0, 1.5, 0.5, 1.0, 0.5, 0.0, -0.5],
            [5.0, 3.5, 1.0, -0.5, 0.75, 0.0, -0.125, 0.875],
        ];
        for kernel in [Kernel::PAPER, Kernel::Quartic] {
            let file = FloatFile::new((6, 4), kernel, gaussians.clone()).to_bytes();
            let (samples, expected) = gip::open(&file, |picture| {
                let mut samples = vec![0.0; 6 * 4 * 3];
                picture.render_planes(&RenderOptions::new(), &mut samples)?;
                Ok((samples, render(&picture)))
            })
            .expect("a small picture");
            assert!(expected.iter().any(|&sample| (sample - expected[0]).abs() > 0.1));
            for (sample, expected) in samples.iter().zip(expected) {
                assert!((f64::from(*sample) - expected).abs() < 1e-6, "{sample} {expected}");
            }
        }
    }

    #[test]
    fn values_computed_by_hand() {
        // At a pixel's centre, and two to the right of it, where q is 1.
        let gaussian = [0.5, 0.5, 2.0, 0.0, 2.0, 0.25, -0.25, 0.5];
        let planes = |kernel| {
            let file = FloatFile::new((3, 1), kernel, vec![gaussian]).to_bytes();
            gip::open(&file, |picture| Ok(render(&picture))).expect("a small picture")
        };
        let base = 32896.0 / 65535.0;
        for (kernel, weight) in
            [(Kernel::Quartic, 0.75_f64.powi(2)), (Kernel::PAPER, (-0.5_f64).exp())]
        {
            let planes = planes(kernel);
            for (channel, amplitude) in [0.25, -0.25, 0.5].into_iter().enumerate() {
                assert_eq!(planes[3 * channel], base + amplitude);
                assert_eq!(planes[3 * channel + 2], base + amplitude * weight);
            }
        }
    }

    #[test]
    fn without_gaussians_there_is_the_base_colour() {
        let file = FloatFile::new((2, 1), Kernel::Quartic, vec![]).to_bytes();
        let planes = gip::open(&file, |picture| Ok(render(&picture))).expect("a small picture");
        assert_eq!(planes, [32896.0 / 65535.0; 6]);
    }
}
