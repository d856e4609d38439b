//! Reading a picture of any format.

use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;

use anyhow::{Context, Result, bail};
use image_gip::{Decoder, Limits};

use super::format::{Format, START};
use super::stored::Stored;
use super::unread::unread;
use super::{fault, formats, gip, tiff};
use crate::files;
use crate::limits::check_size;
use crate::picture::StillImage;

/// How pictures are read.
#[derive(Clone, Debug)]
pub(crate) struct Reading {
    pub(crate) limits: Limits,
    /// Whether what can be read of a damaged file is taken.
    pub(crate) allow_partial: bool,
}

impl Reading {
    /// Reads a picture of any format that `image` reads, or of .gip.
    pub(crate) fn read(&self, path: &Path) -> Result<StillImage> {
        let file = files::read(path)?;
        self.decode(path, &file).with_context(|| files::input_name(path))
    }

    /// Width and height in pixels as they are stored, before the orientation is applied.
    pub(crate) fn dimensions(&self, path: &Path) -> Result<(u32, u32)> {
        self.stored_size(path).with_context(|| files::input_name(path))
    }

    fn stored_size(&self, path: &Path) -> Result<(u32, u32)> {
        let mut file = BufReader::new(File::open(path)?);
        let mut start = Vec::new();
        file.by_ref().take(START as u64).read_to_end(&mut start)?;
        file.rewind()?;
        let format = format(path, &start)?;
        let size = match format {
            Format::Gip => {
                let decoder = Decoder::new_with_limits(file, self.limits.clone())?;
                Ok((decoder.header().width, decoder.header().height))
            }
            Format::Image(format) => formats::dimensions(format, file, &self.limits),
            Format::Tiff => tiff::dimensions(file),
        };
        let size =
            size.map_err(|error| fault::plain(error, format, &self.limits, self.allow_partial))?;
        check_size(&self.limits, size)?;
        Ok(size)
    }

    fn decode(&self, path: &Path, file: &[u8]) -> Result<StillImage> {
        let Self { limits, allow_partial } = self;
        let format = format(path, &file[..file.len().min(START)])?;
        let stored = match format {
            Format::Gip => gip::read(file, limits, *allow_partial),
            Format::Image(format) => formats::read(format, file, limits, *allow_partial),
            Format::Tiff => tiff::read(file, limits, *allow_partial),
        };
        let Stored { image, orientation, metadata, warnings } =
            stored.map_err(|error| fault::plain(error, format, limits, *allow_partial))?;
        if image.width() == 0 || image.height() == 0 {
            bail!("it has no pixels");
        }
        let mut picture = StillImage { image, metadata, warnings };
        picture.make_upright(orientation);
        picture.drop_unfit_profile();
        Ok(picture)
    }
}

fn format(path: &Path, start: &[u8]) -> Result<Format> {
    let format = Format::by_signature(start).or_else(|| Format::by_name(path));
    let format = format.with_context(|| match unread(path) {
        Some(name) => format!("{name} is not read"),
        None => "the format is none of those that are read".into(),
    })?;
    if !format.is_read() {
        bail!("{} is not read", format.name());
    }
    if format.is_excluded(start) {
        bail!("it does not begin like {}, in spite of its name", format.name());
    }
    Ok(format)
}
