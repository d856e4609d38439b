//! From fitted Gaussians to a file of coding 1 that meets its target.

use rayon::prelude::*;

use super::EncodeError;
use super::budget::Budget;
use super::control::Finished;
use super::descent::{Descent, Place, tiles};
use super::fit::Fit;
use super::layout::Layout;
use super::options::Target;
use super::progress::Observer;
use super::raster::Raster;
use super::rate;
use super::residuals::Residuals;
use super::source::Source;
use super::steering::{Aim, Search};
use super::verify::{Verified, strips};
use crate::coding::set::{Layer, SetCoding};
use crate::color::ColorModel;
use crate::gaussian::Gaussian;
use crate::lattice::{Code, Grid, Lattice};
use crate::limits::Limits;
use crate::render::{Picture, RenderOptions};

/// How often steps are tried at most: by rounding alone, with a few passes over the codes, with all.
const MOST_ROUNDINGS: u32 = 8;
const MOST_SCOUTINGS: u32 = 4;
const MOST_TRIES: u32 = 4;
/// How near is near enough for more passes, as a logarithm to base 2.
const CLOSE: f64 = 0.02;
/// How much less the size becomes after rounding, and size and error after the first pass, as
/// logarithms to base 2.
const SETTLING_OF_ROUNDED: f64 = 0.12;
const SETTLING: f64 = 0.045;
/// More than anything is off, as a logarithm to base 2.
const LARGEST_OFF: f64 = 10.0;
/// How far what a bit is worth may change, as a logarithm to base 2.
const STEERED_BY: f64 = 1.0;
/// Most passes until a target is met.
const MOST_PASSES: u32 = 12;
/// By how much finer steps are taken where nothing else gives the PSNR, as logarithms to base 2.
const FINER: [f64; 4] = [0.5, 0.5, 1.0, 2.0];
/// How often it is tried to do without some Gaussians.
const MOST_TRIMMINGS: u32 = 32;
/// The first layers of a file, as shares of its Gaussians: a tenth of the file already shows the
/// picture, and both together are enough for a thumbnail
/// ([`Header::gaussians_for`](crate::Header::gaussians_for)).
const LAYERS: [f64; 2] = [0.04, 0.13];
/// Fewest Gaussians that are worth layers.
const LEAST_LAYERED: usize = 250;
/// Fewest Gaussians that are worth being decoded side by side.
const LEAST_CUT: usize = 2048;
/// The largest layer's share of them: those of the layers before it take more time each.
const LARGEST: f64 = 0.52;
/// Most Gaussians in a layer, so that many threads can be used.
const MOST_TOGETHER: usize = 16_384;
/// More Gaussians than this make a large picture, of which a region is decoded from few layers: they
/// have at most so many then.
const MOST_WHOLE: usize = 32_768;
const MOST_NEAR: usize = 320;
/// What the time that decoders take for a Gaussian is worth on average, in bits: there are 2 to 4 %
/// fewer tiles to look at then, and PSNR stays as it is.
const BITS_FOR_TIME: f32 = 4.0;
/// How often a finished fit may be extended.
const MAX_ROUNDS: u32 = 8;

/// How many Gaussians a file of a size holds, about, up to `most`.
pub(crate) fn count_for_size(
    bytes: u64,
    most: usize,
    layout: &Layout<'_>,
) -> Result<usize, EncodeError> {
    let least = layout.write_set(&Coded::empty(layout.header().color)).len() as u64;
    layout.check_size(bytes, least)?;
    Ok((((bytes - least) * 8) as f64 / rate::BITS_PER_GAUSSIAN).min(most as f64) as usize)
}

/// Extends a fit until its squared error is at most `error`, or nothing helps.
fn extend(
    fit: &mut Fit<'_>,
    error: f64,
    iterations: u32,
    observer: &mut Observer<'_>,
) -> Result<(), EncodeError> {
    for _ in 0..MAX_ROUNDS {
        let before = fit.len();
        let wanted = Budget::Error(error).wanted(before, fit.best_error(), fit.most());
        if fit.best_error() <= error || wanted <= before {
            break;
        }
        fit.extend(wanted - before, iterations, observer)?;
        if fit.len() == before {
            break;
        }
    }
    Ok(())
}

