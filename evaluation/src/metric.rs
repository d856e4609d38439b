//! The metrics that codecs are compared by: which is better, how means are taken, how they are
//! written.

use crate::pictures::Distortion;
use crate::table::{decibels, from_decibels, mean};

/// A metric of decoded pictures. Curves and tables have it as a *level*: a number that is higher
/// for better pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Metric {
    Ssimulacra2,
    Butteraugli,
    Cvvdp,
    MsSsim,
    Psnr,
}

impl Metric {
    /// In the order of the report: the nearer to what people see, the earlier.
    pub(crate) const ALL: [Self; 5] =
        [Self::Ssimulacra2, Self::Butteraugli, Self::Cvvdp, Self::MsSsim, Self::Psnr];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Ssimulacra2 => "SSIMULACRA2",
            Self::Butteraugli => "Butteraugli",
            Self::Cvvdp => "CVVDP",
            Self::MsSsim => "MS-SSIM",
            Self::Psnr => "PSNR",
        }
    }

    /// For the axis of a plot and the head of a column.
    pub(crate) fn with_unit(self) -> &'static str {
        match self {
            Self::Ssimulacra2 => "SSIMULACRA2",
            Self::Butteraugli => "Butteraugli, 3-norm",
            Self::Cvvdp => "CVVDP in JOD",
            Self::MsSsim => "MS-SSIM in dB",
            Self::Psnr => "PSNR in dB",
        }
    }

    /// Whether the number that is shown is lower for better pictures.
    pub(crate) fn lower_is_better(self) -> bool {
        self == Self::Butteraugli
    }

    /// The level of one file.
    pub(crate) fn level(self, distortion: &Distortion) -> f64 {
        match self {
            Self::Ssimulacra2 => distortion.ssimulacra2,
            Self::Butteraugli => -distortion.butteraugli,
            Self::Cvvdp => distortion.cvvdp,
            Self::MsSsim => decibels(distortion.ms_ssim),
            Self::Psnr => distortion.psnr,
        }
    }

    /// The mean level of many files: that of MS-SSIM is the level of the mean MS-SSIM.
    pub(crate) fn mean(self, levels: impl IntoIterator<Item = f64>) -> Option<f64> {
        match self {
            Self::MsSsim => mean(levels.into_iter().map(from_decibels)).map(decibels),
            _ => mean(levels),
        }
    }

    /// The number that a level is shown as, in plots.
    pub(crate) fn shown(self, level: f64) -> f64 {
        if self.lower_is_better() { -level } else { level }
    }

    /// A level in a cell of a table.
    pub(crate) fn cell(self, level: f64) -> String {
        let shown = self.shown(level);
        match self {
            Self::Ssimulacra2 => format!("{shown:.1}"),
            Self::Butteraugli => format!("{shown:.3}"),
            Self::MsSsim => format!("{:.4} ({shown:.2})", from_decibels(shown)),
            Self::Cvvdp | Self::Psnr => format!("{shown:.2}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn better_pictures_have_higher_levels() {
        let good = Distortion::from([40.0, 0.99, 90.0, 0.5, 9.5]);
        let bad = Distortion::from([30.0, 0.9, -9.0, 3.0, 7.0]);
        let levels = |of: &Distortion| Metric::ALL.map(|metric| metric.level(of));
        assert!(levels(&good).iter().zip(levels(&bad)).all(|(good, bad)| *good > bad));
        let cells = Metric::ALL.map(|metric| metric.cell(metric.level(&good)));
        assert_eq!(cells, ["90.0", "0.500", "9.50", "0.9900 (20.00)", "40.00"]);
    }

    #[test]
    fn means_are_of_what_papers_average() {
        let of = |metric: Metric, values: [f64; 2]| metric.mean(values).expect("two values");
        assert_eq!(of(Metric::Psnr, [30.0, 40.0]), 35.0);
        let ms_ssim = from_decibels(of(Metric::MsSsim, [decibels(0.9), decibels(0.99)]));
        assert!((ms_ssim - 0.945).abs() < 1e-12);
        assert_eq!(Metric::Butteraugli.mean([]), None);
    }
}
