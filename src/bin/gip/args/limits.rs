//! `--limit`, which all commands have.

use image_gip::{LimitKind, Limits};

use crate::limits::{NAMES, set};

#[derive(Debug, clap::Args)]
pub(crate) struct LimitArgs {
    /// Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or
    /// pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel
    /// evaluations of a rendering beyond 64 for each pixel); or `none` for no limits.
    ///
    /// VALUE may end in k, M or G: thousands, millions or billions, of memory KiB, MiB or GiB. Defaults:
    /// width=65536, height=65536, pixels=268435456, gaussians=4194304, memory=512M and
    /// work=4294967296. Files beyond them cannot be read without this option, so `gip` does not write
    /// them without it. It may be given several times; a later one counts. Files from others are
    /// best read with the defaults.
    #[arg(long = "limit", value_name = "NAME=VALUE", value_parser = change)]
    changes: Vec<Change>,
}

/// One use of the option.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Change {
    None,
    To(LimitKind, u64),
}

impl LimitArgs {
    pub(crate) fn limits(&self) -> Limits {
        let mut limits = Limits::default();
        for change in &self.changes {
            match *change {
                Change::None => limits = Limits::none(),
                Change::To(kind, value) => set(&mut limits, kind, value),
            }
        }
        limits
    }
}

/// Parses `NAME=VALUE` or `none`.
fn change(text: &str) -> Result<Change, String> {
    if text == "none" {
        return Ok(Change::None);
    }
    let parsed = text.split_once('=').and_then(|(name, value)| {
        let (_, kind) = NAMES.into_iter().find(|(known, _)| *known == name)?;
        let (digits, power) = match value.strip_suffix(['k', 'M', 'G']) {
            Some(digits) => (digits, "kMG".find(&value[digits.len()..])? as u32 + 1),
            None => (value, 0),
        };
        let unit: u64 = if kind == LimitKind::Memory { 1024 } else { 1000 };
        Some(Change::To(kind, digits.parse::<u64>().ok()?.checked_mul(unit.pow(power))?))
    });
    parsed.ok_or_else(|| {
        let names = NAMES.map(|(name, _)| name).join(", ");
        format!("neither none nor NAME=VALUE such as memory=2G, with a NAME of {names}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_values_and_units() {
        let to = |kind, value| Ok(Change::To(kind, value));
        assert_eq!(change("pixels=7"), to(LimitKind::Pixels, 7));
        assert_eq!(change("work=5G"), to(LimitKind::Work, 5_000_000_000));
        assert_eq!(change("memory=2G"), to(LimitKind::Memory, 2 << 30));
        assert_eq!(change("none"), Ok(Change::None));
        for text in ["", "pixels", "pixels=", "pixels=k", "=7", "size=7", "width=-1", "width=1.5M"]
        {
            assert!(change(text).is_err(), "{text}");
        }
        let args = LimitArgs { changes: vec![Change::None, Change::To(LimitKind::Width, 1 << 40)] };
        assert_eq!(args.limits(), Limits::none());
    }
}
