//! What codecs show of a picture in files of the same size.

use anyhow::{Context, Result};
use image_gip::{Encoder, Report, Target, Threads};

use crate::baselines::{BASELINES, Baseline, Worker};
use crate::gip;
use crate::pictures::TestPicture;

/// The rates at which texture is looked at, in bits per pixel.
pub(crate) const RATES: [f64; 4] = [0.15, 0.25, 0.5, 1.0];

/// A picture as a codec shows it.
#[derive(Clone, Debug)]
pub(crate) struct Version {
    /// Of the file.
    pub(crate) bytes: f64,
    pub(crate) samples: Vec<u8>,
    /// Of our encoder, if it was asked for this.
    pub(crate) report: Option<Report>,
}

impl Version {
    /// Ours, at a rate in bits per pixel.
    pub(crate) fn ours(encoder: Encoder, picture: &TestPicture, rate: f64) -> Result<Self> {
        let encoder = encoder.with_target(Target::BitsPerPixel(rate));
        let encoded = gip::file(encoder, picture, Threads::Pool)?;
        Self::of_file(&encoded.bytes, Some(encoded.report))
    }

    /// What a file of ours shows.
    pub(crate) fn of_file(file: &[u8], report: Option<Report>) -> Result<Self> {
        let samples = gip::decode(file, Threads::Pool)?;
        Ok(Self { bytes: file.len() as f64, samples, report })
    }

    /// A baseline's, at the quality whose file is nearest in size.
    pub(crate) fn baseline(
        worker: &mut Worker,
        baseline: &Baseline,
        picture: &TestPicture,
        bytes: f64,
    ) -> Result<Self> {
        let setting = nearest_setting(worker, baseline, picture, bytes)?;
        let trip = worker.round_trip(baseline.id, &setting, picture, Some(1), [1; 2])?;
        Ok(Self { bytes: trip.bytes, samples: trip.decoded, report: None })
    }
}

/// The setting of a baseline whose file of a picture is nearest in size.
pub(crate) fn nearest_setting(
    worker: &mut Worker,
    baseline: &Baseline,
    picture: &TestPicture,
    bytes: f64,
) -> Result<String> {
    let settings = settings(baseline);
    let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
    let setting = nearest(&settings, bytes, |setting| {
        Ok(worker.round_trip(baseline.id, setting, picture, Some(1), [1; 2])?.bytes)
    })?;
    Ok(setting.to_owned())
}

/// The baseline of a name.
pub(crate) fn baseline_called(name: &str) -> Result<&'static Baseline> {
    let found = BASELINES.iter().find(|baseline| baseline.name == name);
    found.with_context(|| format!("{name} is no baseline"))
}

/// A hundred settings, from small files to large ones.
pub(crate) fn settings(baseline: &Baseline) -> Vec<String> {
    let all = 1..=100;
    if baseline.id.starts_with("jxl") {
        // Distances from 25 to 0.1, in equal ratios.
        all.map(|step| format!("{:.3}", 25.0 * 0.004_f64.powf(f64::from(step - 1) / 99.0)))
            .collect()
    } else {
        all.map(|quality| quality.to_string()).collect()
    }
}

/// The setting whose file has a size or rate nearest to `wanted`, by bisection. `settings` go from
/// small files to large ones.
pub(crate) fn nearest<'a>(
    settings: &[&'a str],
    wanted: f64,
    mut size: impl FnMut(&str) -> Result<f64>,
) -> Result<&'a str> {
    let (mut low, mut high) = (0, settings.len() - 1);
    while high - low > 1 {
        let middle = usize::midpoint(low, high);
        if size(settings[middle])? < wanted { low = middle } else { high = middle }
    }
    let below = wanted / size(settings[low])?;
    let above = size(settings[high])? / wanted;
    Ok(settings[if below.max(1.0 / below) < above.max(1.0 / above) { low } else { high }])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_setting_is_found() {
        let find = |rates: &[f64]| {
            let names: Vec<String> = rates.iter().map(f64::to_string).collect();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            nearest(&names, 0.5, |name| Ok(name.parse()?)).expect("all are numbers").to_owned()
        };
        assert_eq!(find(&[0.1, 0.2, 0.45, 0.6, 0.9]), "0.45");
        assert_eq!(find(&[0.1, 0.2, 0.3, 0.52, 0.9]), "0.52");
        assert_eq!(find(&[0.1, 0.2]), "0.2");
        assert_eq!(find(&[0.7, 0.8, 0.9]), "0.7");
        assert_eq!(find(&[0.4]), "0.4");
    }

    #[test]
    fn settings_go_from_small_files_to_large_ones() {
        let ends = |name: &str| {
            let all = settings(baseline_called(name).expect("it is there"));
            [all[0].clone(), all[99].clone()]
        };
        assert_eq!(ends("AVIF"), ["1", "100"]);
        assert_eq!(ends("JPEG XL"), ["25.000", "0.100"]);
        assert!(baseline_called("GIF").is_err());
    }
}
