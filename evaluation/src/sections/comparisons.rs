//! All codecs on all sets of pictures, for the sections about rates.

use anyhow::Result;

use super::codec_curves::{Codec, Extent, OURS, Sweep};
use super::ranges::HIGH;
use super::rate_store::RateStore;
use crate::baselines::{self, BEST_AVIF};
use crate::bench::Bench;
use crate::gip;
use crate::pictures::PictureSet;

/// Codecs on one set of pictures.
#[derive(Debug)]
pub(super) struct Comparison {
    pub(super) set: PictureSet,
    pub(super) ours: Codec,
    /// Others, and then our encoder run otherwise than by default.
    pub(super) others: Vec<Codec>,
}

impl Comparison {
    /// Ours first.
    pub(super) fn codecs(&self) -> impl Iterator<Item = &Codec> {
        [&self.ours].into_iter().chain(&self.others)
    }

    /// Another codec by its name.
    pub(super) fn other(&self, name: &str) -> Option<&Codec> {
        self.others.iter().find(|codec| codec.name == name)
    }

    /// The codec that single pictures are compared with: the strongest.
    pub(super) fn best_avif(&self) -> &Codec {
        self.other(BEST_AVIF[0].name).expect("it is on all sets")
    }
}

/// All sets with the codecs that each is measured with. What matters most comes first, so that a
/// run that is interrupted has it: our default and the others on all sets.
pub(super) fn compare(bench: &mut Bench, store: &mut RateStore) -> Result<Vec<Comparison>> {
    let product = bench.product.clone();
    let [default, variants @ ..] = OURS;
    let mut comparisons = Vec::new();
    let quick = bench.quick;
    // A large picture takes AVIF at its best longer than a quick run may last.
    let sets = bench.all_sets();
    for set in sets.into_iter().filter(|set| !(quick && set.name == "large")) {
        let ours = Codec::ours(store, &product, &default, &set.pictures, extent(quick, 1))?;
        let (workers, versions) = bench.workers()?;
        let rivals = baselines::rivals().filter(|tunings| is_in(set.name, tunings[0].name));
        let sweeps = rivals.map(|tunings| {
            // It has few settings anyway.
            let is_best = tunings[0].name == BEST_AVIF[0].name;
            let step = if is_best { 1 } else { step_of_others(set.name) };
            Sweep { tunings, extent: extent(quick, step) }
        });
        let sweeps: Vec<Sweep> = sweeps.collect();
        let others = Codec::baselines(store, workers, &versions, &sweeps, &set.pictures)?;
        comparisons.push(Comparison { set, ours, others });
    }
    for Comparison { set, others, .. } in &mut comparisons {
        for variant in variants.iter().filter(|variant| is_in(set.name, variant.name)) {
            let extent = extent(quick, 1);
            others.push(Codec::ours(store, &product, variant, &set.pictures, extent)?);
        }
    }
    Ok(comparisons)
}

/// One in so many settings of the others is measured on a set: screenshots take them as long as all
/// photographs of Kodak's, and most of their curves are short.
fn step_of_others(set: &str) -> usize {
    if set == "screens" { 2 } else { 1 }
}

/// Beyond the highest range nothing is compared, and a quick run has no time for files that large.
fn extent(quick: bool, step: usize) -> Extent {
    let (all, (low, high)) = (Extent::new(quick), HIGH.rates);
    Extent { step: all.step.max(step), until: if quick { low } else { high } }
}

/// These are measured on the first set alone.
const ON_FIRST: [&str; 3] = [gip::PLAIN_NAME, gip::PSNR_NAME, "AVIF tune=psnr"];
/// On the large pictures only these are measured.
const ON_LARGE: [&str; 5] = ["WebP", "AVIF", "JPEG XL", "HEIC", BEST_AVIF[0].name];

/// Whether a codec is measured on a set.
fn is_in(set: &str, codec: &str) -> bool {
    match set {
        "Kodak" => true,
        "large" => ON_LARGE.contains(&codec),
        _ => !ON_FIRST.contains(&codec),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_codec_is_on_the_first_set_and_ours_beside_the_best_on_all() {
        for rival in baselines::rivals().map(|tunings| &tunings[0]) {
            assert!(is_in("Kodak", rival.name), "{}", rival.name);
        }
        assert!(
            ON_LARGE.iter().all(|name| baselines::rivals().any(|tunings| tunings[0].name == *name))
        );
        for set in ["Kodak", "photos", "large", "screens"] {
            assert!(is_in(set, BEST_AVIF[0].name), "{set}");
        }
        assert!(!is_in("large", gip::PSNR_NAME) && !is_in("photos", gip::PLAIN_NAME));
    }
}