/// Gaussians on a lattice.
#[derive(Clone, Debug)]
pub(crate) struct Coded {
    pub(crate) lattice: Lattice,
    pub(crate) codes: Vec<Code>,
}

impl Coded {
    fn empty(model: ColorModel) -> Self {
        Self { lattice: rate::lattice(0.0, model), codes: Vec::new() }
    }
}

/// Codes Gaussians in layers; sorts and rounds them as a file has them.
pub(crate) fn write_layers(coding: &SetCoding<'_>, codes: &mut [Code]) -> Vec<Layer> {
    layers(coding, codes).into_par_iter().map(|codes| coding.write(codes)).collect()
}

/// Cuts codes into the layers of a file: the strongest ones first, the others by where they are.
fn layers<'a>(coding: &SetCoding<'_>, codes: &'a mut [Code]) -> Vec<&'a mut [Code]> {
    let count = codes.len();
    let most = match count {
        0..LEAST_CUT => count,
        LEAST_CUT..=MOST_WHOLE => ((LARGEST * count as f64) as usize).min(MOST_TOGETHER),
        // As many layers as a header can declare.
        _ => MOST_NEAR.max(count / usize::from(u16::MAX / 2)),
    };
    codes.sort_by_key(|code| core::cmp::Reverse(code.strength()));
    let mut layers = Vec::new();
    let mut rest = codes;
    if count >= LEAST_LAYERED {
        for share in LAYERS {
            let (part, later) = rest.split_at_mut((share * count as f64) as usize);
            cut(coding, part, most, &mut layers);
            rest = later;
        }
    }
    cut(coding, rest, most, &mut layers);
    layers
}

/// Cuts codes into layers of at most so many, by where they are.
fn cut<'a>(
    coding: &SetCoding<'_>,
    mut rest: &'a mut [Code],
    most: usize,
    layers: &mut Vec<&'a mut [Code]>,
) {
    while rest.len() > most {
        coding.cut(rest, most);
        let (layer, later) = rest.split_at_mut(most);
        layers.push(layer);
        rest = later;
    }
    if !rest.is_empty() {
        layers.push(rest);
    }
}

/// The places of a layer's codes.
fn places(layer: &Layer) -> impl Iterator<Item = Place<'_>> {
    layer.levels.iter().map(|&level| Place { level, costs: &layer.costs })
}

/// What fitted Gaussians are coded for.
#[derive(Debug)]
pub(crate) struct Coder<'a> {
    source: &'a Source<'a>,
    raster: &'a Raster,
    layout: &'a Layout<'a>,
    /// How often every code is looked at, or a little more for a target.
    passes: u32,
    grid: Grid,
    model: ColorModel,
}

impl<'a> Coder<'a> {
    pub(crate) fn new(
        source: &'a Source<'a>,
        raster: &'a Raster,
        layout: &'a Layout<'a>,
        passes: u32,
    ) -> Self {
        let header = layout.header();
        let grid = Grid::new(header.width, header.height);
        Self { source, raster, layout, passes, grid, model: header.color }
    }

    /// The file of a finished fit for the target.
    pub(crate) fn finish(
        &self,
        mut fit: Fit<'_>,
        target: Target,
        extension: u32,
        observer: &mut Observer<'_>,
    ) -> Result<Finished, EncodeError> {
        let raster = self.raster;
        if let Target::Psnr(psnr) = target {
            extend(&mut fit, rate::SHARE_OF_FIT * raster.error_of(psnr), extension, observer)?;
        }
        let (gaussians, error, mut work) = (fit.gaussians(), fit.best_error(), fit.work());
        let codes = gaussians.len() * (size_of::<Gaussian>() + 2 * size_of::<Code>());
        let memory = raster.memory() + Residuals::memory(raster) + codes;
        work.peak_memory = work.peak_memory.max(memory);
        // The descent needs the memory.
        drop(fit);
        let coded = self.encode(&gaussians, error, target, observer)?;
        observer.poll()?;
        Ok(Finished { file: self.layout.write_set(&coded), work })
    }

