//! The report's sections. Each measures what it lacks and returns its text.

mod ablation;
mod checks;
mod decode;
mod growth;
mod handmade;
mod levels;
mod methods;
mod positions;
mod rate;
mod representation;
mod scene;
mod speed;
mod stability;

use std::fmt;

use anyhow::Result;
use clap::ValueEnum;

use crate::bench::Bench;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Section {
    /// The fit itself, without quantization: against GaussianImage and GaussianImage++
    Representation,
    /// What each part of the method is worth
    Ablation,
    /// Rate and distortion, against every baseline
    Rate,
    /// Time against error, and how both grow
    Speed,
    /// Decoding next to other decoders, whole and in part
    Decode,
    /// Arithmetic at its edges, and pictures that are hard to fit
    Stability,
    /// How much is spent on simple and on difficult pictures
    Scene,
}

impl Section {
    /// In the order of the report.
    pub(crate) const ALL: [Self; 7] = [
        Self::Representation,
        Self::Ablation,
        Self::Rate,
        Self::Speed,
        Self::Decode,
        Self::Stability,
        Self::Scene,
    ];

    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::Representation => "Representation",
            Self::Ablation => "Ablation",
            Self::Rate => "Rate and distortion",
            Self::Speed => "Speed against error",
            Self::Decode => "Decoding",
            Self::Stability => "Numerical stability",
            Self::Scene => "Only what a scene needs",
        }
    }

    pub(crate) fn measure(self, bench: &mut Bench) -> Result<String> {
        match self {
            Self::Representation => representation::measure(bench),
            Self::Ablation => ablation::measure(bench),
            Self::Rate => rate::measure(bench),
            Self::Speed => speed::measure(bench),
            Self::Decode => decode::measure(bench),
            Self::Stability => stability::measure(bench),
            Self::Scene => scene::measure(bench),
        }
    }
}

impl fmt::Display for Section {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = self.to_possible_value().expect("no section is skipped");
        f.write_str(value.get_name())
    }
}
