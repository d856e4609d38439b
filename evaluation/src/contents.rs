//! What pictures show.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result};
use serde::Deserialize;

/// The class of pictures among photographs that no camera made.
pub(crate) const RENDERED: &str = "rendered";

/// The class of content of each picture: textured, smooth, text, face, or whatever names are given.
#[derive(Clone, Debug, Default)]
pub(crate) struct Contents(BTreeMap<String, String>);

#[derive(Deserialize)]
struct Row {
    picture: String,
    content: String,
}

impl Contents {
    /// Reads a CSV with the columns `picture` (the name of a file without `.png`) and `content`.
    pub(crate) fn load(path: &Path) -> Result<Self> {
        let unreadable = || format!("cannot read {}", path.display());
        let mut reader = csv::Reader::from_path(path).with_context(unreadable)?;
        let rows =
            reader.deserialize().map(|row| row.map(|Row { picture, content }| (picture, content)));
        rows.collect::<Result<_, _>>().map(Self).with_context(unreadable)
    }

    /// Empty where it is not known.
    pub(crate) fn of(&self, picture: &str) -> &str {
        self.0.get(picture).map_or("", String::as_str)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_have_the_content_that_the_table_says() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("content.csv");
        std::fs::write(&path, "picture,content\na,text\nb,face\n").expect("it is written");
        let contents = Contents::load(&path).expect("it is a table");
        assert_eq!(["a", "b", "c"].map(|picture| contents.of(picture)), ["text", "face", ""]);
        std::fs::write(&path, "image,content\na,text\n").expect("it is written");
        assert!(Contents::load(&path).is_err());
    }
}
