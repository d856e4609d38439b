//! What goes wrong with a file.

use std::io::{self, ErrorKind};
use std::panic::{self, AssertUnwindSafe};

use anyhow::{Error, Result, bail};
use image_gip::EncodeError;

use super::inputs::Item;

/// Makes an error of a panic, so that one picture on which a library fails does not end the batch.
pub(super) fn catch_panic<T>(item: &Item, work: impl FnOnce() -> Result<T>) -> Result<T> {
    panic::catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<&str>().map(|text| text.to_string());
        let text = text.or_else(|| panic.downcast_ref().cloned()).unwrap_or_default();
        bail!("{}: internal error: {text}", item.source.display())
    })
}

/// Whether an error says no more than that the batch was asked to stop.
pub(super) fn is_cancelled(error: &Error) -> bool {
    matches!(error.downcast_ref(), Some(EncodeError::Cancelled))
}

/// Whether an error is that of a full disk, or of a full quota.
pub(super) fn is_disk_full(error: &Error) -> bool {
    error
        .chain()
        .filter_map(|cause| cause.downcast_ref::<io::Error>())
        .any(|error| matches!(error.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::errors::one_line;

    #[test]
    fn a_panic_is_an_error_with_the_name_of_the_file() {
        let item = Item { source: "a.png".into(), output: "a.gip".into() };
        let error = |work: fn() -> Result<()>| one_line(&catch_panic(&item, work).unwrap_err());
        assert_eq!(error(|| panic!("of a {}", "library")), "a.png: internal error: of a library");
        assert_eq!(error(|| panic!("fixed")), "a.png: internal error: fixed");
        assert_eq!(error(|| bail!("plain")), "plain");
    }

    #[test]
    fn a_full_disk_is_told_from_other_errors() {
        for (kind, is_full) in [
            (ErrorKind::StorageFull, true),
            (ErrorKind::QuotaExceeded, true),
            (ErrorKind::PermissionDenied, false),
        ] {
            let error = Error::from(io::Error::from(kind)).context("a.gip");
            assert_eq!(is_disk_full(&error), is_full, "{kind}");
        }
    }
}
