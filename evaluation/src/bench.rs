//! What all sections share: pictures, stores, baselines, and the report's folder.

use std::cell::RefCell;
use std::collections::HashMap;
use std::fs;
use std::mem;
use std::path::PathBuf;

use anyhow::{Result, ensure};

use crate::baselines::Worker;
use crate::contents::Contents;
use crate::figures::Figures;
use crate::files;
use crate::manifest::{Manifest, NAME};
use crate::origins::Origins;
use crate::pictures::{self, PictureSet, TestPicture};
use crate::report;
use crate::store::{Source, Store};
use crate::{gip, provenance};

/// Packages of Rust that make figures of the report: metrics, and placeholders.
const PACKAGES: [&str; 5] = ["blurhash", "butteraugli", "colorvideovdp", "fast-ssim2", "thumbhash"];
/// How many pictures a quick run takes.
const QUICK_PICTURES: usize = 2;
const QUICK_LARGE_PICTURES: usize = 1;
/// How many large pictures are for what takes long.
const FEW_LARGE_PICTURES: usize = 2;
/// Iterations of the published methods.
const ITERATIONS: u32 = 2_000;
const QUICK_ITERATIONS: u32 = 300;

/// Where the pictures are.
#[derive(Debug, clap::Args)]
pub(crate) struct Folders {
    /// Folder with the Kodak pictures, as .png.
    #[arg(long, value_name = "DIR", alias = "images")]
    kodak: PathBuf,
    /// Folder with a second set of photographs, as .png, for the sections about quality.
    #[arg(long, value_name = "DIR")]
    photos: Option<PathBuf>,
    /// Folder with pictures of 2,048 pixels, as .png, for `rate`, `losses` and `speed`; two of them for
    /// `training`, and for `representation` at the paper's 10,000 and 50,000 Gaussians.
    #[arg(long, value_name = "DIR")]
    large: Option<PathBuf>,
    /// Folder with screenshots, as .png, for `rate`, `losses`, `sizes` and `monotony`.
    #[arg(long, value_name = "DIR")]
    screens: Option<PathBuf>,
    /// CSV with the columns picture and content, for means by class of content in `texture`.
    #[arg(long, value_name = "CSV")]
    content: Option<PathBuf>,
}

/// The pictures and settings of a run, and where its measurements are kept.
#[derive(Debug)]
pub(crate) struct Bench {
    /// What all sections are about, Kodak's in the committed report.
    pub(crate) pictures: Vec<TestPicture>,
    /// A second set, for the sections about quality: no constant was chosen to suit Kodak alone.
    photos: Vec<TestPicture>,
    /// For the paper's fits at 2K.
    pub(crate) large: Vec<TestPicture>,
    pub(crate) screens: Vec<TestPicture>,
    /// What the pictures show, as far as it is known.
    pub(crate) contents: Contents,
    pub(crate) quick: bool,
    /// Of the published methods.
    pub(crate) iterations: u32,
    /// Whether the published methods run for the paper's iterations as well.
    pub(crate) is_long: bool,
    /// CSV with measurements of the baselines from elsewhere.
    pub(crate) reference: Option<PathBuf>,
    /// Where to write the README's picture.
    pub(crate) readme_picture: Option<PathBuf>,
    /// The version of our codec.
    pub(crate) product: String,
    source: Source,
    folder: PathBuf,
    /// One for each core, once any is needed.
    workers: Vec<Worker>,
    /// Whether the section that is being measured needs them.
    uses_baselines: bool,
    manifest: Manifest,
    /// Names of pictures that the manifest does not list.
    unlisted: Vec<String>,
    /// Of the section that is being measured.
    figures: RefCell<Figures>,
}

