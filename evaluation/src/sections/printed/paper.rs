//! What the paper prints, from an NVIDIA A30: its own methods and those that are not run here.

/// A row of the paper's table 1: how well a method fits the pictures of a data set.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PrintedFit {
    pub(crate) method: &'static str,
    /// `None` for a network, which has none.
    pub(crate) gaussians: Option<u32>,
    pub(crate) parameters: f64,
    /// PSNR, MS-SSIM, GPU memory in MiB, training seconds, frames per second.
    pub(crate) figures: [f64; 5],
}

/// A row of the paper's table 2: a codec at one rate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PrintedCodec {
    pub(crate) codec: &'static str,
    /// Bits per pixel, PSNR, MS-SSIM, encoding seconds, pictures decoded per second.
    pub(crate) figures: [f64; 5],
}

/// Table 1 for Kodak.
pub(crate) const KODAK: [PrintedFit; 11] = [
    fit("SIREN, printed", None, 3.74, [26.50, 0.875, 2044.0, 889.45, 977.0]),
    fit("3DGS, printed", Some(5_000), 0.30, [27.02, 0.942, 922.0, 331.39, 988.0]),
    fit("MiraGe, printed", Some(5_000), 0.10, [29.27, 0.958, 1242.0, 247.93, 1695.0]),
    fit("GaussianImage, printed", Some(5_000), 0.04, [29.85, 0.962, 812.0, 93.49, 2305.0]),
    fit("LIG, printed", Some(5_000), 0.04, [28.25, 0.946, 832.0, 118.40, 1394.0]),
    fit("GaussianImage++, printed", Some(5_000), 0.04, [31.83, 0.960, 856.0, 116.05, 2365.0]),
    fit("3DGS, printed", Some(10_000), 0.59, [29.99, 0.968, 918.0, 337.67, 947.0]),
    fit("MiraGe, printed", Some(10_000), 0.21, [30.41, 0.961, 1234.0, 387.71, 496.0]),
    fit("GaussianImage, printed", Some(10_000), 0.08, [32.48, 0.982, 814.0, 115.89, 2009.0]),
    fit("LIG, printed", Some(10_000), 0.08, [31.00, 0.975, 832.0, 125.37, 1331.0]),
    fit("GaussianImage++, printed", Some(10_000), 0.08, [35.41, 0.983, 876.0, 118.76, 2216.0]),
];

/// Table 1 for DIV2K, where SIREN has no frames per second.
pub(crate) const DIV2K: [PrintedFit; 11] = [
    fit("SIREN, printed", None, 0.42, [29.00, 0.886, 23_913.0, 4957.0, f64::NAN]),
    fit("3DGS, printed", Some(10_000), 0.59, [24.60, 0.897, 2652.0, 1287.44, 458.0]),
    fit("MiraGe, printed", Some(10_000), 0.25, [27.32, 0.921, 2802.0, 2146.0, 584.0]),
    fit("GaussianImage, printed", Some(10_000), 0.08, [26.54, 0.910, 1042.0, 275.49, 825.0]),
    fit("LIG, printed", Some(10_000), 0.08, [24.66, 0.848, 964.0, 288.57, 834.0]),
    fit("GaussianImage++, printed", Some(10_000), 0.08, [28.14, 0.914, 958.0, 323.74, 1011.0]),
    fit("3DGS, printed", Some(50_000), 2.95, [29.58, 0.965, 3298.0, 1422.47, 351.0]),
    fit("MiraGe, printed", Some(50_000), 1.16, [33.23, 0.981, 2268.0, 2153.88, 419.0]),
    fit("GaussianImage, printed", Some(50_000), 0.40, [31.45, 0.977, 1062.0, 192.61, 662.0]),
    fit("LIG, printed", Some(50_000), 0.40, [29.71, 0.965, 1085.0, 294.32, 620.0]),
    fit("GaussianImage++, printed", Some(50_000), 0.38, [33.75, 0.978, 962.0, 356.71, 765.0]),
];

/// Table 2 for Kodak at its lower rates.
pub(crate) const LOW_RATES: [PrintedCodec; 3] = [
    codec("COIN, printed", [0.17, 24.9, 0.827, 457.0, 769.0]),
    codec("GaussianImage, printed", [0.15, 25.0, 0.854, 293.0, 1827.0]),
    codec("GaussianImage++, printed", [0.15, 25.3, 0.834, 338.0, 1839.0]),
];

/// Table 2 for Kodak at its higher rates.
pub(crate) const HIGH_RATES: [PrintedCodec; 3] = [
    codec("COIN, printed", [0.98, 27.4, 0.904, 726.0, 344.0]),
    codec("GaussianImage, printed", [1.00, 29.7, 0.958, 376.0, 1822.0]),
    codec("GaussianImage++, printed", [1.08, 31.1, 0.961, 347.0, 1666.0]),
];

/// The paper has parameters in millions.
const fn fit(
    method: &'static str,
    gaussians: Option<u32>,
    millions: f64,
    figures: [f64; 5],
) -> PrintedFit {
    PrintedFit { method, gaussians, parameters: 1e6 * millions, figures }
}

const fn codec(codec: &'static str, figures: [f64; 5]) -> PrintedCodec {
    PrintedCodec { codec, figures }
}
