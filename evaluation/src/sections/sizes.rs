//! Pictures shown at other sizes than they are stored at: small ones enlarged, and large ones as
//! thumbnails.

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result};
use image::RgbImage;
use image::imageops::{self, FilterType};
use image_gip::{Target, Threads};

use crate::baselines::Worker;
use crate::bench::{Bench, timing_version};
use crate::comparison::{Better, NamedFigures, better_than};
use crate::files;
use crate::gip;
use crate::metric::Metric;
use crate::parallel;
use crate::pictures::{Distortion, TestPicture};
use crate::store::Store;
use crate::table::{Table, mean};
use crate::versions::{self, Version};

/// How many pictures of each set.
const PICTURES: usize = 6;
const QUICK_PICTURES: usize = 1;
/// The most pixels of a picture: a larger one, of the screenshots, is left out.
const MOST_PIXELS: f64 = 2e6;
/// Sides are cut to multiples of this, so that every size is exact.
const MULTIPLE: u32 = 8;
/// The codecs beside ours.
const OTHERS: [&str; 2] = ["AVIF", "WebP"];

/// How a file is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Show {
    /// The picture is stored at this part of its size, and shown at its size.
    Enlarged(u32),
    /// The picture is stored at its size, and shown at this part of it.
    Reduced(u32),
}

/// All ways, with rates in bits per pixel of what is stored.
const ALL: [(Show, [f64; 2]); 4] = [
    (Show::Enlarged(2), [0.5, 1.5]),
    (Show::Enlarged(4), [0.5, 1.5]),
    (Show::Reduced(4), [0.25, 1.0]),
    (Show::Reduced(8), [0.25, 1.0]),
];

/// Ours rendered at the size it is shown at.
const RENDERED: &str = "gip, rendered at this size";
/// Ours stored at its size, in as many bytes.
const WHOLE: &str = "gip at full size, as many bytes";

impl Show {
    fn title(self) -> String {
        match self {
            Self::Enlarged(factor) => {
                format!("stored at 1/{factor} of the size, enlarged {factor} times")
            }
            Self::Reduced(factor) => format!("stored at full size, shown at 1/{factor}"),
        }
    }

    /// In the CSV.
    fn key(self) -> String {
        match self {
            Self::Enlarged(factor) => format!("x{factor}"),
            Self::Reduced(factor) => format!("1/{factor}"),
        }
    }

    /// The ways to show a file, ours first.
    fn ways(self) -> Vec<String> {
        let codecs = || [gip::NAME].into_iter().chain(OTHERS);
        let names = codecs().flat_map(|codec| {
            self.filters().map(move |filter| format!("{codec}, {}", filter.name()))
        });
        let whole = matches!(self, Self::Enlarged(_)).then(|| WHOLE.to_owned());
        [RENDERED.to_owned()].into_iter().chain(names).chain(whole).collect()
    }

    fn filters(self) -> [Filter; 2] {
        match self {
            Self::Enlarged(_) => [Filter::Lanczos, Filter::Bicubic],
            Self::Reduced(_) => [Filter::Area, Filter::Lanczos],
        }
    }
}

/// How a decoded picture is brought to another size.
#[derive(Clone, Copy, Debug)]
enum Filter {
    Area,
    Lanczos,
    Bicubic,
}

impl Filter {
    fn name(self) -> &'static str {
        match self {
            Self::Area => "area",
            Self::Lanczos => "Lanczos",
            Self::Bicubic => "bicubic",
        }
    }

    fn resized(self, picture: &RgbImage, [width, height]: [u32; 2]) -> RgbImage {
        match self {
            Self::Area => imageops::thumbnail(picture, width, height),
            Self::Lanczos => imageops::resize(picture, width, height, FilterType::Lanczos3),
            Self::Bicubic => imageops::resize(picture, width, height, FilterType::CatmullRom),
        }
    }
}

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    let mut store = FileStore::open(bench)?;
    let mut text = introduction();
    for (name, pictures) in groups(bench) {
        store.fill(bench, &pictures)?;
        text.push_str(&format!(
            "\n### Other sizes: {name}\n\nMeans over {} pictures.\n",
            pictures.len()
        ));
        for (show, rates) in ALL {
            for rate in rates {
                text.push_str(&table(&store.files(show, rate, &pictures)?, show, rate));
            }
        }
    }
    Ok(text)
}