impl Bench {
    pub(crate) fn new(
        folders: &Folders,
        folder: PathBuf,
        quick: bool,
        is_long: bool,
        reference: Option<PathBuf>,
    ) -> Result<Self> {
        let load = |folder: &PathBuf, few| pictures::load(folder, quick.then_some(few));
        let others = |folder: &Option<PathBuf>, few| {
            folder.as_ref().map_or(Ok(Vec::new()), |folder| load(folder, few))
        };
        let mut bench = Self {
            pictures: load(&folders.kodak, QUICK_PICTURES)?,
            photos: others(&folders.photos, QUICK_PICTURES)?,
            large: others(&folders.large, QUICK_LARGE_PICTURES)?,
            screens: others(&folders.screens, QUICK_LARGE_PICTURES)?,
            contents: folders.content.as_deref().map_or(Ok(Contents::default()), Contents::load)?,
            quick,
            iterations: if quick { QUICK_ITERATIONS } else { ITERATIONS },
            is_long,
            reference,
            readme_picture: None,
            product: provenance::product()?,
            source: Source { machine: provenance::machine(), commit: provenance::commit() },
            folder,
            workers: Vec::new(),
            uses_baselines: false,
            manifest: Manifest::load()?,
            unlisted: Vec::new(),
            figures: RefCell::default(),
        };
        bench.check_pictures()?;
        Ok(bench)
    }

    /// Makes sure that pictures are those of the manifest, and of others that the folder has no measurements
    /// of another picture with the same name.
    fn check_pictures(&mut self) -> Result<()> {
        let mut unlisted = Vec::new();
        let mut sets = HashMap::new();
        for (set, pictures) in self.folders() {
            for picture in pictures {
                let other = sets.insert(&picture.name, set);
                ensure!(
                    other.is_none(),
                    "{} is in {set} and in {}: a picture can be in one set alone",
                    picture.name,
                    other.unwrap_or_default()
                );
                if !self.manifest.has(picture)? {
                    unlisted.push(picture);
                }
            }
        }
        if unlisted.is_empty() {
            return Ok(());
        }
        let mut store = self.store("images.csv", ["image"], ["width", "height", "crc32"])?;
        for picture in &unlisted {
            let crc = f64::from(crc32fast::hash(&picture.rgb));
            let known = [picture.width.into(), picture.height.into(), crc];
            ensure!(
                store.get("all", [&picture.name], || Ok(known))? == known,
                "{} has measurements of another picture called {}: choose another folder",
                self.folder.display(),
                picture.name
            );
        }
        self.unlisted = unlisted.into_iter().map(|picture| picture.name.clone()).collect();
        Ok(())
    }

