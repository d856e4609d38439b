//! Measurements on disk: one CSV per kind. Each measurement is appended as it is made, and is not
//! made again. [`tidy`] brings the files of a folder into the order in which they are committed.

use std::collections::{HashMap, HashSet};
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

use crate::files::{self, whole_lines};
use crate::number::rounded;
use crate::origins::{self, Origins};
use crate::parallel;

/// Whose measurements are made: they are valid for one machine and one version of what is measured.
/// Rows of others stay in the files but are not used.
#[derive(Clone, Debug)]
pub(crate) struct Source {
    pub(crate) machine: String,
    /// The commit that is checked out.
    pub(crate) commit: String,
}

/// Measurements of one kind: `K` columns say what was measured, `V` columns what came out.
#[derive(Debug)]
pub(crate) struct Store<const K: usize, const V: usize> {
    file: File,
    rows: HashMap<Vec<String>, [f64; V]>,
    source: Source,
    origins: Origins,
    /// Versions of which this has used or made measurements.
    noted: HashSet<String>,
}

impl<const K: usize, const V: usize> Store<K, V> {
    /// Reads what is there already. A last row that was cut short by an interruption is dropped.
    pub(crate) fn open(
        path: &Path,
        source: &Source,
        keys: [&str; K],
        values: [&str; V],
    ) -> Result<Self> {
        let unreadable = || format!("cannot read {}", path.display());
        let options =
            OpenOptions::new().read(true).append(true).create(true).truncate(false).open(path);
        let mut file = options.with_context(unreadable)?;
        let mut text = files::read(path)?;
        text.truncate(whole_lines(&text));
        file.set_len(text.len() as u64).with_context(unreadable)?;

        let header = [&[origins::COLUMN], keys.as_slice(), &values].concat();
        if text.is_empty() {
            file.write_all(&record(&header)?)?;
        }
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        ensure!(
            text.is_empty() || reader.headers().with_context(unreadable)? == header,
            "{} has other columns than this program writes: move it away",
            path.display()
        );
        let mut rows = HashMap::new();
        for row in reader.records() {
            let row = row.with_context(unreadable)?;
            let fields: Vec<&str> = row.iter().collect();
            let (key, numbers) = fields.split_at(1 + K);
            let mut values = [0.0_f64; V];
            for (value, number) in values.iter_mut().zip(numbers) {
                *value = number
                    .parse()
                    .with_context(|| format!("{}: `{number}` is not a number", path.display()))?;
            }
            let key: Vec<String> = key.iter().map(|&field| field.to_owned()).collect();
            let other = rows
                .insert(key, values)
                .filter(|other| other.iter().zip(&values).any(|(a, b)| a.to_bits() != b.to_bits()));
            ensure!(
                other.is_none(),
                "{} has two measurements of {}: remove one",
                path.display(),
                fields[1..=K].join(", ")
            );
        }
        let origins = Origins::of(path.parent().unwrap_or(Path::new("")));
        Ok(Self { file, rows, source: source.clone(), origins, noted: HashSet::new() })
    }

    /// The measurement under a key, if it was made.
    pub(crate) fn known(&self, version: &str, key: [&str; K]) -> Option<[f64; V]> {
        self.rows.get(&self.row(version, key)).copied()
    }

    /// The columns before the values.
    fn row(&self, version: &str, key: [&str; K]) -> Vec<String> {
        let origin = origins::key(&self.source.machine, version);
        [origin].into_iter().chain(key.map(str::to_owned)).collect()
    }

    /// The measurement under a key: from the file, or else made now and appended to it. It has the digits
    /// that the file has, whether it was just made or not.
    pub(crate) fn get(
        &mut self,
        version: &str,
        key: [&str; K],
        measure: impl FnOnce() -> Result<[f64; V]>,
    ) -> Result<[f64; V]> {
        self.note(version)?;
        if let Some(values) = self.known(version, key) {
            return Ok(values);
        }
        let key = self.row(version, key);
        eprintln!("{}", key[1..].join("  "));
        let values = measure().with_context(|| key[1..].join(", "))?.map(rounded);
        let numbers = values.map(|value| value.to_string());
        // One call, so that an interruption leaves at most one torn row.
        self.file.write_all(&record(key.iter().chain(&numbers))?)?;
        self.rows.insert(key, values);
        Ok(values)
    }

    /// Says where measurements of a version come from, should the table of origins not have it.
    pub(crate) fn note(&mut self, version: &str) -> Result<()> {
        if self.noted.insert(version.to_owned()) {
            let Source { machine, commit } = &self.source;
            self.origins.note(machine, version, commit)?;
        }
        Ok(())
    }

