//! Measurements on disk: one CSV per kind. Each measurement is appended as it is made, and is not
//! made again.

use std::collections::HashMap;
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::Path;

use anyhow::{Context, Result, ensure};

/// The first columns: a measurement is valid for one machine and one version of what was measured.
/// Rows of other machines and versions stay in the file but are not used.
const PROVENANCE: [&str; 2] = ["machine", "version"];

/// Measurements of one kind: `K` columns say what was measured, `V` columns what came out.
#[derive(Debug)]
pub(crate) struct Store<const K: usize, const V: usize> {
    file: File,
    rows: HashMap<Vec<String>, [f64; V]>,
    machine: String,
}

impl<const K: usize, const V: usize> Store<K, V> {
    /// Reads what is there already. A last row that was cut short by an interruption is dropped.
    pub(crate) fn open(
        path: &Path,
        machine: &str,
        keys: [&str; K],
        values: [&str; V],
    ) -> Result<Self> {
        let mut file =
            OpenOptions::new().read(true).append(true).create(true).truncate(false).open(path)?;
        let mut text = fs::read_to_string(path)?;
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        text.truncate(whole);
        file.set_len(whole as u64)?;

        let header = [PROVENANCE.as_slice(), &keys, &values].concat();
        if text.is_empty() {
            file.write_all(&record(&header)?)?;
        }
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        ensure!(
            text.is_empty() || reader.headers()? == header,
            "{} has other columns than this program writes: move it away",
            path.display()
        );
        let mut rows = HashMap::new();
        for row in reader.records() {
            let row = row?;
            let fields: Vec<&str> = row.iter().collect();
            let (key, numbers) = fields.split_at(PROVENANCE.len() + K);
            let mut values = [0.0; V];
            for (value, number) in values.iter_mut().zip(numbers) {
                *value = number
                    .parse()
                    .with_context(|| format!("{}: `{number}` is not a number", path.display()))?;
            }
            rows.insert(key.iter().map(|&field| field.to_owned()).collect(), values);
        }
        Ok(Self { file, rows, machine: machine.to_owned() })
    }

    /// The measurement under a key, if it was made.
    pub(crate) fn known(&self, version: &str, key: [&str; K]) -> Option<[f64; V]> {
        self.rows.get(&self.row(version, key)).copied()
    }

    /// The columns before the values.
    fn row(&self, version: &str, key: [&str; K]) -> Vec<String> {
        [self.machine.as_str(), version].into_iter().chain(key).map(str::to_owned).collect()
    }

    /// The measurement under a key: from the file, or else made now and appended to it.
    pub(crate) fn get(
        &mut self,
        version: &str,
        key: [&str; K],
        measure: impl FnOnce() -> Result<[f64; V]>,
    ) -> Result<[f64; V]> {
        if let Some(values) = self.known(version, key) {
            return Ok(values);
        }
        let key = self.row(version, key);
        eprintln!("{}", key[PROVENANCE.len()..].join("  "));
        let values = measure().with_context(|| key[PROVENANCE.len()..].join(", "))?;
        let numbers = values.map(|value| value.to_string());
        // One call, so that an interruption leaves at most one torn row.
        self.file.write_all(&record(key.iter().chain(&numbers))?)?;
        self.rows.insert(key, values);
        Ok(values)
    }
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
        Store::open(path, machine, ["codec", "image"], ["bytes", "psnr"]).expect("it opens")
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
        assert!(Store::<1, 1>::open(&path, "here", ["codec"], ["bytes"]).is_err());
    }
}