    /// The pictures of each folder, by the manifest's names of the sets.
    fn folders(&self) -> [(&'static str, &[TestPicture]); 4] {
        [
            ("kodak", &self.pictures),
            ("photos", &self.photos),
            ("large", &self.large),
            ("screens", &self.screens),
        ]
    }

    /// All sets of pictures, those of [`Self::sets`] first.
    pub(crate) fn all_sets(&self) -> Vec<PictureSet> {
        let others = [("large", &self.large), ("screens", &self.screens)];
        let others = others.into_iter().filter(|(_, pictures)| !pictures.is_empty());
        let others = others.map(|(name, pictures)| PictureSet { name, pictures: pictures.clone() });
        self.sets().into_iter().chain(others).collect()
    }

    /// The sets of pictures for most sections, the first of which is [`Self::pictures`].
    pub(crate) fn sets(&self) -> Vec<PictureSet> {
        let mut sets = vec![PictureSet { name: "Kodak", pictures: self.pictures.clone() }];
        if !self.photos.is_empty() {
            sets.push(PictureSet { name: "photos", pictures: self.photos.clone() });
        }
        sets
    }

    /// At most so many of the pictures, evenly spread.
    pub(crate) fn sample(&self, at_most: usize) -> Vec<TestPicture> {
        spread(&self.pictures, at_most)
    }

    /// The large pictures for what takes long: each takes as long as seven of Kodak's.
    pub(crate) fn large_sample(&self) -> Vec<TestPicture> {
        spread(&self.large, FEW_LARGE_PICTURES)
    }

    /// How many pictures a table is about, in words.
    pub(crate) fn pictures_used(&self, taken: usize) -> String {
        format!("pictures: {taken} of {}", self.pictures.len())
    }

    /// The path of a file of the report.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// The store of one kind of measurements, in a CSV of this name.
    pub(crate) fn store<const K: usize, const V: usize>(
        &self,
        name: &str,
        keys: [&str; K],
        values: [&str; V],
    ) -> Result<Store<K, V>> {
        Store::open(&self.path(name), &self.source, keys, values)
    }

    /// Files of this version of our codec that take long to make.
    pub(crate) fn kept_files(&self) -> KeptFiles {
        KeptFiles(self.path("files").join(&self.product))
    }

    /// The baselines, with their versions in one line.
    pub(crate) fn baselines(&mut self) -> Result<(&mut Worker, String)> {
        let (workers, versions) = self.workers()?;
        Ok((&mut workers[0], versions))
    }

    /// The same, one for each core: for what is measured without times.
    pub(crate) fn workers(&mut self) -> Result<(&mut [Worker], String)> {
        self.uses_baselines = true;
        if self.workers.is_empty() {
            let all = (0..provenance::cores()).map(|index| Worker::start(&self.folder, index));
            self.workers = all.collect::<Result<_>>()?;
        }
        let versions = self.workers[0].versions.join(", ");
        Ok((&mut self.workers, versions))
    }

    /// Begins a section.
    pub(crate) fn begin(&mut self) {
        self.uses_baselines = false;
        self.figures.take();
    }

    /// Stops the baselines, one of which may have failed; they start again when they are needed.
    pub(crate) fn stop_baselines(&mut self) {
        self.workers.clear();
    }

    /// Names a figure of the section that is being measured, for texts that cite it: in `figures.csv` it has
    /// the section's name and a slash before its own.
    pub(crate) fn figure(&self, name: impl Into<String>, value: f64, unit: &str) {
        self.figures.borrow_mut().add(name.into(), value, unit);
    }

    /// The figures that sections have written.
    pub(crate) fn written_figures(&self) -> Result<Figures> {
        Figures::load(&self.folder)
    }

    /// Writes the figures that were named, in place of all that the section had.
    pub(crate) fn write_figures(&self, section: &str) -> Result<()> {
        mem::take(&mut *self.figures.borrow_mut()).update(&self.folder, section)
    }

    /// Where the measurements come from: the list at the head of every section.
    pub(crate) fn provenance(&self) -> Result<String> {
        // All sections of a version name the same commit, whatever else was committed between them.
        let first = Origins::of(&self.folder).commit(&self.product)?;
        let mut list = format!(
            "- Machine: {}\n- Codec: commit {}, {}, {}\n- Seed: {}\n",
            self.source.machine,
            first.as_ref().unwrap_or(&self.source.commit),
            self.product,
            provenance::compiler(),
            gip::SEED,
        );
        let sets = self.folders().into_iter().filter(|(_, pictures)| !pictures.is_empty());
        let counts = sets.map(|(set, pictures)| {
            let others = pictures.iter().filter(|picture| self.unlisted.contains(&picture.name));
            let others = others.count();
            let listed = pictures.len() - others;
            let others = if others > 0 { format!(" and {others} others") } else { String::new() };
            format!("{set} {listed} of {}{others}", self.manifest.count(set))
        });
        list.push_str(&format!(
            "- Pictures, of which some tables take fewer and say so: {} ([{NAME}](../{NAME}))\n",
            counts.collect::<Vec<_>>().join(", ")
        ));
        if !self.unlisted.is_empty() {
            list.push_str(&format!(
                "- Pictures that are not listed: {}\n",
                self.unlisted.join(", ")
            ));
        }
        list.push_str(&format!("- Packages: {}\n", provenance::packages(&PACKAGES)?.join(", ")));
        if let Some(worker) = self.workers.first().filter(|_| self.uses_baselines) {
            list.push_str(&format!("- Baselines: {}\n", worker.versions.join(", ")));
        }
        if self.quick {
            list.push_str(report::QUICK);
        }
        Ok(list)
    }
}

/// A folder of files that take long to make.
#[derive(Clone, Debug)]
pub(crate) struct KeptFiles(PathBuf);

impl KeptFiles {
    /// Where a file is kept.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// A file: what is kept, or else made now.
    pub(crate) fn get(
        &self,
        name: &str,
        make: impl FnOnce() -> Result<Vec<u8>>,
    ) -> Result<Vec<u8>> {
        let path = self.path(name);
        if let Ok(bytes) = fs::read(&path) {
            return Ok(bytes);
        }
        eprintln!("{name}");
        let bytes = make()?;
        files::make_folder(&self.0)?;
        files::replace(&path, &bytes)?;
        Ok(bytes)
    }
}

/// At most so many pictures, evenly spread.
fn spread(pictures: &[TestPicture], at_most: usize) -> Vec<TestPicture> {
    let (all, count) = (pictures.len(), at_most.min(pictures.len()));
    (0..count).map(|index| pictures[index * all / count].clone()).collect()
}

/// The version of measured times of baselines. It includes the version of our codec, so that they
/// are measured again whenever ours are: times compare only if the machine is in the same state.
pub(crate) fn timing_version(product: &str, versions: &str) -> String {
    format!("{versions}, beside {product}")
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn open(images: &Path, report: &Path) -> Result<Bench> {
        let folders = Folders {
            kodak: images.into(),
            photos: None,
            large: None,
            screens: None,
            content: None,
        };
        Bench::new(&folders, report.into(), false, false, None)
    }

    #[test]
    fn files_are_made_once() {
        let (images, report) = (tempfile::tempdir(), tempfile::tempdir());
        let (images, report) = (images.expect("a folder"), report.expect("a folder"));
        image::RgbImage::new(3, 2).save(images.path().join("a.png")).expect("it is written");
        let bench = open(images.path(), report.path()).expect("there is a picture");
        let files = bench.kept_files();
        assert!(files.get("a.gip", || anyhow::bail!("it cannot be made")).is_err());
        assert_eq!(files.get("a.gip", || Ok(vec![1, 2])).expect("it is made"), [1, 2]);
        assert_eq!(files.get("a.gip", || Ok(vec![3])).expect("it is kept"), [1, 2]);
    }

    #[test]
    fn another_picture_of_the_same_name_is_refused() {
        let (images, report) = (tempfile::tempdir(), tempfile::tempdir());
        let (images, report) = (images.expect("a folder"), report.expect("a folder"));
        let open_gray = |gray: u8| {
            let picture = image::RgbImage::from_pixel(3, 2, image::Rgb([gray; 3]));
            picture.save(images.path().join("a.png")).expect("it is written");
            open(images.path(), report.path())
        };
        assert!(open_gray(1).is_ok());
        assert!(open_gray(1).is_ok());
        let refusal = open_gray(2).expect_err("it is another picture").to_string();
        assert!(refusal.contains("another picture called a"), "{refusal}");
    }
    #[test]
    fn pictures_that_are_not_listed_are_named() {
        let (images, report) = (tempfile::tempdir(), tempfile::tempdir());
        let (images, report) = (images.expect("a folder"), report.expect("a folder"));
        image::RgbImage::new(3, 2).save(images.path().join("a.png")).expect("it is written");
        let bench = open(images.path(), report.path()).expect("there is a picture");
        let provenance = bench.provenance().expect("it is known");
        assert!(provenance.contains("- Pictures that are not listed: a\n"), "{provenance}");
        assert!(provenance.contains(&bench.product), "{provenance}");
        image::RgbImage::new(3, 2).save(images.path().join("kodim01.png")).expect("it is written");
        let refusal = open(images.path(), report.path()).expect_err("it is black").to_string();
        assert!(refusal.contains("is not the kodim01 that pictures.csv lists"), "{refusal}");
    }

    #[test]
    fn figures_have_the_name_of_their_section() {
        let (images, report) = (tempfile::tempdir(), tempfile::tempdir());
        let (images, report) = (images.expect("a folder"), report.expect("a folder"));
        image::RgbImage::new(3, 2).save(images.path().join("a.png")).expect("it is written");
        let bench = open(images.path(), report.path()).expect("there is a picture");
        bench.figure("a/b", 0.5, "s");
        bench.write_figures("decode").expect("it is written");
        bench.write_figures("rate").expect("it is written");
        let figures = Figures::load(report.path()).expect("a table");
        assert!(figures.get("decode/a/b").is_some() && figures.get("rate/a/b").is_none());
    }
}