    /// Codes `gaussians`, whose picture has the squared error `error`, for a target.
    fn encode(
        &self,
        gaussians: &[Gaussian],
        error: f64,
        target: Target,
        observer: &mut Observer<'_>,
    ) -> Result<Coded, EncodeError> {
        let step = rate::step_for(error, gaussians.len());
        let Some(aim) = Aim::new(target, self.raster.pixels()) else {
            let mut coded = self.rounded(gaussians, step);
            self.descend(&mut coded, 0.0, self.passes, observer)?;
            return Ok(coded);
        };
        let step = self.first_step(gaussians, step, aim, observer)?;
        let (mut coded, mut off, step) = self.aimed(gaussians, step, aim, observer)?;
        if let Some(bytes) = target.bytes(self.raster.pixels()) {
            self.shorten(&mut coded, bytes, observer)?;
            return Ok(coded);
        }
        if aim.miss(off) > 0.0 {
            // A few Gaussians are hard to steer, but finer steps are always better in the end.
            let mut finer = step;
            for change in FINER {
                if off <= 0.0 {
                    break;
                }
                finer -= change;
                (coded, off) = self.passed(gaussians, finer, self.passes, aim, observer)?;
            }
        }
        self.trim(coded, off, aim, observer)
    }

    /// The codes that come nearest to an aim, how far from it they are, and the step that would be
    /// tried next; `step` is the first.
    fn aimed(
        &self,
        gaussians: &[Gaussian],
        step: f64,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<(Coded, f64, f64), EncodeError> {
        let passes = self.scouting_passes();
        let mut settling = SETTLING / f64::from(passes);
        let mut search = Search::new(step, aim.by_step());
        let mut scouted = self.passed(gaussians, search.at, passes, aim, observer)?;
        for _ in 1..MOST_SCOUTINGS {
            let expected = scouted.1 - settling;
            if expected.abs() < CLOSE {
                break;
            }
            search.tell(expected);
            scouted = self.passed(gaussians, search.at, passes, aim, observer)?;
        }
        let mut search = Search::new(search.at, aim.by_step());
        let mut scouted = Some(scouted);
        let mut best: Option<(Coded, f64)> = None;
        for _ in 0..MOST_TRIES {
            let (mut coded, before) = match scouted.take() {
                Some(scouted) => scouted,
                None => self.passed(gaussians, search.at, passes, aim, observer)?,
            };
            let (off, lambda) = self.steer(&mut coded, before, settling, aim, observer)?;
            if best.as_ref().is_none_or(|(_, least)| aim.miss(off) < aim.miss(*least)) {
                best = Some((coded, off));
            }
            if aim.miss(off) == 0.0 {
                break;
            }
            // Now it is known how much happens after scouting.
            let unsteered = off - lambda * aim.by_lambda();
            settling = before - unsteered;
            search.tell(unsteered);
        }
        let (coded, off) = best.expect("at least one was tried");
        Ok((coded, off, search.at))
    }

    /// The first step to try: how long a file gets can nearly be told from rounding alone.
    fn first_step(
        &self,
        gaussians: &[Gaussian],
        step: f64,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<f64, EncodeError> {
        let mut search = Search::new(step, aim.by_step());
        if matches!(aim, Aim::Psnr(_)) {
            return Ok(search.at);
        }
        for _ in 0..MOST_ROUNDINGS {
            observer.poll()?;
            let mut coded = self.rounded(gaussians, search.at);
            self.written(&mut coded);
            let off = self.off(&coded, aim, observer)? - SETTLING_OF_ROUNDED;
            search.tell(off);
            if off.abs() < CLOSE {
                break;
            }
        }
        Ok(search.at)
    }

    fn scouting_passes(&self) -> u32 {
        self.passes.div_ceil(4)
    }

    /// Codes of a step after some passes, and how far they are from an aim.
    fn passed(
        &self,
        gaussians: &[Gaussian],
        step: f64,
        passes: u32,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<(Coded, f64), EncodeError> {
        let mut coded = self.rounded(gaussians, step);
        self.descend(&mut coded, 0.0, passes, observer)?;
        let off = self.off(&coded, aim, observer)?;
        Ok((coded, off))
    }

    /// Goes on with scouted codes that are `off`, and gets as near to an aim as what a bit is worth
    /// can bring them; by `settling` they become less off anyway. How far they are from the aim
    /// then, and what a bit was worth, as a logarithm to base 2.
    fn steer(
        &self,
        coded: &mut Coded,
        mut off: f64,
        settling: f64,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<(f64, f64), EncodeError> {
        let first = self.scouting_passes();
        let mut lambda: f64 = 0.0;
        for pass in first..MOST_PASSES {
            if pass >= self.passes && aim.miss(off) == 0.0 {
                break;
            }
            let expected = off - settling * f64::from(first) / f64::from(pass);
            lambda -= (expected / aim.by_lambda()).clamp(-0.5, 0.5);
            lambda = lambda.clamp(-STEERED_BY, STEERED_BY);
            self.descend(coded, lambda, 1, observer)?;
            off = self.off(coded, aim, observer)?;
        }
        Ok((off, lambda))
    }

    /// How far from an aim.
    fn off(
        &self,
        coded: &Coded,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<f64, EncodeError> {
        observer.poll()?;
        let file = self.layout.write_set(coded);
        Ok(match aim {
            Aim::Size { most } => (file.len() as f64 / most).log2(),
            Aim::Psnr(psnr) => {
                let verified = Verified::new(&file, self.source);
                let reached = verified.distortion(verified.gaussians(), observer)?.psnr;
                // An exact copy is off by no number.
                ((psnr - reached) * 0.1 * 10_f64.log2()).max(-LARGEST_OFF)
            }
        })
    }

    /// Removes the weakest Gaussians until the file has at most so many bytes.
    fn shorten(
        &self,
        coded: &mut Coded,
        bytes: u64,
        observer: &mut Observer<'_>,
    ) -> Result<(), EncodeError> {
        loop {
            observer.poll()?;
            let size = self.layout.write_set(coded).len() as u64;
            let Some(excess) = size.checked_sub(bytes).filter(|&excess| excess > 0) else {
                return Ok(());
            };
            // Four bytes a Gaussian, and at least one.
            let count = excess.div_ceil(4).min(coded.codes.len() as u64) as usize;
            coded.codes.sort_by_key(|code| core::cmp::Reverse(code.strength()));
            coded.codes.truncate(coded.codes.len() - count);
        }
    }

    /// Removes the weakest Gaussians of a picture that is too good, as many as can be spared.
    fn trim(
        &self,
        mut coded: Coded,
        mut off: f64,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<Coded, EncodeError> {
        if off > 0.0 || aim.miss(off) == 0.0 {
            return Ok(coded);
        }
        coded.codes.sort_by_key(|code| core::cmp::Reverse(code.strength()));
        // Those from `end` on cannot be spared, and likely not many more at a time.
        let mut end = coded.codes.len();
        let mut portion = end.div_ceil(2);
        for _ in 0..MOST_TRIMMINGS {
            let mut fewer = coded.clone();
            let start = end.saturating_sub(portion);
            fewer.codes.drain(start..end);
            let off_with_fewer = self.off(&fewer, aim, observer)?;
            if off_with_fewer <= 0.0 {
                (coded, off, end) = (fewer, off_with_fewer, start);
            } else if portion > 1 {
                portion /= 2;
            } else {
                end -= 1;
            }
            if end == 0 || aim.miss(off) == 0.0 {
                break;
            }
        }
        Ok(coded)
    }

    /// Rounds `gaussians` to the lattice of a step, given by its logarithm to base 2.
    fn rounded(&self, gaussians: &[Gaussian], step: f64) -> Coded {
        let lattice = rate::lattice(step, self.model);
        let codes = gaussians.par_iter().map(|gaussian| {
            let class = rate::class_of(gaussian, &lattice, self.model);
            lattice.code(gaussian, class, &self.grid, self.model)
        });
        let codes = codes.collect();
        Coded { lattice, codes }
    }

    /// Looks at every code `passes` times and chooses the best, a bit being worth 2^`lambda` times
    /// as much as usual.
    fn descend(
        &self,
        coded: &mut Coded,
        lambda: f64,
        passes: u32,
        observer: &mut Observer<'_>,
    ) -> Result<(), EncodeError> {
        let lambda = rate::lambda(&coded.lattice) * lambda.exp2() as f32;
        let mut residuals = Residuals::new(self.raster);
        for _ in 0..passes {
            observer.poll()?;
            let layers = self.written(coded);
            let places: Vec<Place<'_>> = layers.iter().flat_map(places).collect();
            self.render(coded, &mut residuals, observer)?;
            let coding = self.coding(&coded.lattice);
            let bytes: usize = layers.iter().map(|layer| layer.payload.len()).sum();
            let (mut own, mut touched) = (0.0, 0.0);
            for (code, place) in coded.codes.iter().zip(&places) {
                let shape = coding.lattice.shape(code);
                own += coding.cost(*code, &shape, place.level, place.costs);
                touched += tiles(shape.cholesky);
            }
            let tree = ((8.0 * bytes as f32 - own) / coded.codes.len().max(1) as f32).max(0.0);
            let tile = BITS_FOR_TIME * coded.codes.len() as f32 / touched.max(1.0);
            let descent = Descent { coding, model: self.model, tree, tile, lambda };
            if descent.pass(&mut residuals, &mut coded.codes, &places, observer)? == 0 {
                break;
            }
        }
        // For the file's order and centres.
        observer.poll()?;
        self.written(coded);
        Ok(())
    }

    fn coding<'b>(&self, lattice: &'b Lattice) -> SetCoding<'b> {
        SetCoding::new(lattice, self.layout.header())
    }

    /// Codes what there is, which sorts and rounds the codes as the file has them.
    fn written(&self, coded: &mut Coded) -> Vec<Layer> {
        write_layers(&self.coding(&coded.lattice), &mut coded.codes)
    }

    /// Sets `residuals` to those of the codes, as the decoder renders them.
    fn render(
        &self,
        coded: &Coded,
        residuals: &mut Residuals,
        observer: &mut Observer<'_>,
    ) -> Result<(), EncodeError> {
        let Coded { lattice, codes } = coded;
        let gaussian = |code| lattice.gaussian(code, &lattice.shape(code), &self.grid, self.model);
        let gaussians: Vec<Gaussian> = codes.iter().map(gaussian).collect();
        let header = self.layout.header();
        let limits = Limits::none();
        let rendering = Picture::new(header, &gaussians, &limits, 0);
        let mut planes = Vec::new();
        for region in strips(header.width, header.height) {
            observer.poll()?;
            planes.resize(region.pixels() as usize * self.raster.channels, 0.0);
            let options = RenderOptions::new().region(region);
            rendering.render_planes(&options, &mut planes).expect("there are no limits");
            residuals.set(self.raster, region.y as usize, &planes);
        }
        observer.poll()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn about_half_of_the_gaussians_are_in_the_largest_layer_but_not_too_many() {
        let lattice = rate::lattice(0.0, ColorModel::Rgb);
        let coding = SetCoding { lattice: &lattice, grid: Grid::new(640, 480), channels: 3 };
        for (count, largest, number) in [
            (0, 0, 0),
            (249, 249, 1),
            (2047, 1700, 3),
            (6000, 3120, 4),
            (32_000, 16_384, 4),
            (70_000, 320, 220),
        ] {
            let mut random = fastrand::Rng::with_seed(count as u64);
            let mut code = || Code {
                color: [random.i32(-9..9), 0, 0, 0],
                center: [random.u32(0..80_000), random.u32(0..60_000)],
                ..Code::default()
            };
            let mut codes: Vec<Code> = (0..count).map(|_| code()).collect();
            let layers = layers(&coding, &mut codes);
            let sizes: Vec<usize> = layers.iter().map(|layer| layer.len()).collect();
            assert_eq!(sizes.iter().sum::<usize>(), count);
            assert_eq!(sizes.len(), number, "{sizes:?}");
            assert_eq!(sizes.iter().max().copied().unwrap_or(0), largest, "{sizes:?}");
            let thumbnail = sizes.iter().take(2).sum::<usize>();
            assert!(count > MOST_WHOLE || thumbnail >= count / 6, "{sizes:?}");
        }
    }
}
