//! The figures of the report that texts elsewhere cite, by name: `figures.csv`.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};

use crate::files;
use crate::number::rounded;

/// The name of the table in the folder of the report.
pub(crate) const NAME: &str = "figures.csv";

/// A figure: a number, and what it counts.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Figure {
    pub(crate) value: f64,
    /// Empty for a plain number.
    pub(crate) unit: String,
}

/// Figures by name: the section's, and what else tells them apart, between slashes.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Figures(BTreeMap<String, Figure>);

#[derive(Deserialize, Serialize)]
struct Row {
    figure: String,
    value: f64,
    unit: String,
}

impl Figures {
    /// Those of a folder; none if it has no table.
    pub(crate) fn load(folder: &Path) -> Result<Self> {
        let path = folder.join(NAME);
        let text = files::read_if_any(&path)?.unwrap_or_default();
        let unreadable = || format!("cannot read {}", path.display());
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let rows = reader
            .deserialize()
            .map(|row| row.map(|Row { figure, value, unit }| (figure, Figure { value, unit })));
        rows.collect::<Result<_, _>>().map(Self).with_context(unreadable)
    }

    /// Replaces all figures of a section in a folder's table by these.
    pub(crate) fn update(self, folder: &Path, section: &str) -> Result<()> {
        let mut all = Self::load(folder)?.0;
        let of_section = format!("{section}/");
        all.retain(|name, _| !name.starts_with(&of_section));
        let own = self.0.into_iter().map(|(name, figure)| (format!("{of_section}{name}"), figure));
        all.extend(own);
        let mut writer = csv::Writer::from_writer(Vec::new());
        for (figure, Figure { value, unit }) in all {
            writer.serialize(Row { figure, value, unit })?;
        }
        files::replace(&folder.join(NAME), &writer.into_inner()?)
    }

    /// Adds a figure, unless it is no number: then there is nothing to cite.
    pub(crate) fn add(&mut self, name: String, value: f64, unit: &str) {
        if value.is_finite() {
            self.0.insert(name, Figure { value: rounded(value), unit: unit.to_owned() });
        }
    }

    pub(crate) fn get(&self, name: &str) -> Option<&Figure> {
        self.0.get(name)
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_section_replaces_its_figures_and_no_others() {
        let folder = tempfile::tempdir().expect("a folder");
        let folder = folder.path();
        let update = |section: &str, names: &[&str], value: f64| {
            let mut figures = Figures::default();
            names.iter().for_each(|name| figures.add((*name).into(), value, "%"));
            figures.update(folder, section).expect("it is written");
        };
        update("rate", &["b", "a"], -9.25);
        update("rates", &["a"], 2.0);
        update("rate", &["a", "c"], 3.5);
        let text = fs::read_to_string(folder.join(NAME)).expect("text");
        assert_eq!(text, "figure,value,unit\nrate/a,3.5,%\nrate/c,3.5,%\nrates/a,2.0,%\n");
        let figures = Figures::load(folder).expect("it is a table");
        assert_eq!(figures.get("rate/a"), Some(&Figure { value: 3.5, unit: "%".into() }));
        assert_eq!(figures.get("rate/b"), None);
    }

    #[test]
    fn what_is_no_number_is_no_figure() {
        let mut figures = Figures::default();
        figures.add("a".into(), f64::NAN, "");
        assert_eq!(figures, Figures::default());
    }
}
