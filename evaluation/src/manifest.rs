//! The pictures that the report is about: `pictures.csv`.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde::Deserialize;

use crate::pictures::TestPicture;
use crate::provenance::FOLDER;

/// The name of the list in the crate's folder.
pub(crate) const NAME: &str = "pictures.csv";

/// A picture of the list.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Listed {
    /// The name of the option that takes its folder: `kodak`, `photos`, `large` or `screens`.
    pub(crate) set: String,
    /// The name of its file, without `.png`.
    pub(crate) picture: String,
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// Of the samples, interleaved 8-bit RGB, in hexadecimal digits: whatever file they come from.
    pub(crate) crc32: String,
    pub(crate) licence: String,
    /// Of the set.
    pub(crate) page: String,
    /// Of the file, `.png` or `.jxl`; empty where none is known.
    pub(crate) url: String,
}

/// All pictures of the list.
#[derive(Clone, Debug)]
pub(crate) struct Manifest(pub(crate) Vec<Listed>);

impl Manifest {
    pub(crate) fn load() -> Result<Self> {
        let path = Path::new(FOLDER).join(NAME);
        let unreadable = || format!("cannot read {}", path.display());
        let mut reader = csv::Reader::from_path(&path).with_context(unreadable)?;
        reader.deserialize().collect::<Result<_, _>>().map(Self).with_context(unreadable)
    }

    /// How many pictures a set has.
    pub(crate) fn count(&self, set: &str) -> usize {
        self.0.iter().filter(|listed| listed.set == set).count()
    }

    /// Whether a picture is listed, in whatever set.
    ///
    /// # Errors
    /// When the list has another picture of that name: measurements are kept by name alone.
    pub(crate) fn has(&self, picture: &TestPicture) -> Result<bool> {
        let named = |listed: &&Listed| listed.picture == picture.name;
        let Some(listed) = self.0.iter().find(named) else { return Ok(false) };
        ensure!(
            listed.is(picture),
            "{} is not the {} that {NAME} lists as {} x {} with the checksum {}: it has {} x {} and {}",
            picture.path.display(),
            listed.picture,
            listed.width,
            listed.height,
            listed.crc32,
            picture.width,
            picture.height,
            crc32(picture)
        );
        Ok(true)
    }
}

impl Listed {
    /// Whether a picture has these samples.
    pub(crate) fn is(&self, picture: &TestPicture) -> bool {
        (self.width, self.height) == (picture.width, picture.height) && self.crc32 == crc32(picture)
    }
}

/// The checksum of a picture's samples as the list has it.
fn crc32(picture: &TestPicture) -> String {
    format!("{:08x}", crc32fast::hash(&picture.rgb))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_names_each_picture_once_with_a_licence() {
        let manifest = Manifest::load().expect("it is a table");
        assert_eq!(
            ["kodak", "photos", "large", "screens"].map(|set| manifest.count(set)),
            [24, 25, 6, 5]
        );
        for (index, listed) in manifest.0.iter().enumerate() {
            let Listed { set, picture, crc32, licence, page, url, .. } = listed;
            assert!(
                !manifest.0[..index].iter().any(|other| other.picture == *picture),
                "{picture}"
            );
            assert!(crc32.len() == 8 && u32::from_str_radix(crc32, 16).is_ok(), "{picture}");
            assert!(!licence.is_empty() && page.starts_with("https://"), "{set}: {picture}");
            assert!(url.is_empty() || url.starts_with("https://"), "{url}");
        }
    }

    #[test]
    fn another_picture_of_a_listed_name_is_refused() {
        let rgb = vec![7, 8, 9];
        let picture = TestPicture { name: "a".into(), path: "".into(), width: 1, height: 1, rgb };
        let listed = Listed {
            set: "kodak".into(),
            picture: "a".into(),
            width: 1,
            height: 1,
            crc32: crc32(&picture),
            licence: String::new(),
            page: String::new(),
            url: String::new(),
        };
        let manifest = Manifest(vec![listed]);
        assert!(manifest.has(&picture).expect("it is the same"));
        let unlisted = TestPicture { name: "b".into(), ..picture.clone() };
        assert!(!manifest.has(&unlisted).expect("there is none"));
        let other = TestPicture { rgb: vec![7, 8, 10], ..picture };
        let refusal = manifest.has(&other).expect_err("it is another").to_string();
        assert!(refusal.contains("is not the a that pictures.csv lists"), "{refusal}");
    }
}
