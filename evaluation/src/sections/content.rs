//! How many Gaussians and bytes the encoder spends on simple and on difficult pictures.

use anyhow::Result;
use image_gip::{ColorModel, Encoded, Encoder, Source, Target, Threads, metrics};

use crate::bench::Bench;
use crate::comparison::list_or_none;
use crate::gip;
use crate::pictures::TestPicture;
use crate::table::{Table, mean, percent};

/// Width and height of all pictures of this section.
const SIDE: u32 = 256;
/// How many photographs are cut out of the pictures.
const PHOTOS: usize = 8;
const QUICK_PHOTOS: usize = 2;
/// Standard deviations, in 8-bit steps, of the noise on a photograph and on plain gray.
pub(super) const GRAIN: f64 = 8.0;
const NOISE: f64 = 20.0;
/// The target in dB for all pictures. A file without Gaussians has 22 dB on noise of [`NOISE`].
const PSNR: f64 = 26.0;
/// The colour model that others are compared with.
const RGB: &str = "RGB";
/// The kind of picture that others are compared with.
const PHOTOGRAPH: &str = "photograph";
/// Gaussians for comparing colour models.
const GAUSSIANS: u32 = 1000;

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    let photos = bench.sample(if bench.quick { QUICK_PHOTOS } else { PHOTOS });
    let photos: Vec<TestPicture> = photos.iter().map(middle).collect();
    let mut text = format!(
        "Compared with each other: pictures of {SIDE} x {SIDE} pixels, synthetic ones and the \
         middle of the photographs (means; {}). Effort {}.\n",
        bench.pictures_used(photos.len()),
        gip::EFFORT,
    );
    text.push_str(&kinds_of_content(bench, &photos)?);
    text.push_str(&colors(bench, &photos)?);
    Ok(text)
}

/// Makes the samples of a colour model from a photograph.
type Conversion = fn(&TestPicture) -> Vec<u8>;

/// What the encoder is asked for: its default, and a PSNR, for which it is tuned then. (Texture, which
/// it adds by default, costs PSNR.)
fn encoders() -> [(String, Encoder); 2] {
    let of_psnr = gip::psnr_encoder(gip::EFFORT).with_target(Target::Psnr(PSNR));
    [("auto".into(), gip::encoder(gip::EFFORT)), (format!("{PSNR} dB, tuned for PSNR"), of_psnr)]
}

fn kinds_of_content(bench: &Bench, photos: &[TestPicture]) -> Result<String> {
    let mut store = bench.store(
        "content.csv",
        ["picture", "target", "effort"],
        ["gaussians", "bytes", "psnr", "encode_seconds"],
    )?;
    let grainy: Vec<TestPicture> = photos.iter().map(|photo| noisy(photo, GRAIN)).collect();
    let kinds = [
        ("flat", vec![synthetic("flat", |_, _| [96, 128, 160])]),
        ("ramp", vec![synthetic("ramp", |x, y| [x as u8, y as u8, ((x + y) / 2) as u8])]),
        ("six discs", vec![synthetic("discs", discs)]),
        (PHOTOGRAPH, photos.to_vec()),
        ("photograph with noise", grainy),
        ("noise", vec![noisy(&synthetic("noise", |_, _| [128; 3]), NOISE)]),
    ];
    let mut text = String::new();
    for (name, encoder) in encoders() {
        let mut table =
            Table::new(&["picture", "Gaussians", "bytes", "bpp", "PSNR in dB", "encode s"]);
        let (mut largest, mut photograph) = ((0.0, ""), 0.0);
        for (kind, pictures) in &kinds {
            let mut all = Vec::new();
            for picture in pictures {
                let key = [picture.name.as_str(), &name, &gip::EFFORT.to_string()];
                all.push(store.get(&bench.product, key, || {
                    let measured = gip::encode(encoder.clone(), picture, Threads::Pool)?;
                    let report = measured.report;
                    let psnr = measured.distortion.psnr;
                    Ok([report.gaussians.into(), measured.bytes, psnr, report.seconds])
                })?);
            }
            let [gaussians, bytes, psnr, seconds] = means(&all);
            bench.figure(format!("{name}/{kind}/bytes"), bytes, "bytes");
            bench.figure(format!("{name}/{kind}/PSNR"), psnr, "dB");
            if bytes > largest.0 {
                largest = (bytes, *kind);
            }
            if *kind == PHOTOGRAPH {
                photograph = bytes;
            }
            table.row(&[
                (*kind).to_owned(),
                format!("{gaussians:.0}"),
                format!("{bytes:.0}"),
                format!("{:.3}", 8.0 * bytes / f64::from(SIDE * SIDE)),
                format!("{psnr:.2}"),
                format!("{seconds:.2}"),
            ]);
        }
        text.push_str(&format!(
            "\nTarget: {name}.\n{}\nLargest: {}, with {:.1} times the bytes of a photograph.\n",
            table.finish(),
            largest.1,
            largest.0 / photograph,
        ));
    }
    Ok(text)
}

