//! What several commands take: a number of threads, and the parsers of values.

use core::num::NonZeroU32;

use image_gip::Region;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use crate::codec::{Codec, EXTENSIONS};

#[derive(Debug, clap::Args)]
pub(crate) struct ThreadCount {
    /// Number of threads, from 1 to 1024; the result does not depend on it [default: one per
    /// core].
    #[arg(long = "threads", value_name = "T",
          value_parser = clap::value_parser!(u16).range(1..=1024))]
    count: Option<u16>,
}

impl ThreadCount {
    /// The thread pool in which the work is done.
    pub(crate) fn pool(&self) -> Result<ThreadPool, ThreadPoolBuildError> {
        ThreadPoolBuilder::new().num_threads(self.count.map_or(0, usize::from)).build()
    }
}

/// Parses a number from `least` to `most`.
pub(super) fn number(text: &str, least: f64, most: f64) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|number| (least..=most).contains(number))
        .ok_or_else(|| format!("not a number from {least} to {most}"))
}

/// Parses `WxH`.
pub(super) fn size(text: &str) -> Result<(u32, u32), String> {
    text.split_once('x')
        .and_then(|(width, height)| {
            let side = |text: &str| text.parse().ok().map(NonZeroU32::get);
            Some((side(width)?, side(height)?))
        })
        .ok_or_else(|| "not two positive whole numbers such as 640x480".into())
}

/// Parses `N` or `WxH`, sides that something is to fit into.
pub(super) fn bounds(text: &str) -> Result<(u32, u32), String> {
    let side = text.parse().map(NonZeroU32::get);
    side.map(|side| (side, side))
        .or_else(|_| size(text))
        .map_err(|_| "not one or two positive whole numbers such as 160 or 160x120".into())
}

/// Parses the extension of a format that can be written.
pub(super) fn extension(text: &str) -> Result<String, String> {
    match Codec::named(text) {
        Some(_) => Ok(text.into()),
        None => Err(format!("not one of {EXTENSIONS}")),
    }
}

/// Parses `X,Y,W,H`.
pub(super) fn region(text: &str) -> Result<Region, String> {
    let numbers: Result<Vec<u32>, _> = text.split(',').map(str::parse).collect();
    match numbers.as_deref() {
        Ok(&[x, y, width, height]) if width > 0 && height > 0 => Ok(Region { x, y, width, height }),
        _ => Err("not four whole numbers X,Y,W,H with W and H of at least 1".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_regions() {
        assert_eq!(size("640x480"), Ok((640, 480)));
        assert_eq!(region("1,2,3,4"), Ok(Region { x: 1, y: 2, width: 3, height: 4 }));
        assert_eq!((bounds("64"), bounds("64x48")), (Ok((64, 64)), Ok((64, 48))));
        for text in ["", "0", "-1", "64x", "64x0", "1.5"] {
            assert!(bounds(text).is_err(), "{text}");
        }
        for text in ["", "x", "640", "0x5", "5x0", "-1x5", "5x5x5", "5X5"] {
            assert!(size(text).is_err(), "{text}");
        }
        for text in ["", "1,2,3", "1,2,3,0", "1,2,0,3", "1,2,3,4,5", "-1,2,3,4"] {
            assert!(region(text).is_err(), "{text}");
        }
    }
}