/// What photographs say, in short, for the first page.
pub(super) fn claim(bench: &mut Bench) -> Result<String> {
    let store = FileStore::open(bench)?;
    let photographs = groups(bench).swap_remove(0).1;
    let mut claims = Vec::new();
    for (show, rates) in ALL {
        // They are there once the section has been measured.
        let Ok(ways) = store.files(show, rates[1], &photographs) else { continue };
        let by = |other: &Way| {
            let metric = Metric::Ssimulacra2;
            let by = ways[0].level(metric) - other.level(metric);
            format!("{by:+.2} against {}", other.name)
        };
        let title = format!("{} ({} bpp)", show.title(), rates[1]);
        claims.push(format!("{title}: {}, {}", by(&ways[1]), by(&ways[3])));
    }
    if claims.is_empty() {
        return Ok("- **At other sizes**: not measured with this version.\n".to_owned());
    }
    Ok(format!(
        "- **At other sizes**, what rendering there is worth in {}: {}.\n",
        Metric::Ssimulacra2.name(),
        claims.join("; ")
    ))
}

/// Photographs and, if there are any, screens.
fn groups(bench: &Bench) -> Vec<(&'static str, Vec<TestPicture>)> {
    let most = if bench.quick { QUICK_PICTURES } else { PICTURES };
    let mut groups = vec![("photographs", Vec::new()), ("screens", Vec::new())];
    for set in bench.all_sets().into_iter().filter(|set| set.name != "large") {
        let of_screens = usize::from(set.name == "screens");
        let all: Vec<TestPicture> =
            set.pictures.into_iter().filter(|picture| picture.pixels() <= MOST_PIXELS).collect();
        let count = most.min(all.len());
        groups[of_screens].1.extend((0..count).map(|index| cut(&all[index * all.len() / count])));
    }
    groups.retain(|(_, pictures)| !pictures.is_empty());
    groups
}

fn introduction() -> String {
    format!(
        "Gaussians have no pixels, so a file can be rendered at any size. Enlarged: the picture is \
         reduced by area, stored, and compared with the original at its full size; ours is rendered there \
         from the Gaussians, or decoded as it is stored and enlarged like the others, by Lanczos's filter \
         of three lobes or the bicubic one of Catmull and Rom. The last row is our file of the picture at \
         its full size in as many bytes: what storing it smaller costs or gains. Reduced: the file of \
         the whole picture, shown small. Ours is rendered at that size, which is the average by area, or \
         decoded and reduced like the others; each is compared with the original reduced by the \
         same filter. {} are as in the section about rate, at the setting whose file is nearest to ours in \
         size. Rates are of the picture that is stored. Effort {}; without pictures of more than {} \
         megapixels.\n",
        OTHERS.join(" and "),
        gip::EFFORT,
        MOST_PIXELS / 1e6,
    )
}

/// A picture with sides that are multiples of [`MULTIPLE`].
fn cut(picture: &TestPicture) -> TestPicture {
    let [width, height] = [picture.width, picture.height].map(|side| side / MULTIPLE * MULTIPLE);
    picture.mirrored(width.max(MULTIPLE), height.max(MULTIPLE))
}

fn image_of(picture: &TestPicture) -> RgbImage {
    image_of_samples(&picture.rgb, [picture.width, picture.height])
}

fn image_of_samples(samples: &[u8], [width, height]: [u32; 2]) -> RgbImage {
    RgbImage::from_raw(width, height, samples.to_vec()).expect("as many samples as the size has")
}

/// A picture at another size, in a file for the worker to read.
fn with_file(picture: &TestPicture, image: &RgbImage, path: PathBuf) -> Result<TestPicture> {
    image.save(&path)?;
    let path = fs::canonicalize(path)?;
    let (width, height) = image.dimensions();
    Ok(TestPicture { name: picture.name.clone(), path, width, height, rgb: image.to_vec() })
}

/// The way to show a file, and the values for the CSV.
type Shown = (String, [f64; 7]);

fn shown(way: &str, stored: &TestPicture, bytes: f64, distortion: &Distortion) -> Shown {
    let [psnr, ms_ssim, ssimulacra2, butteraugli, cvvdp] = distortion.values();
    let rate = stored.rate(bytes);
    (way.to_owned(), [bytes, rate, psnr, ms_ssim, ssimulacra2, butteraugli, cvvdp])
}

