//! The limits of what is read and written, by the names that they have in `--limit`.

use image_gip::{DecodeError, EncodeError, LimitKind, Limits, WriteError};
use thiserror::Error;

/// Each kind of limit with its name.
pub(crate) const NAMES: [(&str, LimitKind); 6] = [
    ("width", LimitKind::Width),
    ("height", LimitKind::Height),
    ("pixels", LimitKind::Pixels),
    ("gaussians", LimitKind::Gaussians),
    ("memory", LimitKind::Memory),
    ("work", LimitKind::Work),
];

/// Sets one of the limits. Those that are smaller integers in the library have no larger values.
pub(crate) fn set(limits: &mut Limits, kind: LimitKind, value: u64) {
    let small = u32::try_from(value).unwrap_or(u32::MAX);
    match kind {
        LimitKind::Width => limits.max_width = small,
        LimitKind::Height => limits.max_height = small,
        LimitKind::Pixels => limits.max_pixels = value,
        LimitKind::Gaussians => limits.max_gaussians = small,
        LimitKind::Memory => limits.max_memory = value,
        LimitKind::Work => limits.max_work = value,
        _ => {}
    }
}

/// A picture that takes more memory than is allowed, as its decoder says without a number.
#[derive(Debug, Error)]
#[error("limit exceeded: {}: more than {allowed} required, {allowed} allowed", LimitKind::Memory)]
pub(crate) struct MemoryLimit {
    pub(crate) allowed: u64,
}

/// Refuses a picture that is too large.
pub(crate) fn check_size(limits: &Limits, (width, height): (u32, u32)) -> Result<(), DecodeError> {
    let pixels = u64::from(width) * u64::from(height);
    for (kind, wanted, allowed) in [
        (LimitKind::Width, width.into(), limits.max_width.into()),
        (LimitKind::Height, height.into(), limits.max_height.into()),
        (LimitKind::Pixels, pixels, limits.max_pixels),
    ] {
        if wanted > allowed {
            return Err(DecodeError::Limit { kind, wanted, allowed });
        }
    }
    Ok(())
}

/// How to raise the limit that an error is about.
pub(crate) fn advice(error: &anyhow::Error) -> Option<String> {
    let kind = error.chain().find_map(|cause| {
        if let Some(DecodeError::Limit { kind, .. }) = cause.downcast_ref() {
            return Some(*kind);
        }
        if let Some(EncodeError::Limit { kind, .. }) = cause.downcast_ref() {
            return Some(*kind);
        }
        if let Some(WriteError::Limit { kind, .. }) = cause.downcast_ref() {
            return Some(*kind);
        }
        cause.is::<MemoryLimit>().then_some(LimitKind::Memory)
    })?;
    let (name, _) = NAMES.into_iter().find(|(_, named)| *named == kind)?;
    Some(format!("--limit {name}=N sets another limit"))
}
