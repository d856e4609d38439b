//! The formats by their extensions.

use std::path::Path;

use anyhow::{Context, Result};
use clap::ValueEnum;

use crate::args::GaussianFormat;
use crate::errors::WrongUsage;
use crate::files;

/// The format that is asked for, or else the one that the extension names; JSON lines for a standard stream.
pub(crate) fn format_of(asked: Option<GaussianFormat>, path: &Path) -> Result<GaussianFormat> {
    if let Some(format) = asked {
        return Ok(format);
    }
    if files::is_standard_stream(path) {
        return Ok(GaussianFormat::Jsonl);
    }
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    GaussianFormat::from_str(&extension, true).ok().with_context(|| {
        let path = path.display();
        WrongUsage(format!(
            "{path}: the extension must name the format: npz, json, jsonl, ply or svg; or give --format"
        ))
    })
}
