//! `gip compare`.

use core::fmt;

use anyhow::{Result, bail};
use image_gip::{ColorModel, SampleDepth, metrics};
use serde::Serialize;

use crate::args;
use crate::encode::json_psnr;
use crate::errors::WrongUsage;
use crate::files;
use crate::picture::{SampleSlice, StillImage, widest};
use crate::source::Reading;

pub(crate) fn run(args: &args::Compare) -> Result<()> {
    if files::is_standard_stream(&args.a) && files::is_standard_stream(&args.b) {
        bail!(WrongUsage("only one of the two pictures can come from standard input".into()));
    }
    let reading = Reading { limits: args.limits.limits(), allow_partial: false };
    let (mut a, mut b) = (reading.read(&args.a)?, reading.read(&args.b)?);
    files::warn(&args.a, &a.warnings);
    files::warn(&args.b, &b.warnings);
    let size = |picture: &StillImage| (picture.image.width(), picture.image.height());
    if size(&a) != size(&b) {
        let ((w, h), (v, g)) = (size(&a), size(&b));
        bail!("the sizes differ: {w}x{h} and {v}x{g}");
    }
    // `encode` does not store an opaque alpha channel.
    a.drop_opaque_alpha();
    b.drop_opaque_alpha();
    let color = widest(a.color(), b.color());
    let depth = if a.depth().bits() > b.depth().bits() { a.depth() } else { b.depth() };
    a.convert(color, depth);
    b.convert(color, depth);
    let samples = |picture| shown(picture, args.keep_invisible);
    let comparison = Comparison::new(&a, depth, &samples(&a), &samples(&b));
    let text = if args.json { serde_json::to_string(&comparison)? } else { comparison.to_string() };
    files::print(&text, None)
}

/// The samples of a picture, with colours times their alpha unless those under alpha 0 count, too.
fn shown(picture: &StillImage, keep_invisible: bool) -> Vec<f64> {
    fn of<T: Copy + Into<f64>>(samples: &[T], color: ColorModel, full: T, keep: bool) -> Vec<f64> {
        match keep {
            true => samples.iter().map(|&sample| sample.into()).collect(),
            false => metrics::premultiplied(samples, color, full.into()),
        }
    }
    match picture.samples() {
        SampleSlice::Eight(samples) => of(samples, picture.color(), u8::MAX, keep_invisible),
        SampleSlice::Sixteen(samples) => of(samples, picture.color(), u16::MAX, keep_invisible),
    }
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Comparison {
    width: u32,
    height: u32,
    channels: usize,
    depth: u8,
    psnr: f64,
    ms_ssim: f64,
    max_abs_error: u32,
}

impl Comparison {
    fn new(picture: &StillImage, depth: SampleDepth, a: &[f64], b: &[f64]) -> Self {
        let full_scale = f64::from((1_u32 << depth.bits()) - 1);
        let (width, height) = (picture.image.width(), picture.image.height());
        let channels = picture.color().channels();
        Self {
            width,
            height,
            channels,
            depth: depth.bits(),
            psnr: json_psnr(metrics::psnr(a, b, full_scale)),
            ms_ssim: metrics::ms_ssim(a, b, width as usize, channels, full_scale),
            max_abs_error: metrics::max_abs_error(a, b).ceil() as u32,
        }
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { psnr, ms_ssim, max_abs_error, depth, .. } = self;
        if *max_abs_error == 0 {
            return f.write_str("identical");
        }
        let full = (1_u32 << depth) - 1;
        write!(
            f,
            "PSNR {psnr:.3} dB, MS-SSIM {ms_ssim:.5}, largest error {max_abs_error} of {full}"
        )
    }
}
