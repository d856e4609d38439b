//! Texture: what figures that see it say, beside those that compare pixel by pixel, and what people
//! chose.

use anyhow::Result;
use image_gip::Encoder;

use crate::bench::{Bench, timing_version};
use crate::blind::choices;
use crate::comparison::{Better, NamedFigures, better_than};
use crate::contents::Contents;
use crate::gip;
use crate::local_statistics::{deviation_error, wasserstein_distortion};
use crate::metric::Metric;
use crate::pictures::{Distortion, PictureSet, TestPicture};
use crate::store::Store;
use crate::table::{Table, mean};
use crate::versions::{self, RATES, Version};

/// Of sets beside Kodak's one in so many pictures is measured.
const STEP: usize = 2;
/// The rates of a quick run.
const QUICK_RATES: [f64; 2] = [0.25, 1.0];

/// A name, and the encoder at an effort.
type Ours = (&'static str, fn(u8) -> Encoder);
/// With texture as by default, and without.
const OURS: [Ours; 2] = [(gip::NAME, gip::encoder), (gip::PLAIN_NAME, gip::plain_encoder)];
/// The baselines beside us.
const OTHERS: [&str; 3] = ["AVIF", "JPEG XL", "WebP"];
/// The codec beside ours in the table of single pictures.
const RIVAL: usize = OURS.len();
/// The name of the report's folder with the rounds of the blind choice.
const ROUNDS: &str = "blind";

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    let mut store = FigureStore::open(bench)?;
    let mut text = introduction();
    let rates: &[f64] = if bench.quick { &QUICK_RATES } else { &RATES };
    for set in
        bench.sets().into_iter().map(|set| if set.name == "Kodak" { set } else { set.every(STEP) })
    {
        let codecs = codecs(bench, &mut store, &set, rates)?;
        for (index, rate) in rates.iter().enumerate() {
            text.push_str(&format!("\n### Texture: {}, {rate} bpp\n", set.name));
            text.push_str(&means(bench, set.name, &codecs, (index, *rate)));
        }
        text.push_str(&format!("\n### Local deviations by picture: {}\n", set.name));
        text.push_str(&by_picture(&set, &codecs, &bench.contents, rates));
    }
    for (name, share) in choices::shares(&bench.path(ROUNDS))? {
        bench.figure(format!("{ROUNDS}/{name}"), 100.0 * share, "%");
    }
    let rounds = choices::report(&bench.path(ROUNDS))?;
    if !rounds.is_empty() {
        text.push_str(&format!(
            "\n### The blind choice\n\nViewers saw an original between two versions of it, in files \
             of equal size, and did not know what was compared: which one is nearer to the original \
             in a normal look?\n{rounds}"
        ));
    }
    Ok(text)
}

fn introduction() -> String {
    format!(
        "Ours, with texture as by default and without it, and {} at the setting whose file is \
         nearest to ours in size. Texture is not the source's own, pixel by pixel; figures that \
         compare pixels take it for noise, and take a smear for the better picture. Two figures \
         compare what is around a place, of luma from 0 to 255, with Gaussian windows:\n\n\
         - *Local deviations* (tex): the mean of |log2((d + 2) / (s + 2))| over pixels and three \
         octaves, of the local deviations s of the source and d of the decoded picture. The octaves \
         are differences of the picture blurred by 0, 1, 2 and 4 pixels (about 0.3, 0.15 and 0.08 \
         cycles a pixel); a deviation is the root of the mean square in a window of 6, 8.5 and 12 \
         pixels. 0 is as much texture everywhere as in the source, 1 is half or twice as much. The 2 \
         keeps flat areas from counting.\n\
         - *Wasserstein distortion* (wd): the picture at full size and halved one to three times; at \
         each place the means and the deviations of its derivatives in four directions in a window \
         of 4 pixels; the mean of the root of the squared differences of both, in levels of 255. What \
         varies slowly is compared place by place, what varies fast by how much it varies.\n\n\
         The other figures are those of the section about rate. Of sets beside Kodak's every other picture is \
         measured.\n",
        OTHERS.join(", "),
    )
}

/// What is measured of a file.
#[derive(Clone, Copy, Debug)]
struct Figures {
    bytes: f64,
    rate: f64,
    distortion: Distortion,
    /// The error of local deviations.
    tex: f64,
    /// The Wasserstein distortion.
    wd: f64,
    /// Gaussians of our texture, and its bytes in the file.
    texture: [f64; 2],
}