/// Shows a picture in all ways. `stored` is the picture that files are made of.
fn show_all(
    worker: &mut Worker,
    picture: &TestPicture,
    stored: &TestPicture,
    show: Show,
    rate: f64,
) -> Result<Vec<Shown>> {
    let whole = image_of(picture);
    let factor = match show {
        Show::Enlarged(_) => 1,
        Show::Reduced(factor) => factor,
    };
    let size = [picture.width / factor, picture.height / factor];
    let original = |filter: Filter| match show {
        Show::Enlarged(_) => picture.clone(),
        Show::Reduced(_) => {
            let rgb = filter.resized(&whole, size).into_raw();
            TestPicture { width: size[0], height: size[1], rgb, ..picture.clone() }
        }
    };
    let encoder = gip::encoder(gip::EFFORT).with_target(Target::BitsPerPixel(rate));
    let file = gip::file(encoder, stored, Threads::One)?.bytes;
    let bytes = file.len() as f64;
    let rendered = gip::decode_at(&file, (size[0], size[1]))?;
    let distortion = original(Filter::Area).distortion(&rendered)?;
    let mut all = vec![shown(RENDERED, stored, bytes, &distortion)];
    let mut decoded = vec![(gip::NAME, bytes, gip::decode(&file, Threads::One)?)];
    for name in OTHERS {
        let baseline = versions::baseline_called(name)?;
        let version = Version::baseline(worker, baseline, stored, bytes)?;
        decoded.push((name, version.bytes, version.samples));
    }
    for (codec, bytes, samples) in decoded {
        let decoded = image_of_samples(&samples, [stored.width, stored.height]);
        for filter in show.filters() {
            let distortion = original(filter).distortion(&filter.resized(&decoded, size))?;
            let way = format!("{codec}, {}", filter.name());
            all.push(shown(&way, stored, bytes, &distortion));
        }
    }
    if let Show::Enlarged(_) = show {
        let encoder = gip::encoder(gip::EFFORT).with_target(Target::Bytes(bytes as u64));
        let file = gip::file(encoder, picture, Threads::One)?.bytes;
        let decoded = gip::decode(&file, Threads::One)?;
        let distortion = picture.distortion(&decoded)?;
        all.push(shown(WHOLE, stored, file.len() as f64, &distortion));
    }
    Ok(all)
}

/// `sizes.csv`: files by the way they are shown, the size, the rate asked for, and picture.
struct FileStore {
    store: Store<4, 7>,
    /// Of ours and of the others.
    version: String,
}

impl FileStore {
    fn open(bench: &mut Bench) -> Result<Self> {
        let values = Distortion::columns_of_file(&[]);
        let store = bench.store("sizes.csv", ["way", "size", "rate", "image"], values)?;
        let (_, versions) = bench.workers()?;
        Ok(Self { store, version: timing_version(&bench.product, &versions) })
    }

    /// Measures what is missing, on all cores.
    fn fill(&mut self, bench: &mut Bench, pictures: &[TestPicture]) -> Result<()> {
        let folder = bench.path("sizes");
        files::make_folder(&folder)?;
        let mut jobs = Vec::new();
        for picture in pictures {
            for (show, rates) in ALL {
                for rate in rates {
                    let ways = show.ways();
                    if ways.iter().any(|way| self.known(way, show, rate, picture).is_none()) {
                        jobs.push((picture, show, rate));
                    }
                }
            }
        }
        let (workers, _) = bench.workers()?;
        let work = |worker: &mut Worker,
                    &(picture, show, rate): &(&TestPicture, Show, f64),
                    emit: &mut dyn FnMut((String, Vec<Shown>, String, String))| {
            let name = format!("{}-{}-{rate}.png", picture.name, show.key().replace('/', "-"));
            let path = folder.join(name);
            let stored = match show {
                Show::Enlarged(factor) => {
                    let size = [picture.width / factor, picture.height / factor];
                    Filter::Area.resized(&image_of(picture), size)
                }
                Show::Reduced(_) => image_of(picture),
            };
            let stored = with_file(picture, &stored, path)?;
            let context = || format!("{}, {}, {rate}", picture.name, show.key());
            let shown = show_all(worker, picture, &stored, show, rate).with_context(context)?;
            fs::remove_file(&stored.path)?;
            emit((picture.name.clone(), shown, show.key(), rate.to_string()));
            Ok(())
        };
        let (store, version) = (&mut self.store, &self.version);
        parallel::for_each(workers, &jobs, work, |(name, shown, size, rate)| {
            for (way, values) in shown {
                store.get(version, [&way, &size, &rate, &name], || Ok(values))?;
            }
            Ok(())
        })?;
        fs::remove_dir_all(folder)?;
        Ok(())
    }

    fn known(&self, way: &str, show: Show, rate: f64, picture: &TestPicture) -> Option<[f64; 7]> {
        let key = [way, &show.key(), &rate.to_string(), &picture.name];
        self.store.known(&self.version, key)
    }

    /// For each way the files of all pictures.
    fn files(&self, show: Show, rate: f64, pictures: &[TestPicture]) -> Result<Vec<Way>> {
        let ways = show.ways().into_iter();
        ways.map(|name| {
            let files = pictures.iter().map(|picture| {
                self.known(&name, show, rate, picture).context("it was measured above")
            });
            Ok(Way { files: files.collect::<Result<_>>()?, name })
        })
        .collect()
    }
}

/// A way to show, with the values of the files of all pictures.
struct Way {
    name: String,
    files: Vec<[f64; 7]>,
}

