//! Fetches the pictures of the report that are public.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::files;
use crate::manifest::{Listed, Manifest, NAME};
use crate::pictures;

/// The sets of the list.
const SETS: [&str; 4] = ["kodak", "photos", "large", "screens"];

/// Fetches the pictures of `pictures.csv` whose address is known, a folder for each set, and checks them.
///
/// It needs the programs curl, and djxl of libjxl for the sets that are published as JPEG XL. What is there
/// already is only checked. Of the others it says where they come from.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Folder for the sets' folders.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Only these sets [default: all].
    #[arg(long, value_name = "SET", value_delimiter = ',', value_parser = SETS)]
    set: Vec<String>,
}

/// Fetches, checks, and says what is missing.
///
/// # Errors
/// When a picture is another than the one that is listed, or could not be fetched.
pub(crate) fn fetch(args: &Args) -> Result<()> {
    let mut missing: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut failures = Vec::new();
    for listed in Manifest::load()?.0 {
        if !args.set.is_empty() && !args.set.contains(&listed.set) {
            continue;
        }
        let path = args.out.join(&listed.set).join(format!("{}.png", listed.picture));
        if !path.exists() && listed.url.is_empty() {
            let of = format!("{}, from {} ({})", listed.set, listed.page, listed.licence);
            missing.entry(of).or_default().push(listed.picture);
        } else if let Err(error) = get(&listed, &path) {
            failures.push(format!("{error:#}"));
        }
    }
    for (of, pictures) in missing {
        println!("to be put there by hand: {of}: {}", pictures.join(", "));
    }
    ensure!(failures.is_empty(), "{}", failures.join("\n"));
    Ok(())
}

/// Makes sure that a picture is at a place.
fn get(listed: &Listed, path: &Path) -> Result<()> {
    if !path.exists() {
        let folder = path.parent().context("it is in a folder")?;
        files::make_folder(folder)?;
        let is_png = listed.url.ends_with(".png");
        let new = path.with_extension(if is_png { "png.new" } else { "jxl" });
        let fetch = ["--fail", "--silent", "--show-error", "--location", "--output"];
        run(Command::new("curl").args(fetch).arg(&new).arg(&listed.url))?;
        if is_png {
            fs::rename(&new, path)?;
        } else {
            run(Command::new("djxl").arg(&new).arg(path))?;
            fs::remove_file(new)?;
        }
    }
    let picture = pictures::open(path)?;
    ensure!(listed.is(&picture), "{} is not the picture that {NAME} lists", path.display());
    println!("{}", path.display());
    Ok(())
}

fn run(command: &mut Command) -> Result<()> {
    let output = command.output().with_context(|| format!("cannot run {command:?}"))?;
    let words = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{command:?} failed: {}", words.trim());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listed(rgb: [u8; 3], url: &str) -> Listed {
        Listed {
            set: "kodak".into(),
            picture: "a".into(),
            width: 1,
            height: 1,
            crc32: format!("{:08x}", crc32fast::hash(&rgb)),
            licence: String::new(),
            page: String::new(),
            url: url.into(),
        }
    }

    #[test]
    fn what_is_there_is_checked() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        image::RgbImage::from_pixel(1, 1, image::Rgb([1, 2, 3]))
            .save(&path)
            .expect("it is written");
        assert!(get(&listed([1, 2, 3], ""), &path).is_ok());
        let failure = get(&listed([1, 2, 4], ""), &path).expect_err("it is another").to_string();
        assert!(failure.contains("is not the picture"), "{failure}");
    }

    #[test]
    fn what_cannot_be_fetched_leaves_no_picture() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("kodak/a.png");
        assert!(get(&listed([1, 2, 3], "file:///nowhere/a.png"), &path).is_err());
        assert!(!path.exists());
    }
}
