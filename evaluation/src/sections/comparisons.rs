//! All codecs on all sets of pictures, for the sections about rates.

use anyhow::Result;

use super::codec_curves::{Codec, Extent, OURS, Variant};
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
    for set in bench.all_sets() {
        let extent = extent(bench.quick);
        let ours = Codec::ours(store, &product, &default, &set.pictures, extent)?;
        let (workers, versions) = bench.workers()?;
        let rivals = baselines::rivals().filter(|(rival, _)| is_in(set.name, rival.name));
        let others = rivals
            .map(|rival| Codec::baseline(store, workers, &versions, rival, &set.pictures, extent));
        let others = others.collect::<Result<_>>()?;
        comparisons.push(Comparison { set, ours, others });
    }
    let quick = bench.quick;
    for Comparison { set, others, .. } in &mut comparisons {
        let of_set = |variant: &&Variant| is_in(set.name, variant.name);
        for variant in variants.iter().filter(of_set) {
            // They are for a comparison with ours, which fewer rates are enough for.
            let extent = Extent { step: VARIANT_STEP, ..extent(quick) };
            others.push(Codec::ours(store, &product, variant, &set.pictures, extent)?);
        }
    }
    Ok(comparisons)
}

/// Other ways to run our encoder are measured at one in so many rates.
const VARIANT_STEP: usize = 2;

/// Beyond the highest range nothing is compared.
fn extent(quick: bool) -> Extent {
    Extent { until: HIGH.rates.1, ..Extent::new(quick) }
}

/// On the large pictures, each of which takes as long as seven of Kodak's, only these are measured.
const ON_LARGE: [&str; 5] = ["WebP", "AVIF", "JPEG XL", "HEIC", BEST_AVIF[0].name];
/// These are measured on the photographs alone, and the last of them on the first set alone.
const ON_PHOTOGRAPHS: [&str; 4] = [gip::PLAIN_NAME, gip::PSNR_NAME, "JPEG", "AVIF tune=psnr"];

/// Whether a codec is measured on a set.
fn is_in(set: &str, codec: &str) -> bool {
    match set {
        "Kodak" => true,
        "photos" => codec != ON_PHOTOGRAPHS[3],
        "large" => ON_LARGE.contains(&codec),
        _ => !ON_PHOTOGRAPHS.contains(&codec),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_codec_is_on_the_first_set_and_ours_beside_the_best_on_all() {
        for (rival, _) in baselines::rivals() {
            assert!(is_in("Kodak", rival.name), "{}", rival.name);
        }
        assert!(ON_LARGE.iter().all(|name| baselines::rivals().any(|(r, _)| r.name == *name)));
        for set in ["Kodak", "photos", "large", "screens"] {
            assert!(is_in(set, BEST_AVIF[0].name), "{set}");
        }
        assert!(!is_in("large", gip::PSNR_NAME) && !is_in("screens", gip::PLAIN_NAME));
    }
}
