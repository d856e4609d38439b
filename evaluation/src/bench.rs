//! What all sections share: pictures, stores, baselines, and the report's folder.

use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};

use crate::baselines::Worker;
use crate::pictures::{self, TestPicture};
use crate::store::Store;
use crate::{gip, provenance};

/// How many pictures a quick run takes.
const QUICK_PICTURES: usize = 4;
const QUICK_LARGE_PICTURES: usize = 1;
/// Iterations of the published methods, if no others are asked for.
const ITERATIONS: u32 = 3_000;
const QUICK_ITERATIONS: u32 = 2_000;

/// The pictures and settings of a run, and where its measurements are kept.
#[derive(Debug)]
pub(crate) struct Bench {
    pub(crate) pictures: Vec<TestPicture>,
    /// Of 2,048 pixels; there may be none.
    pub(crate) large: Vec<TestPicture>,
    pub(crate) quick: bool,
    /// Of the published methods.
    pub(crate) iterations: u32,
    /// CSV with measurements of the baselines from elsewhere.
    pub(crate) reference: Option<PathBuf>,
    /// The version of our codec.
    pub(crate) product: String,
    machine: String,
    folder: PathBuf,
    worker: Option<Worker>,
}

impl Bench {
    pub(crate) fn new(
        images: &Path,
        large: Option<&Path>,
        folder: PathBuf,
        quick: bool,
        iterations: Option<u32>,
        reference: Option<PathBuf>,
    ) -> Result<Self> {
        let large = large.map(|large| pictures::load(large, quick.then_some(QUICK_LARGE_PICTURES)));
        let bench = Self {
            pictures: pictures::load(images, quick.then_some(QUICK_PICTURES))?,
            large: large.transpose()?.unwrap_or_default(),
            quick,
            iterations: iterations.unwrap_or(if quick { QUICK_ITERATIONS } else { ITERATIONS }),
            reference,
            product: provenance::product(),
            machine: provenance::machine(),
            folder,
            worker: None,
        };
        bench.check_pictures()?;
        Ok(bench)
    }

    /// Makes sure that the folder has no measurements of another picture with the same name.
    fn check_pictures(&self) -> Result<()> {
        let mut store = self.store("images.csv", ["image"], ["width", "height", "crc32"])?;
        for picture in self.pictures.iter().chain(&self.large) {
            let crc = f64::from(crc32fast::hash(&picture.rgb));
            let known = [picture.width.into(), picture.height.into(), crc];
            ensure!(
                store.get("all", [&picture.name], || Ok(known))? == known,
                "{} has measurements of another picture called {}: choose another folder",
                self.folder.display(),
                picture.name
            );
        }
        Ok(())
    }

    /// At most so many of the pictures, evenly spread.
    pub(crate) fn sample(&self, at_most: usize) -> Vec<TestPicture> {
        let (all, count) = (self.pictures.len(), at_most.min(self.pictures.len()));
        (0..count).map(|index| self.pictures[index * all / count].clone()).collect()
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
        Store::open(&self.path(name), &self.machine, keys, values)
    }

    /// The baselines, with their versions in one line.
    pub(crate) fn baselines(&mut self) -> Result<(&mut Worker, String)> {
        let worker = match self.worker.take() {
            Some(worker) => worker,
            None => Worker::start(&self.folder)?,
        };
        let versions = worker.versions.join(", ");
        Ok((self.worker.insert(worker), versions))
    }

    /// Where the measurements come from: the list at the head of every section.
    pub(crate) fn provenance(&self) -> String {
        let names: Vec<&str> = self.pictures.iter().map(|picture| picture.name.as_str()).collect();
        let mut list = format!(
            "- Machine: {}\n- Codec: commit {} (checked out: {}), {}\n- Seed: {}\n- {} pictures, \
             of which some tables take fewer and say so: {}\n",
            self.machine,
            self.product,
            provenance::commit(),
            provenance::compiler(),
            gip::SEED,
            names.len(),
            names.join(", "),
        );
        if let Some(worker) = &self.worker {
            list.push_str(&format!("- Baselines: {}\n", worker.versions.join(", ")));
        }
        if self.quick {
            list.push_str("- A quick run: few pictures and settings\n");
        }
        list
    }
}

/// The version of measured times of baselines. It includes the version of our codec, so that they
/// are measured again whenever ours are: times compare only if the machine is in the same state.
pub(crate) fn timing_version(product: &str, versions: &str) -> String {
    format!("{versions}, beside {product}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_picture_of_the_same_name_is_refused() {
        let (images, report) = (tempfile::tempdir(), tempfile::tempdir());
        let (images, report) = (images.expect("a folder"), report.expect("a folder"));
        let open = |gray: u8| {
            let picture = image::RgbImage::from_pixel(3, 2, image::Rgb([gray; 3]));
            picture.save(images.path().join("a.png")).expect("it is written");
            Bench::new(images.path(), None, report.path().into(), false, None, None)
        };
        assert!(open(1).is_ok());
        assert!(open(1).is_ok());
        let refusal = open(2).expect_err("it is another picture").to_string();
        assert!(refusal.contains("another picture called a"), "{refusal}");
    }
}