/// The bytes that gray saves and alpha costs.
fn colors(bench: &Bench, photos: &[TestPicture]) -> Result<String> {
    let mut store = bench.store(
        "content-colors.csv",
        ["picture", "colors", "gaussians", "effort"],
        ["gaussians", "bytes", "psnr_of_colors"],
    )?;
    let models: [(_, _, Conversion); 5] = [
        ("gray", ColorModel::Gray, |photo| gray(photo).collect()),
        ("gray, soft alpha", ColorModel::GrayAlpha, |photo| {
            gray(photo).zip(alpha()).flat_map(|(gray, alpha)| [gray, alpha]).collect()
        }),
        (RGB, ColorModel::Rgb, |photo| photo.rgb.clone()),
        ("RGB, opaque alpha", ColorModel::Rgba, |photo| {
            photo.rgb.chunks_exact(3).flat_map(|p| [p[0], p[1], p[2], 255]).collect()
        }),
        ("RGB, soft alpha", ColorModel::Rgba, |photo| {
            let pixels = photo.rgb.chunks_exact(3).zip(alpha());
            pixels.flat_map(|(p, alpha)| [p[0], p[1], p[2], alpha]).collect()
        }),
    ];
    let mut table = Table::new(&[
        "colours",
        "Gaussians",
        "bytes",
        "against RGB",
        "bits per Gaussian",
        "PSNR in dB",
    ]);
    let mut rows = Vec::new();
    for (name, model, samples) in models {
        let mut all = Vec::new();
        for photo in photos {
            let key = [photo.name.as_str(), name, &GAUSSIANS.to_string(), &gip::EFFORT.to_string()];
            all.push(store.get(&bench.product, key, || {
                let samples = samples(photo);
                let source = Source::new_u8(SIDE, SIDE, model, &samples)?;
                let encoder =
                    gip::psnr_encoder(gip::EFFORT).with_target(Target::Gaussians(GAUSSIANS));
                let Encoded { bytes, report, .. } = encoder.encode(&source)?;
                let decoded = gip::decode(&bytes, Threads::Pool)?;
                let [source, decoded] = [&samples, &decoded].map(|samples| shown(samples, model));
                let psnr = metrics::psnr(&source, &decoded, 255.0);
                Ok([report.gaussians.into(), bytes.len() as f64, psnr])
            })?);
        }
        rows.push((name, means(&all)));
    }
    let rgb = rows.iter().find(|(name, _)| *name == RGB).map(|(_, [_, bytes, _])| *bytes);
    let mut larger = Vec::new();
    for (name, [gaussians, bytes, psnr]) in &rows {
        let share = rgb.map(|rgb| bytes / rgb - 1.0);
        bench.figure(format!("{name}/against RGB"), 100.0 * share.unwrap_or(f64::NAN), "%");
        if share.is_some_and(|share| share > 0.0) {
            larger.push(*name);
        }
        table.row(&[
            (*name).to_owned(),
            format!("{gaussians:.0}"),
            format!("{bytes:.0}"),
            percent(share),
            format!("{:.1}", 8.0 * bytes / gaussians),
            format!("{psnr:.2}"),
        ]);
    }
    Ok(format!(
        "\nCompared with {RGB}: the photographs with at most {GAUSSIANS} Gaussians in other colour \
         models, tuned for PSNR, which is that of the colours on black, without alpha: of gray, of one channel.\n{}\nMore bytes than \
         {RGB}: {}.\n",
        table.finish(),
        list_or_none(larger.into_iter()),
    ))
}

fn means<const N: usize>(all: &[[f64; N]]) -> [f64; N] {
    std::array::from_fn(|column| mean(all.iter().map(|row| row[column])).unwrap_or(f64::NAN))
}

/// The middle of a photograph; a smaller one is continued in mirror images.
pub(super) fn middle(photo: &TestPicture) -> TestPicture {
    let (left, top) = (photo.width.saturating_sub(SIDE) / 2, photo.height.saturating_sub(SIDE) / 2);
    let mut part = photo.mirrored(photo.width.max(SIDE), photo.height.max(SIDE));
    let row = part.width as usize * 3;
    part.rgb = part
        .rgb
        .chunks_exact(row)
        .skip(top as usize)
        .take(SIDE as usize)
        .flat_map(|row| &row[left as usize * 3..][..SIDE as usize * 3])
        .copied()
        .collect();
    TestPicture { width: SIDE, height: SIDE, ..part }
}