impl Figures {
    fn of(picture: &TestPicture, version: &Version) -> Result<Self> {
        let (source, decoded, width) = (&picture.rgb, &version.samples, picture.width);
        let report = version.report.as_ref();
        Ok(Self {
            bytes: version.bytes,
            rate: picture.rate(version.bytes),
            distortion: picture.distortion(decoded)?,
            tex: deviation_error(source, decoded, width),
            wd: wasserstein_distortion(source, decoded, width),
            texture: report.map_or([0.0; 2], |report| {
                [report.texture_gaussians.into(), report.texture_bytes as f64]
            }),
        })
    }

    /// In the order of the columns.
    fn values(&self) -> [f64; 11] {
        let [psnr, ms_ssim, ssimulacra2, butteraugli, cvvdp] = self.distortion.values();
        let ([gaussians, texture], Self { bytes, rate, tex, wd, .. }) = (self.texture, *self);
        [bytes, rate, psnr, ms_ssim, ssimulacra2, butteraugli, cvvdp, tex, wd, gaussians, texture]
    }
}

impl From<[f64; 11]> for Figures {
    fn from([bytes, rate, distortion @ .., tex, wd, gaussians, texture]: [f64; 11]) -> Self {
        let (distortion, texture) = (Distortion::from(distortion), [gaussians, texture]);
        Self { bytes, rate, distortion, tex, wd, texture }
    }
}

/// `texture.csv`: figures of files by codec, rate asked for, and picture.
struct FigureStore(Store<3, 11>);

impl FigureStore {
    fn open(bench: &Bench) -> Result<Self> {
        let others = ["tex", "wd", "texture_gaussians", "texture_bytes"];
        let values = Distortion::columns_of_file(&others);
        Ok(Self(bench.store("texture.csv", ["codec", "rate", "image"], values)?))
    }

    /// For each of some rates, the figures of each picture. What is missing is measured with one
    /// thread for each worker, by `show` of the indices of rate and picture.
    fn all<W: Send>(
        &mut self,
        version: &str,
        codec: &str,
        set: &PictureSet,
        rates: &[f64],
        workers: &mut [W],
        show: impl Fn(&mut W, usize, usize) -> Result<Version> + Sync,
    ) -> Result<Vec<Vec<Figures>>> {
        let pictures = &set.pictures;
        let names: Vec<String> = rates.iter().map(|rate| format!("{rate} bpp")).collect();
        let jobs = names.iter().enumerate().flat_map(|(rate, name)| {
            let of_rate = pictures.iter().enumerate();
            of_rate.map(move |(of, picture)| ([codec, name, &picture.name], (rate, of)))
        });
        let jobs: Vec<_> = jobs.collect();
        let rows = self.0.all(version, workers, &jobs, |worker, &(rate, of)| {
            Ok(Figures::of(&pictures[of], &show(worker, rate, of)?)?.values())
        })?;
        let of_rates = rows.chunks(pictures.len());
        Ok(of_rates.map(|rows| rows.iter().map(|&row| row.into()).collect()).collect())
    }
}

/// A codec on all pictures of a set.
struct Codec {
    name: &'static str,
    /// For each of the rates, the figures of each picture.
    figures: Vec<Vec<Figures>>,
}

/// [`OURS`], and then [`OTHERS`].
fn codecs(
    bench: &mut Bench,
    store: &mut FigureStore,
    set: &PictureSet,
    rates: &[f64],
) -> Result<Vec<Codec>> {
    let product = bench.product.clone();
    let (workers, versions) = bench.workers()?;
    let beside = timing_version(&product, &versions);
    let mut codecs: Vec<Codec> = Vec::new();
    for (name, encoder) in OURS {
        let figures = store.all(&product, name, set, rates, workers, |_, rate, of| {
            Version::ours(encoder(gip::EFFORT), &set.pictures[of], rates[rate])
        })?;
        codecs.push(Codec { name, figures });
    }
    for name in OTHERS {
        let (baseline, ours) = (versions::baseline_called(name)?, &codecs[0].figures);
        let figures =
            store.all(&beside, baseline.id, set, rates, workers, |worker, rate, of| {
                Version::baseline(worker, baseline, &set.pictures[of], ours[rate][of].bytes)
            })?;
        codecs.push(Codec { name, figures });
    }
    Ok(codecs)
}