impl Way {
    fn distortions(&self) -> impl Iterator<Item = Distortion> {
        self.files.iter().map(|[_, _, distortion @ ..]| Distortion::from(*distortion))
    }

    fn level(&self, metric: Metric) -> f64 {
        let levels = self.distortions().map(|distortion| metric.level(&distortion));
        metric.mean(levels).unwrap_or(f64::NAN)
    }

    /// In how many pictures it is better than another.
    fn better(&self, other: &Self, metric: Metric) -> usize {
        let pairs = self.distortions().zip(other.distortions());
        pairs.filter(|(ours, theirs)| metric.level(ours) > metric.level(theirs)).count()
    }
}

/// Means of one size and rate, who is better, and what rendering is worth.
fn table(ways: &[Way], show: Show, rate: f64) -> String {
    let mut columns = vec![format!("{}, {rate} bpp", show.title()), "bytes".to_owned()];
    columns.extend(Metric::ALL.map(|metric| metric.with_unit().to_owned()));
    let mut table = Table::new(&columns);
    let mut compared: Vec<NamedFigures> = Vec::new();
    for way in ways {
        let levels = Metric::ALL.map(|metric| way.level(metric));
        let bytes = mean(way.files.iter().map(|[bytes, ..]| *bytes)).unwrap_or(f64::NAN);
        let mut cells = vec![way.name.clone(), format!("{bytes:.0}")];
        cells.extend(Metric::ALL.iter().zip(levels).map(|(metric, level)| metric.cell(level)));
        table.row(&cells);
        compared.push((way.name.clone(), levels.to_vec()));
    }
    let figures = Metric::ALL.map(|metric| (metric.name(), Better::Higher));
    format!(
        "{}{}{}",
        table.finish(),
        better_than(&figures, &compared[0], &compared[1..]),
        worth(ways)
    )
}

/// What it is worth to render at the size in place of resizing what is decoded, and against AVIF.
fn worth(ways: &[Way]) -> String {
    let (rendered, all) = (&ways[0], ways[0].files.len());
    let against = |other: &Way| {
        let each = Metric::ALL.into_iter().filter_map(|metric| {
            let by = metric.shown(rendered.level(metric)) - metric.shown(other.level(metric));
            let better = rendered.better(other, metric);
            // Not every metric is defined for the smallest pictures.
            by.is_finite().then(|| format!("{by:+.3} in {} ({better}/{all})", metric.name()))
        });
        format!("against {}: {}", other.name, each.collect::<Vec<_>>().join(", "))
    };
    // Ours with the better of both filters is the second or the third; the first of the others follows.
    format!(
        "\nRendering at the size, and in how many pictures it is better, {}; {}.\n",
        against(&ways[1]),
        against(&ways[3])
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: u32, height: u32) -> TestPicture {
        let rgb = (0..width * height).flat_map(|i| [(i % width) as u8, (i / width) as u8, 9]);
        TestPicture { name: String::new(), path: "".into(), width, height, rgb: rgb.collect() }
    }

    #[test]
    fn sides_become_multiples() {
        let cut = cut(&picture(37, 24));
        assert_eq!((cut.width, cut.height, cut.rgb.len()), (32, 24, 3 * 32 * 24));
    }

    #[test]
    fn every_filter_keeps_a_ramp() {
        let ramp = image_of(&picture(64, 64));
        for filter in [Filter::Area, Filter::Lanczos, Filter::Bicubic] {
            let small = filter.resized(&ramp, [16, 16]);
            // The middle of the ninth square of four pixels.
            let red = small.get_pixel(8, 8).0[0];
            assert!(red.abs_diff(33) <= 1, "{filter:?}: {red}");
        }
    }

    #[test]
    fn what_rendering_is_worth_is_told_against_ours_resized_and_the_first_rival() {
        let way = |name: &str, ssimulacra2: f64| Way {
            name: name.into(),
            files: vec![[10.0, 1.0, 30.0, 0.9, ssimulacra2, 1.0, 8.0]; 2],
        };
        let ways = [way("r", 60.0), way("g", 58.0), way("h", 57.0), way("a", 61.5)];
        let text = worth(&ways);
        assert!(text.contains("against g: +2.000 in SSIMULACRA2 (2/2)"), "{text}");
        assert!(text.contains("against a: -1.500 in SSIMULACRA2 (0/2)"), "{text}");
    }

    #[test]
    fn ways_are_as_many_as_files() {
        assert_eq!(Show::Enlarged(2).ways().len(), 8);
        let reduced = Show::Reduced(8).ways();
        assert_eq!(reduced[..3], [RENDERED, "gip, area", "gip, Lanczos"]);
        assert_eq!(reduced[3], "AVIF, area");
    }
}
