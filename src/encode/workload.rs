//! Estimates of the work of each stage of an encoding, by which progress is measured.

/// Nanoseconds of one core for a pixel and for a Gaussian, about: measured on a photograph of three
/// megapixels with 8,000 to 170,000 Gaussians.
pub(crate) type Rates = (f64, f64);

/// Everything before training.
pub(crate) const PREPARATION: Rates = (70.0, 0.0);
/// An iteration of training: for a pixel without Gaussians, and for a Gaussian, however small.
const ITERATION: Rates = (3.0, 260.0);
/// What an iteration takes more for a pixel that Gaussians cover.
const COVERAGE: f64 = 6.7;
/// A late pass of coordinate descent.
const DESCENT: Rates = (70.0, 3_300.0);
/// The rendering before each pass.
const RENDERING: Rates = (25.0, 800.0);
/// Finding the texture, fitting and coding it.
pub(crate) const TEXTURE: Rates = (80.0, 0.0);
/// Coding, and measuring the squared error or the visual quality of a file.
pub(crate) const CODING: Rates = (0.0, 800.0);
pub(crate) const ERROR: Rates = (4.0, 80.0);
pub(crate) const QUALITY: Rates = (6.0, 80.0);

/// The work for a picture, in nanoseconds of one core.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Workload {
    pixels: f64,
    gaussians: f64,
}

impl Workload {
    /// The work for a picture with so many Gaussians in the end.
    pub(crate) fn new(pixels: usize, gaussians: usize) -> Self {
        Self { pixels: pixels as f64, gaussians: gaussians as f64 }
    }

    /// The same at a resolution that is halved this often.
    pub(crate) fn halved(&self, halvings: usize) -> Self {
        Self { pixels: self.pixels * 0.25_f64.powi(halvings as i32), ..*self }
    }

    /// The work of something with these rates.
    pub(crate) fn of(&self, (pixel, gaussian): Rates) -> f64 {
        self.pixels * pixel + self.gaussians * gaussian
    }

    /// An iteration of training when a share of the Gaussians is there.
    pub(crate) fn iteration(&self, share: f64) -> f64 {
        let covered = 1.0 - (-4.0 * share).exp();
        self.of((ITERATION.0 + COVERAGE * covered, share * ITERATION.1))
    }

    /// Training from nothing, where growth takes six tenths of the iterations, most of them at half of the
    /// resolution.
    pub(crate) fn training(&self, iterations: u32) -> f64 {
        let growth = 0.4 * self.halved(1).iteration(0.4) + 0.2 * self.iteration(0.8);
        f64::from(iterations) * (growth + 0.4 * self.iteration(1.0))
    }

    /// Training after Gaussians were added or removed.
    pub(crate) fn retraining(&self, iterations: u32) -> f64 {
        f64::from(iterations.div_ceil(4)) * self.iteration(1.0)
    }

    /// Passes of coordinate descent, the first of which is number `first` since rounding.
    pub(crate) fn descent(&self, first: u32, passes: u32) -> f64 {
        let pass = |number| self.of(DESCENT) * (0.8 + 1.2 / f64::from(number)) + self.of(RENDERING);
        (first..first + passes).map(pass).sum()
    }

    /// Coding the file, and measuring both.
    pub(crate) fn verification(&self) -> f64 {
        self.of(CODING) + self.of(ERROR) + self.of(QUALITY)
    }
}