    /// The measurements of some jobs, in their order, each under its key. Those that are missing are made on all
    /// cores at once, with one thread for each worker.
    pub(crate) fn all<'j, W: Send, J: Sync>(
        &mut self,
        version: &str,
        workers: &mut [W],
        jobs: &'j [([&'j str; K], J)],
        measure: impl Fn(&mut W, &J) -> Result<[f64; V]> + Sync,
    ) -> Result<Vec<[f64; V]>> {
        self.note(version)?;
        let missing = jobs.iter().filter(|(key, _)| self.known(version, *key).is_none());
        let missing: Vec<_> = missing.collect();
        let work = |worker: &mut W,
                    (key, job): &&'j ([&'j str; K], J),
                    emit: &mut dyn FnMut(([&'j str; K], [f64; V]))| {
            emit((*key, measure(worker, job).with_context(|| key.join(", "))?));
            Ok(())
        };
        parallel::for_each(workers, &missing, work, |(key, values)| {
            self.get(version, key, || Ok(values)).map(|_| ())
        })?;
        let made = jobs.iter().map(|(key, _)| self.known(version, *key));
        made.map(|values| values.context("it was measured above")).collect()
    }
}

/// Sorts the rows of all stores of a folder, so that the same measurements are the same bytes in whatever
/// order they were made, and leaves one of equal rows. No store of the folder may be open.
pub(crate) fn tidy(folder: &Path) -> Result<()> {
    for table in tables(folder)? {
        table.keep(|_| true)?;
    }
    Ok(())
}

/// Removes what is of versions that a filter lets pass, and does what [`tidy`] does. Rows of an origin that the
/// folder does not explain stay. Returns how many rows of each table were removed.
pub(crate) fn remove(folder: &Path, pass: impl Fn(&str) -> bool) -> Result<Vec<(String, usize)>> {
    let removed: HashSet<String> = Origins::of(folder).keys(pass)?.into_iter().collect();
    let counts = tables(folder)?.into_iter().map(|table| {
        let count = table.keep(|origin| !removed.contains(origin))?;
        Ok((table.name(), count))
    });
    counts.collect()
}

/// What is wrong with the stores of a folder, as they are committed: no faults after [`tidy`] of a run's.
pub(crate) fn faults(folder: &Path) -> Result<Vec<String>> {
    let origins: HashSet<String> = Origins::of(folder).keys(|_| true)?.into_iter().collect();
    let mut faults = Vec::new();
    for table in tables(folder)? {
        let name = table.name();
        let mut fault = |what: &str| faults.push(format!("{name} {what}"));
        if table.rows.is_empty() {
            fault("is empty");
        }
        if table.rows.iter().any(|row| !origins.contains(&row[0])) {
            fault("has rows of an unknown origin");
        }
        if !table.rows.is_sorted_by(|a, b| a < b) {
            fault("is not sorted, or has a row twice");
        }
    }
    Ok(faults)
}