/// Means over the pictures at one rate, and who is better than ours. `rate` is its index and the rate.
fn means(bench: &Bench, set: &str, codecs: &[Codec], rate: (usize, f64)) -> String {
    let mut columns = vec!["codec", "bpp", "Gaussians of texture", "of the bytes", "tex", "wd"];
    columns.extend(Metric::ALL.map(Metric::with_unit));
    let mut table = Table::new(&columns);
    let mut compared: Vec<NamedFigures> = Vec::new();
    for Codec { name, figures } in codecs {
        let figures = &figures[rate.0];
        let of = |figure: fn(&Figures) -> f64| mean(figures.iter().map(figure)).unwrap_or(f64::NAN);
        let (tex, wd) = (of(|file| file.tex), of(|file| file.wd));
        let levels = Metric::ALL.map(|metric| {
            let levels = figures.iter().map(|file| metric.level(&file.distortion));
            metric.mean(levels).unwrap_or(f64::NAN)
        });
        let cite = |figure: &str, value: f64| {
            bench.figure(format!("{set}/{name}/{} bpp/{figure}", rate.1), value, "");
        };
        cite("tex", tex);
        cite("wd", wd);
        for (metric, level) in Metric::ALL.iter().zip(levels) {
            cite(metric.name(), metric.shown(level));
        }
        let mut cells = vec![
            (*name).to_owned(),
            format!("{:.3}", of(|file| file.rate)),
            format!("{:.0}", of(|file| file.texture[0])),
            format!("{:.1} %", 100.0 * of(|file| file.texture[1] / file.bytes)),
            format!("{tex:.3}"),
            format!("{wd:.2}"),
        ];
        cells.extend(Metric::ALL.iter().zip(levels).map(|(metric, level)| metric.cell(level)));
        table.row(&cells);
        compared.push(((*name).to_owned(), [&[tex, wd], &levels[..]].concat()));
    }
    let mut figures = vec![("tex", Better::Lower), ("wd", Better::Lower)];
    figures.extend(Metric::ALL.map(|metric| (metric.name(), Better::Higher)));
    format!("{}{}", table.finish(), better_than(&figures, &compared[0], &compared[1..]))
}

/// The error of local deviations of each picture, and means by content.
fn by_picture(set: &PictureSet, codecs: &[Codec], contents: &Contents, rates: &[f64]) -> String {
    let mut columns = vec!["picture".to_owned(), "content".to_owned()];
    columns.extend(rates.iter().map(|rate| format!("{rate} bpp")));
    let mut table = Table::new(&columns);
    // Of the pictures with these indices, for each rate.
    let cells = |indices: &[usize]| -> Vec<String> {
        let all = (0..rates.len()).map(|rate| {
            let [ours, plain, rival] = [0, 1, RIVAL].map(|codec| {
                let all = &codecs[codec].figures[rate];
                mean(indices.iter().map(|&index| all[index].tex)).unwrap_or(f64::NAN)
            });
            format!("{ours:.3} / {plain:.3} / {rival:.3} ({:.0} %)", 100.0 * ours / plain)
        });
        all.collect()
    };
    let names: Vec<&str> = set.pictures.iter().map(|picture| picture.name.as_str()).collect();
    for (index, name) in names.iter().enumerate() {
        let mut row = vec![(*name).to_owned(), contents.of(name).to_owned()];
        row.extend(cells(&[index]));
        table.row(&row);
    }
    let mut classes: Vec<&str> = names.iter().map(|name| contents.of(name)).collect();
    classes.sort_unstable();
    classes.dedup();
    for class in classes.into_iter().filter(|class| !class.is_empty()) {
        let all = 0..names.len();
        let indices: Vec<usize> = all.filter(|&index| contents.of(names[index]) == class).collect();
        let mut row = vec!["**mean**".to_owned(), class.to_owned()];
        row.extend(cells(&indices));
        table.row(&row);
    }
    let mut row = vec!["**mean**".to_owned(), "all".to_owned()];
    row.extend(cells(&(0..names.len()).collect::<Vec<_>>()));
    table.row(&row);
    format!(
        "\n{} / {} / {}, and the first as a share of the second:\n{}",
        codecs[0].name,
        codecs[1].name,
        codecs[RIVAL].name,
        table.finish()
    )
}