fn synthetic(name: &str, pixel: impl Fn(u32, u32) -> [u8; 3]) -> TestPicture {
    let rgb = (0..SIDE * SIDE).flat_map(|i| pixel(i % SIDE, i / SIDE)).collect();
    TestPicture { name: name.into(), path: "".into(), width: SIDE, height: SIDE, rgb }
}

/// Discs of several sizes and colours on a plain ground.
fn discs(x: u32, y: u32) -> [u8; 3] {
    let discs = [
        (60, 70, 45, [220, 60, 40]),
        (180, 60, 30, [40, 90, 200]),
        (130, 140, 20, [250, 220, 90]),
        (60, 190, 35, [60, 160, 80]),
        (200, 190, 40, [120, 60, 140]),
        (130, 225, 12, [20, 20, 20]),
    ];
    let inside = |&&(cx, cy, r, _): &&(u32, u32, u32, [u8; 3])| {
        x.abs_diff(cx).pow(2) + y.abs_diff(cy).pow(2) <= r * r
    };
    discs.iter().find(inside).map_or([235, 230, 220], |disc| disc.3)
}

/// The picture with Gaussian noise of a standard deviation on every sample.
pub(super) fn noisy(picture: &TestPicture, deviation: f64) -> TestPicture {
    let mut random = fastrand::Rng::with_seed(gip::SEED);
    let rgb = picture.rgb.iter().map(|&sample| {
        let radius = (-2.0 * (1.0 - random.f64()).ln()).sqrt();
        let normal = radius * (std::f64::consts::TAU * random.f64()).cos();
        (f64::from(sample) + deviation * normal).round().clamp(0.0, 255.0) as u8
    });
    TestPicture {
        rgb: rgb.collect(),
        name: format!("{} with noise", picture.name),
        ..picture.clone()
    }
}

/// The luma of every pixel.
fn gray(picture: &TestPicture) -> impl Iterator<Item = u8> {
    picture.rgb.chunks_exact(3).map(|pixel| {
        let [r, g, b] = [0, 1, 2].map(|channel| f64::from(pixel[channel]));
        (0.299 * r + 0.587 * g + 0.114 * b).round() as u8
    })
}

/// The colours of the samples of a model on a black ground.
fn shown(samples: &[u8], model: ColorModel) -> Vec<u8> {
    let channels = model.channels();
    let colors = channels - usize::from(model.has_alpha());
    let pixels = samples.chunks_exact(channels).flat_map(|pixel| {
        let alpha = if colors < channels { u16::from(pixel[colors]) } else { 255 };
        pixel[..colors].iter().map(move |&color| ((u16::from(color) * alpha + 127) / 255) as u8)
    });
    pixels.collect()
}

/// Alpha samples: opaque in the middle, fading out towards the corners.
fn alpha() -> impl Iterator<Item = u8> {
    (0..SIDE * SIDE).map(|i| {
        let (x, y) = ((i % SIDE).abs_diff(SIDE / 2), (i / SIDE).abs_diff(SIDE / 2));
        let distance = f64::from(x * x + y * y).sqrt() / f64::from(SIDE / 2);
        (255.0 * (1.5 - distance).clamp(0.0, 1.0)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_has_the_side_whatever_the_photograph() {
        for (width, height) in [(100, 300), (256, 256), (400, 100)] {
            let rgb = (0..width * height).flat_map(|i| [(i % width) as u8, (i / width) as u8, 0]);
            let rgb = rgb.collect();
            let photo = TestPicture { name: String::new(), path: "".into(), width, height, rgb };
            let part = middle(&photo);
            assert_eq!((part.width, part.height), (SIDE, SIDE));
            assert_eq!(part.rgb.len(), (SIDE * SIDE * 3) as usize);
            assert_eq!(u32::from(part.rgb[0]), width.saturating_sub(SIDE) / 2);
            assert_eq!(u32::from(part.rgb[1]), height.saturating_sub(SIDE) / 2);
        }
    }

    #[test]
    fn colors_are_shown_on_black() {
        assert_eq!(shown(&[9, 255, 200, 51], ColorModel::GrayAlpha), [9, 40]);
        assert_eq!(shown(&[1, 2, 3, 0, 1, 2, 3, 255], ColorModel::Rgba), [0, 0, 0, 1, 2, 3]);
        assert_eq!(shown(&[1, 2, 3], ColorModel::Rgb), [1, 2, 3]);
    }

    #[test]
    fn noise_is_the_same_every_time_and_as_strong_as_stated() {
        let gray = synthetic("gray", |_, _| [128; 3]);
        let a = noisy(&gray, NOISE);
        assert_eq!(a.rgb, noisy(&gray, NOISE).rgb);
        let psnr = gray.distortion(&a.rgb).expect("equal sizes").psnr;
        assert!((psnr - 20.0 * (255.0 / NOISE).log10()).abs() < 0.1, "{psnr}");
    }
}