/// A store as it lies in its folder.
struct Stored {
    path: PathBuf,
    text: String,
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Stored {
    /// The store of a file; `None` of a table that is none.
    fn read(path: PathBuf) -> Result<Option<Self>> {
        let text = files::read(&path)?;
        let mut reader = csv::Reader::from_reader(&text.as_bytes()[..whole_lines(&text)]);
        let fields = |row: &csv::StringRecord| row.iter().map(str::to_owned).collect::<Vec<_>>();
        // What is no table is none of ours.
        let Ok(header) = reader.headers().map(fields) else { return Ok(None) };
        if header.first().is_none_or(|column| column != origins::COLUMN) {
            return Ok(None);
        }
        let rows = reader.records().map(|row| row.map(|row| fields(&row)));
        let rows = rows.collect::<Result<_, _>>();
        let rows = rows.with_context(|| format!("cannot read {}", path.display()))?;
        Ok(Some(Self { path, text, header, rows }))
    }

    fn name(&self) -> String {
        self.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// Writes it with the rows of those origins that a filter lets pass, sorted. Returns how many it has less.
    fn keep(&self, pass: impl Fn(&str) -> bool) -> Result<usize> {
        let mut rows: Vec<&Vec<String>> = self.rows.iter().filter(|row| pass(&row[0])).collect();
        rows.sort_unstable();
        rows.dedup();
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(&self.header)?;
        rows.iter().try_for_each(|row| writer.write_record(*row))?;
        let sorted = writer.into_inner()?;
        if sorted != self.text.as_bytes() {
            files::replace(&self.path, &sorted)?;
        }
        Ok(self.rows.len() - rows.len())
    }
}

/// The stores of a folder, by name.
fn tables(folder: &Path) -> Result<Vec<Stored>> {
    let unreadable = || format!("cannot read the folder {}", folder.display());
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder).with_context(unreadable)? {
        let path = entry.with_context(unreadable)?.path();
        if path.extension().is_some_and(|extension| extension == "csv") {
            paths.push(path);
        }
    }
    paths.sort();
    let stores = paths.into_iter().map(Stored::read).collect::<Result<Vec<_>>>()?;
    Ok(stores.into_iter().flatten().collect())
}

fn record<T: AsRef<[u8]>>(fields: impl IntoIterator<Item = T>) -> Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(fields)?;
    Ok(writer.into_inner()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(path: &Path, machine: &str) -> Store<2, 2> {
        let source = Source { machine: machine.into(), commit: "abc".into() };
        Store::open(path, &source, ["codec", "image"], ["bytes", "psnr"]).expect("it opens")
    }

    fn get(store: &mut Store<2, 2>, version: &str, image: &str, value: f64) -> [f64; 2] {
        store.get(version, ["gip", image], || Ok([value, f64::INFINITY])).expect("it measures")
    }

    #[test]
    fn nothing_is_measured_twice() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("rate.csv");
        let machine = "A \"quick\" one, 2 cores";
        assert_eq!(get(&mut open(&path, machine), "1", "a", 0.1), [0.1, f64::INFINITY]);
        let mut again = open(&path, machine);
        assert_eq!(again.known("1", ["gip", "a"]), Some([0.1, f64::INFINITY]));
        assert_eq!(again.known("1", ["gip", "b"]), None);
        assert_eq!(get(&mut again, "1", "a", 9.0), [0.1, f64::INFINITY]);
        assert_eq!(get(&mut again, "1", "b", 9.0), [9.0, f64::INFINITY]);
        assert_eq!(fs::read_to_string(&path).expect("text").lines().count(), 3);
    }

