//! Our codec, measured like the baselines: whole files, from samples to bytes and back.

use std::time::Instant;

use anyhow::{Context, Result};
use image_gip::{
    ColorModel, Decoder, Encoded, Encoder, RenderOptions, Report, Source, StreamDecoder, Threads,
    Tune,
};

use crate::memory;
use crate::pictures::{Distortion, TestPicture};
use crate::table::median;

/// The name of our codec in tables and CSV files.
pub(crate) const NAME: &str = "gip";
/// The same for [`psnr_encoder`], beside the default.
pub(crate) const PSNR_NAME: &str = "gip --tune psnr";
/// The same for [`plain_encoder`].
pub(crate) const PLAIN_NAME: &str = "gip --texture 0";
/// The encoder's default effort, used wherever no other is named.
pub(crate) const EFFORT: u8 = 4;
/// All efforts.
pub(crate) const EFFORTS: [u8; 7] = [1, 2, 3, 4, 5, 6, 7];
/// Those of a quick run.
pub(crate) const QUICK_EFFORTS: [u8; 2] = [1, EFFORT];
/// The seed of everything random in the encoder.
pub(crate) const SEED: u64 = 0;
/// Decoding is timed as the median of this many.
const REPEATS: usize = 5;

/// A `.gip` file of a picture, with what was measured of it.
#[derive(Clone, Debug)]
pub(crate) struct MeasuredFile {
    pub(crate) file: Vec<u8>,
    pub(crate) bytes: f64,
    pub(crate) report: Report,
    pub(crate) distortion: Distortion,
    /// Peak memory of the encoder in bytes, without the source.
    pub(crate) memory: f64,
}

/// The encoder at an effort, with the seed of all measurements.
pub(crate) fn encoder(effort: u8) -> Encoder {
    Encoder::new().with_effort(effort).with_seed(SEED)
}

/// The same, tuned for PSNR: where only PSNR is compared, and for the published methods, which
/// minimize squared error.
pub(crate) fn psnr_encoder(effort: u8) -> Encoder {
    encoder(effort).with_tune(Tune::Psnr)
}

/// The same without texture, beside the default.
pub(crate) fn plain_encoder(effort: u8) -> Encoder {
    encoder(effort).with_texture(0)
}

/// Encodes a picture and measures the file.
pub(crate) fn encode(
    encoder: Encoder,
    picture: &TestPicture,
    threads: Threads,
) -> Result<MeasuredFile> {
    let source = source(picture)?;
    let encoder = encoder.with_threads(threads);
    let (encoded, memory) = memory::peak(|| encoder.encode(&source));
    let encoded = encoded?;
    let file = encoded.bytes;
    let (bytes, distortion) = (file.len() as f64, distortion(&file, picture)?);
    Ok(MeasuredFile { file, bytes, report: encoded.report, distortion, memory })
}

/// Encodes a picture without measuring it.
pub(crate) fn file(encoder: Encoder, picture: &TestPicture, threads: Threads) -> Result<Encoded> {
    Ok(encoder.with_threads(threads).encode(&source(picture)?)?)
}

fn source(picture: &TestPicture) -> Result<Source<'_>> {
    Ok(Source::new_u8(picture.width, picture.height, ColorModel::Rgb, &picture.rgb)?)
}

