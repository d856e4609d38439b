//! Our codec, measured as the others are: whole files, from samples to bytes and back.

use std::time::Instant;

use anyhow::{Context, Result};
use image_gip::{ColorModel, Encoder, RenderOptions, Report, Source, StreamDecoder};

use crate::pictures::{Distortion, Picture};

/// How the codec is called in tables and files.
pub(crate) const NAME: &str = "gip";
/// The effort where no other is named: the encoder's default.
pub(crate) const EFFORT: u8 = 5;
/// The seed of everything random in the encoder.
pub(crate) const SEED: u64 = 0;
/// Decoding is timed as the median of this many.
const REPEATS: usize = 5;
/// What is wrong with a file that ends too early.
const NO_PICTURE: &str = "the file has no picture";

/// One `.gip` file.
#[derive(Clone, Debug)]
pub(crate) struct Coded {
    file: Vec<u8>,
    pub(crate) bytes: f64,
    pub(crate) report: Report,
    pub(crate) distortion: Distortion,
}

impl Coded {
    /// How long decoding takes, from the file to samples, with all threads or with one.
    pub(crate) fn decode_seconds(&self, parallel: bool) -> Result<f64> {
        median_seconds(|| decode(&self.file, parallel).map(|_| ()))
    }

    /// How long rendering takes, from the Gaussians to samples, with all threads.
    pub(crate) fn render_seconds(&self) -> Result<f64> {
        let options = RenderOptions::new();
        let mut decoder = StreamDecoder::new();
        decoder.feed(&self.file)?;
        let picture = decoder.picture().context(NO_PICTURE)?;
        let mut samples = vec![0; picture.output_len(&options)?];
        median_seconds(|| Ok(picture.render_u8(&options, &mut samples)?))
    }
}

/// How long something takes: the median of several times.
fn median_seconds(mut work: impl FnMut() -> Result<()>) -> Result<f64> {
    let mut seconds = Vec::new();
    for _ in 0..REPEATS {
        let start = Instant::now();
        work()?;
        seconds.push(start.elapsed().as_secs_f64());
    }
    seconds.sort_by(f64::total_cmp);
    Ok(seconds[REPEATS / 2])
}

/// The encoder at an effort, with the seed of all measurements.
pub(crate) fn encoder(effort: u8) -> Encoder {
    Encoder::new().with_effort(effort).with_seed(SEED)
}

/// Encodes and decodes a picture; `None` for all threads.
pub(crate) fn code(encoder: Encoder, picture: &Picture, threads: Option<usize>) -> Result<Coded> {
    let source = Source::new_u8(picture.width, picture.height, ColorModel::Rgb, &picture.rgb)?;
    let encoded = encoder.with_threads(threads).encode(&source)?;
    let file = encoded.bytes;
    let decoded = decode(&file, true)?;
    let (bytes, distortion) = (file.len() as f64, picture.distortion(&decoded)?);
    Ok(Coded { file, bytes, report: encoded.report, distortion })
}

/// The samples of a file.
fn decode(file: &[u8], parallel: bool) -> Result<Vec<u8>> {
    let options = RenderOptions::new().parallel(parallel);
    let mut decoder = StreamDecoder::new();
    decoder.feed(file)?;
    let picture = decoder.picture().context(NO_PICTURE)?;
    let mut samples = vec![0; picture.output_len(&options)?];
    picture.render_u8(&options, &mut samples)?;
    Ok(samples)
}