    #[test]
    fn what_is_missing_is_measured_on_all_cores() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("rate.csv");
        get(&mut open(&path, "here"), "1", "b", 2.0);
        let all = |store: &mut Store<2, 2>| {
            let jobs =
                [("a", 1.0), ("b", 9.0), ("c", 3.0)].map(|(image, value)| (["gip", image], value));
            let measure = |(): &mut (), value: &f64| {
                anyhow::ensure!(*value < 9.0, "it is known");
                Ok([*value, f64::INFINITY])
            };
            let rows = store.all("1", &mut [(), ()], &jobs, measure).expect("it measures");
            rows.iter().map(|row| row[0]).collect::<Vec<_>>()
        };
        assert_eq!(all(&mut open(&path, "here")), [1.0, 2.0, 3.0]);
        assert_eq!(get(&mut open(&path, "here"), "1", "c", 9.0)[0], 3.0);
        let refused = open(&path, "here")
            .all("1", &mut [()], &[(["gip", "d"], ())], |_, ()| anyhow::bail!("no such codec"));
        assert_eq!(format!("{:#}", refused.expect_err("it fails")), "gip, d: no such codec");
    }

    #[test]
    fn a_measurement_has_the_digits_of_its_row_at_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("rate.csv");
        let first = get(&mut open(&path, "here"), "1", "a", 1.0 / 7.0);
        assert_eq!(first[0], 0.142_857_1);
        assert_eq!(get(&mut open(&path, "here"), "1", "a", 9.0), first);
    }

    #[test]
    fn other_versions_and_machines_are_measured_anew() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("rate.csv");
        get(&mut open(&path, "here"), "1", "a", 1.0);
        assert_eq!(get(&mut open(&path, "here"), "2", "a", 2.0)[0], 2.0);
        assert_eq!(get(&mut open(&path, "there"), "1", "a", 3.0)[0], 3.0);
        assert_eq!(get(&mut open(&path, "here"), "1", "a", 4.0)[0], 1.0);
    }

    #[test]
    fn a_torn_row_is_measured_anew() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("rate.csv");
        get(&mut open(&path, "here"), "1", "a", 1.0);
        let whole = fs::read_to_string(&path).expect("text");
        get(&mut open(&path, "here"), "1", "b", 2.5);
        let torn = fs::read_to_string(&path).expect("text");
        fs::write(&path, &torn[..torn.len() - 3]).expect("it writes");
        let mut store = open(&path, "here");
        assert_eq!(fs::read_to_string(&path).expect("text"), whole);
        assert_eq!(get(&mut store, "1", "a", 9.0)[0], 1.0);
        assert_eq!(get(&mut store, "1", "b", 3.5)[0], 3.5);
    }

    #[test]
    fn a_failed_measurement_leaves_no_row() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("rate.csv");
        let mut store = open(&path, "here");
        let failure = store.get("1", ["gip", "a"], || anyhow::bail!("no such codec"));
        assert_eq!(format!("{:#}", failure.expect_err("it fails")), "gip, a: no such codec");
        assert_eq!(get(&mut store, "1", "a", 5.0)[0], 5.0);
    }

    #[test]
    fn other_columns_are_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("rate.csv");
        drop(open(&path, "here"));
        let source = Source { machine: "here".into(), commit: "abc".into() };
        assert!(Store::<1, 1>::open(&path, &source, ["codec"], ["bytes"]).is_err());
    }

    /// The files of a folder after some measurements, made in this order, and [`tidy`].
    fn tidied(measurements: &[(&str, &str, f64)]) -> Vec<String> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("rate.csv");
        for (machine, image, value) in measurements {
            get(&mut open(&path, machine), "1", image, *value);
        }
        fs::write(folder.path().join("other.csv"), "b,a\n2,1\n1,2\n").expect("it is written");
        tidy(folder.path()).expect("all are tables");
        assert_eq!(get(&mut open(&path, "here"), "1", "a", 9.0)[0], 0.5, "it is kept");
        let names = ["rate.csv", "origins.csv", "other.csv"].into_iter();
        let read = |name| fs::read_to_string(folder.path().join(name)).expect("text");
        names.map(read).collect()
    }

    #[test]
    fn the_same_measurements_are_the_same_bytes() {
        let measurements = [("there", "b", 1.5), ("here", "c", 3.0), ("here", "a", 0.5)];
        let files = tidied(&measurements);
        let backwards: Vec<_> = measurements.into_iter().rev().collect();
        assert_eq!(files, tidied(&backwards));
        assert_eq!(files[0].lines().count(), 4);
        assert_eq!(files[2], "b,a\n2,1\n1,2\n", "what is no store stays as it is");
    }

    #[test]
    fn a_lost_table_of_origins_loses_no_measurements() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("rate.csv");
        get(&mut open(&path, "here"), "1", "a", 0.5);
        let faults = || faults(folder.path()).expect("all are tables");
        assert_eq!(faults(), [""; 0]);
        let origins = folder.path().join("origins.csv");
        for torn in ["", "orig", "origin,machine,version,commit\n1234,he"] {
            fs::write(&origins, torn).expect("it is written");
            remove(folder.path(), |_| true).expect("all are tables");
            assert!(faults().contains(&"rate.csv has rows of an unknown origin".to_owned()));
            assert_eq!(get(&mut open(&path, "here"), "1", "a", 9.0)[0], 0.5);
            assert_eq!(faults(), [""; 0], "{torn}");
        }
    }

    #[test]
    fn rows_that_are_there_twice_are_found() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("rate.csv");
        get(&mut open(&path, "here"), "1", "a", 0.5);
        let text = fs::read_to_string(&path).expect("text");
        let row = text.lines().nth(1).expect("it has one");
        fs::write(&path, format!("{text}{row}\n")).expect("it is written");
        let faults = || faults(folder.path()).expect("all are tables");
        assert_eq!(faults(), ["rate.csv is not sorted, or has a row twice"]);
        assert_eq!(get(&mut open(&path, "here"), "1", "a", 9.0)[0], 0.5);
        tidy(folder.path()).expect("all are tables");
        assert_eq!(faults(), [""; 0]);
        fs::write(&path, format!("{text}{}\n", row.replace("0.5", "0.6"))).expect("it is written");
        let source = Source { machine: "here".into(), commit: "abc".into() };
        let other = Store::<2, 2>::open(&path, &source, ["codec", "image"], ["bytes", "psnr"]);
        let refusal = other.expect_err("which one holds?").to_string();
        assert!(refusal.contains("two measurements of gip, a"), "{refusal}");
    }

    #[test]
    fn what_is_of_other_versions_can_be_removed() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("rate.csv");
        get(&mut open(&path, "here"), "old", "a", 1.0);
        get(&mut open(&path, "here"), "new", "a", 2.0);
        let removed = remove(folder.path(), |version| version == "old").expect("all are tables");
        assert_eq!(removed, [("origins.csv".to_owned(), 1), ("rate.csv".to_owned(), 1)]);
        assert_eq!(fs::read_to_string(&path).expect("text").lines().count(), 2);
        assert_eq!(get(&mut open(&path, "here"), "new", "a", 9.0)[0], 2.0);
        assert_eq!(get(&mut open(&path, "here"), "old", "a", 9.0)[0], 9.0);
    }
}
