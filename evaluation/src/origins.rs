//! Where measurements come from: a short key in each row of a store, and one small table of what the keys
//! stand for.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::files::{self, whole_lines};

/// The name of the table in the folder of the report.
const NAME: &str = "origins.csv";
/// The first column of the table, and of every store.
pub(crate) const COLUMN: &str = "origin";
const COLUMNS: [&str; 4] = [COLUMN, "machine", "version", "commit"];

/// The key of a machine and a version of what was measured: the same in every run, so that the rows of a
/// store do not depend on their history.
pub(crate) fn key(machine: &str, version: &str) -> String {
    format!("{:08x}", crc32fast::hash(format!("{machine}\n{version}").as_bytes()))
}

/// The table of a folder.
#[derive(Clone, Debug)]
pub(crate) struct Origins(PathBuf);

impl Origins {
    pub(crate) fn of(folder: &Path) -> Self {
        Self(folder.join(NAME))
    }

    /// Adds the origin of a measurement, if it is not there. Of the same version, all have the commit of the
    /// first.
    pub(crate) fn note(&self, machine: &str, version: &str, commit: &str) -> Result<()> {
        let mut rows = self.rows()?;
        let key = key(machine, version);
        if rows.iter().any(|[known, ..]| *known == key) {
            return Ok(());
        }
        let known = self.commit(version)?;
        let commit = known.as_deref().unwrap_or(commit);
        rows.push([&key, machine, version, commit].map(str::to_owned));
        rows.sort_unstable();
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(COLUMNS)?;
        rows.iter().try_for_each(|row| writer.write_record(row))?;
        files::replace(&self.0, &writer.into_inner()?)
    }

    /// The commit that was checked out when a version was measured for the first time.
    pub(crate) fn commit(&self, version: &str) -> Result<Option<String>> {
        let found = self.rows()?.into_iter().find(|[_, _, known, _]| known == version);
        Ok(found.map(|[.., commit]| commit))
    }

    /// The keys of the versions that a filter lets pass.
    pub(crate) fn keys(&self, pass: impl Fn(&str) -> bool) -> Result<Vec<String>> {
        let rows = self.rows()?.into_iter();
        Ok(rows.filter(|[_, _, version, _]| pass(version)).map(|[key, ..]| key).collect())
    }

    fn rows(&self) -> Result<Vec<[String; 4]>> {
        let text = files::read_if_any(&self.0)?.unwrap_or_default();
        let mut reader = csv::Reader::from_reader(&text.as_bytes()[..whole_lines(&text)]);
        let rows = reader.deserialize().collect::<Result<_, _>>();
        rows.with_context(|| format!("cannot read {}", self.0.display()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_origin_is_noted_once_with_the_first_commit_of_its_version() {
        let folder = tempfile::tempdir().expect("a folder");
        let origins = Origins::of(folder.path());
        assert_eq!(origins.commit("gip-1").expect("there is none yet"), None);
        let note = |machine: &str, version: &str, commit: &str| {
            origins.note(machine, version, commit).expect("it is written");
        };
        note("here, 2 cores", "gip-1", "aaa");
        note("here, 2 cores", "gip-1", "bbb");
        note("there", "gip-1", "bbb");
        note("there", "gip-2", "ccc");
        assert_eq!(origins.rows().expect("a table").len(), 3);
        assert_eq!(origins.commit("gip-1").expect("a table").as_deref(), Some("aaa"));
        assert_eq!(
            origins.keys(|version| version != "gip-1").expect("a table"),
            [key("there", "gip-2")]
        );
    }

    #[test]
    fn keys_tell_machines_and_versions_apart() {
        assert_ne!(key("a", "b"), key("b", "a"));
        assert_ne!(key("a", "b"), key("a\nb", ""));
    }
}
