//! How many Gaussians a picture gets.

/// What decides the number of Gaussians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Budget {
    /// This many.
    Count(usize),
    /// As many as bring the sum of squared errors down to this.
    Error(f64),
    /// As many as leave this much of the sum of squared errors per Gaussian: the same slope of
    /// error against count for every picture, so a simple one gets few.
    ErrorPerGaussian(f64),
}

/// The sum of squared errors falls about with this power of the count (Kodak, 1,000 to 10,000
/// Gaussians).
const POWER: f64 = 1.1;

impl Budget {
    /// The count that seems right, given that `count` Gaussians will leave an error of about
    /// `error`; at most `most`.
    pub(crate) fn wanted(self, count: usize, error: f64, most: usize) -> usize {
        let ratio = match self {
            Self::Count(wanted) => return wanted.min(most),
            Self::Error(target) => (error / target).powf(1.0 / POWER),
            Self::ErrorPerGaussian(target) => {
                (error / count.max(1) as f64 / target).powf(1.0 / (POWER + 1.0))
            }
        };
        // A float's cast saturates; of NaN it is zero, and a target of zero wants all there are.
        let wanted = (count.max(1) as f64 * ratio).ceil() as usize;
        wanted.min(most)
    }
}
