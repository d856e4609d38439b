//! The map of a texture as Gaussians: a small picture, which is fitted and coded as any other.

use super::cells::Cells;
use super::strengths::{Strength, strengths};
use crate::chunk::ChunkType;
use crate::color::ColorModel;
use crate::container::Metadata;
use crate::encode::aim::Aim;
use crate::encode::error::Result;
use crate::encode::file::FileLayout;
use crate::encode::fit::budget::Budget;
use crate::encode::fit::training::Training;
use crate::encode::fit::{Fit, Work};
use crate::encode::job::Job;
use crate::encode::options::{Precision, Tune};
use crate::encode::progress::Observer;
use crate::encode::quality::Judge;
use crate::encode::rate_model;
use crate::encode::rdo::{SearchWork, TargetSearch};
use crate::encode::resolutions::Resolutions;
use crate::encode::source::Source;
use crate::encode::tiled_source::TiledSource;
use crate::encode::verify::squared_error;
use crate::limits::Limits;
use crate::render::Picture;
use crate::texture::{OCTAVES, Texture, amplitude_sum, direction_sum, has_amplitude};

// Constants: docs/tuning.md, "Texture".
/// The strength at which amplitudes are as was measured to look best.
pub(crate) const USUAL_STRENGTH: u8 = 50;
/// The colour step of a map as a share of that of the file. An error of a node's sum is one of half as much in
/// 64 pixels of three channels, so with 0.144 it would count as much as theirs.
pub(crate) const STEP: f64 = 0.25;
/// The amplitude from which on the direction counts in full.
const LEAST_DIRECTED: f32 = 0.06;
/// The fewest and the most iterations of training. A map is small, so it has time for more of them than its
/// picture at low efforts.
const ITERATIONS: (u32, u32) = (60, 700);
/// Pictures of fewer nodes than this have no texture.
const LEAST_NODES: usize = 256;

/// The payload of the texture that a picture gets, unless it is not worth its bytes. `picture` has the Gaussians
/// of its fit, and `step` is the base-2 logarithm of the colour step of its file, about.
pub(crate) fn payload(
    job: &Job<'_>,
    picture: &Picture<'_>,
    step: f64,
    observer: &mut Observer<'_>,
) -> Result<Option<Vec<u8>>> {
    let cells = Cells::new(job.source, picture, observer)?;
    let size = [cells.columns + 1, cells.rows + 1];
    if size[0] * size[1] < LEAST_NODES {
        return Ok(None);
    }
    let strengths =
        strengths(&cells, f32::from(job.texture) / f32::from(USUAL_STRENGTH), observer)?;
    drop(cells);
    let amplitudes = strengths.iter().flat_map(|strength| strength.amplitudes);
    if !amplitudes.map(amplitude_sum).any(has_amplitude) {
        return Ok(None);
    }
    let samples: Vec<u16> = strengths.iter().flat_map(samples_of).collect();
    drop(strengths);
    let map = Source::new_u16(size[0] as u32, size[1] as u32, ColorModel::Rgb, &samples)
        .expect("the sizes agree");
    observer.silently(|observer| coded(job, &map, picture, step + STEP.log2(), observer))
}

/// The sums of a node as samples of 16 bits.
fn samples_of(strength: &Strength) -> [u16; OCTAVES + 1] {
    let most = strength.amplitudes.into_iter().fold(0.0, f32::max);
    let direction = strength.direction * (most / LEAST_DIRECTED).min(1.0);
    let [fine, coarse] = strength.amplitudes.map(amplitude_sum);
    [fine, coarse, direction_sum(direction)].map(|sum| (sum * 65_535.0 + 0.5) as u16)
}

/// The payload of a map, coded with a step, unless it has no Gaussians or is not worth its bytes.
fn coded(
    job: &Job<'_>,
    map: &Source<'_>,
    picture: &Picture<'_>,
    step: f64,
    observer: &mut Observer<'_>,
) -> Result<Option<Vec<u8>>> {
    let training = Training::fast(job.training.iterations.clamp(ITERATIONS.0, ITERATIONS.1));
    let (metadata, limits) = (Metadata::default(), Limits::none());
    let job = Job {
        source: map,
        aim: Aim::Lambda(rate_model::lambda_for_step(step)),
        tune: Tune::Visual,
        metadata: &metadata,
        training: &training,
        limits: &limits,
        ..*job
    };
    let (kernel, parameterization) = (training.kernel, training.parameterization);
    let base = [0.0, 0.0, direction_sum(0.0), 0.0];
    let layout = FileLayout::new(map, base, kernel, parameterization, &metadata);
    let tiled = TiledSource::new(map, job.tune, observer)?.without_colors();
    let budget = Budget::DistortionPerGaussian(rate_model::distortion_per_gaussian(step));
    let (precision, work) = (Precision::Entropy, Work::default());
    let mut fit = Fit::new(
        Resolutions::single(&tiled),
        &training,
        budget,
        precision,
        layout.base(),
        job.seed,
        work,
    );
    fit.run(job.workload(0), observer)?;
    let (gaussians, distortion) = (fit.gaussians(), fit.best_error().distortion);
    drop(fit);
    let judge = Judge::new(map);
    let work = SearchWork::new(&job, gaussians.len());
    let mut search = TargetSearch::new(&judge, &tiled, &layout, work, observer)?;
    let (mut coded, _) = search.run(&gaussians, distortion, job.aim, observer)?;
    if coded.codes.is_empty() {
        return Ok(None);
    }
    let color_step = coded.quantization.color[0];
    let payload = Texture::to_payload(&mut coded.codes, color_step, picture.header());
    let texture =
        Texture::parse(&payload, picture.header(), |_| Ok(())).expect("it was just written");
    // Where there shall be no texture, less than none is no error: samples are clamped.
    let without = Picture::new(layout.header(), &[], &limits, 0);
    let with = Picture::new(layout.header(), texture.gaussians(), &limits, 0);
    let gain = squared_error(&without, map, observer)? - squared_error(&with, map, observer)?;
    let bits = (ChunkType::TXTR.framed(payload.len()) * 8) as f64;
    let price = f64::from(rate_model::lambda(&coded.quantization));
    Ok((gain > price * bits).then_some(payload))
}