/// Decodes a file, or the beginning of one, and passes its picture on.
pub(crate) fn open<T>(
    file: &[u8],
    work: impl FnOnce(image_gip::Picture<'_>) -> Result<T>,
) -> Result<T> {
    let mut decoder = StreamDecoder::new();
    decoder.feed(file)?;
    work(decoder.picture().context("the file has no picture")?)
}

/// The distortion of a file against its source.
pub(crate) fn distortion(file: &[u8], picture: &TestPicture) -> Result<Distortion> {
    picture.distortion(&decode(file, Threads::Pool)?)
}

/// PSNR in dB of the float rendering, clamped but not rounded, as papers measure it.
pub(crate) fn psnr_float(file: &[u8], picture: &TestPicture) -> Result<f64> {
    let (planes, pixels) = (planes(file)?, picture.rgb.len() / 3);
    let squared = planes.iter().enumerate().map(|(index, sample)| {
        let source = picture.rgb[index % pixels * 3 + index / pixels];
        (f64::from(sample.clamp(0.0, 1.0)) - f64::from(source) / 255.0).powi(2)
    });
    Ok(-10.0 * (squared.sum::<f64>() / planes.len() as f64).log10())
}

/// The float rendering, plane after plane.
pub(crate) fn planes(file: &[u8]) -> Result<Vec<f32>> {
    open(file, |picture| {
        let options = RenderOptions::new();
        let mut planes = vec![0.0; picture.output_len(&options)?];
        picture.render_planes(&options, &mut planes)?;
        Ok(planes)
    })
}

/// The samples of a file.
pub(crate) fn decode(file: &[u8], threads: Threads) -> Result<Vec<u8>> {
    decode_with(file, RenderOptions::new().with_threads(threads))
}

/// The same without texture.
pub(crate) fn decode_plain(file: &[u8], threads: Threads) -> Result<Vec<u8>> {
    decode_with(file, RenderOptions::new().with_threads(threads).with_texture(false))
}

/// The same as by default, at another size than the stored one.
pub(crate) fn decode_at(file: &[u8], (width, height): (u32, u32)) -> Result<Vec<u8>> {
    decode_with(file, RenderOptions::new().with_size(width, height))
}

fn decode_with(file: &[u8], options: RenderOptions) -> Result<Vec<u8>> {
    let mut decoder = Decoder::new(file)?;
    decoder.set_options(options);
    let mut samples = vec![0; decoder.output_len()?];
    decoder.decode_into(&mut samples)?;
    Ok(samples)
}

/// Peak memory of decoding in bytes, without the file but with the samples.
pub(crate) fn decode_memory(file: &[u8]) -> Result<f64> {
    let (samples, bytes) = memory::peak(|| decode(file, Threads::Pool));
    samples.map(|_| bytes)
}

/// Seconds of decoding, from the file to samples.
pub(crate) fn decode_seconds(file: &[u8], threads: Threads) -> Result<f64> {
    median_seconds(REPEATS, || decode(file, threads).map(|_| ()))
}

/// Seconds of rendering, from Gaussians to samples, with all threads.
pub(crate) fn render_seconds(file: &[u8]) -> Result<f64> {
    let options = RenderOptions::new();
    open(file, |picture| {
        let mut samples = vec![0; picture.output_len(&options)?];
        median_seconds(REPEATS, || Ok(picture.render_u8(&options, &mut samples)?))
    })
}

/// The median time of some work in seconds, over so many repeats.
pub(crate) fn median_seconds(repeats: usize, mut work: impl FnMut() -> Result<()>) -> Result<f64> {
    let seconds = (0..repeats).map(|_| {
        let start = Instant::now();
        work()?;
        Ok(start.elapsed().as_secs_f64())
    });
    median(seconds.collect::<Result<Vec<f64>>>()?).context("nothing was timed")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn psnr_equals_what_the_encoder_reports() {
        let (width, height) = (24, 16);
        let rgb = (0..width * height).flat_map(|i| [(i % 24 * 10) as u8, (i / 24 * 9) as u8, 77]);
        let picture =
            TestPicture { name: String::new(), path: "".into(), width, height, rgb: rgb.collect() };
        let encoder = encoder(1).with_target(image_gip::Target::Gaussians(20));
        let measured = encode(encoder, &picture, Threads::Pool).expect("a small picture");
        let psnr = psnr_float(&measured.file, &picture).expect("it decodes");
        assert!((psnr - measured.report.psnr_float).abs() < 1e-3, "{psnr}");
        assert_eq!(measured.distortion.psnr, measured.report.psnr);
    }
}
