//! What a PNG tells beside its picture in chunks that are damaged.

use std::borrow::Cow;
use std::io::{BufRead, Cursor, Seek};
use std::ops::Range;

use png::{DecodingError, Info};

/// Bytes of the signature, and of length, name and checksum of a chunk.
const SIGNATURE: usize = 8;
const AROUND: usize = 12;
/// Signature and header of a picture of one gray pixel, which any chunk may follow.
const BEFORE: &[u8] =
    b"\x89PNG\r\n\x1A\n\0\0\0\x0DIHDR\0\0\0\x01\0\0\0\x01\x08\0\0\0\0\x3A\x7E\x9B\x55";
/// Where the samples would begin.
const AFTER: &[u8] = b"\0\0\0\x01IDAT";

/// Chunks that the picture can do without, and whose meaning does not depend on others.
const OPTIONAL: [&[u8]; 9] =
    [b"cHRM", b"cICP", b"cLLI", b"eXIf", b"gAMA", b"iCCP", b"mDCV", b"pHYs", b"sRGB"];

/// The file without those [`OPTIONAL`] chunks before the samples that cannot be read, and a warning of
/// each. The library ignores some of them without a word, and takes others for an error.
pub(super) fn without_damaged(file: &[u8]) -> (Cow<'_, [u8]>, Vec<String>) {
    let (mut ranges, mut warnings, mut seen) = (Vec::new(), Vec::new(), Vec::new());
    for range in chunks(file) {
        let chunk = &file[range.clone()];
        let name = &chunk[4..8];
        if name == b"IDAT" {
            break;
        }
        // Nothing is made of bKGD, which the library wants after the palette. Of others, the first counts.
        if name == b"bKGD" || seen.contains(&name) {
            ranges.push(range);
        } else if OPTIONAL.contains(&name) {
            seen.push(name);
            if !is_readable(name, chunk) {
                let name = name.escape_ascii();
                warnings.push(format!("its chunk {name} is invalid, and is ignored"));
                ranges.push(range);
            }
        }
    }
    if ranges.is_empty() {
        return (file.into(), warnings);
    }
    let (mut out, mut at) = (Vec::with_capacity(file.len()), 0);
    for range in ranges {
        out.extend_from_slice(&file[at..range.start]);
        at = range.end;
    }
    out.extend_from_slice(&file[at..]);
    (out.into(), warnings)
}

/// Whether the file ends before its last chunk does.
pub(super) fn is_cut(file: &[u8]) -> bool {
    !chunks(file).any(|range| file[range][4..8] == *b"IEND")
}

/// Width and height, whatever is damaged after the header.
pub(super) fn size(file: impl BufRead + Seek) -> Result<(u32, u32), DecodingError> {
    Ok(png::Decoder::new(file).read_header_info()?.size())
}

/// What the chunks before the samples say; `None` if they are damaged.
pub(super) fn info(file: &[u8]) -> Option<Info<'static>> {
    let reader = png::Decoder::new(Cursor::new(file)).read_info().ok()?;
    Some(reader.info().clone())
}

/// Where each chunk is that is whole.
fn chunks(file: &[u8]) -> impl Iterator<Item = Range<usize>> {
    let mut at = SIGNATURE;
    std::iter::from_fn(move || {
        let length = u32::from_be_bytes(*file.get(at..)?.first_chunk()?);
        let start = at;
        at = at.saturating_add(length as usize).saturating_add(AROUND);
        file.get(start..at).map(|_| start..at)
    })
}

/// Whether the library gets from a chunk what it is for.
fn is_readable(name: &[u8], chunk: &[u8]) -> bool {
    let file = [BEFORE, chunk, AFTER].concat();
    let Some(info) = info(&file) else { return false };
    match name {
        b"cICP" => info.coding_independent_code_points.is_some(),
        b"iCCP" => info.icc_profile.is_some(),
        b"sRGB" => info.srgb.is_some(),
        b"gAMA" => info.gama_chunk.is_some(),
        b"cHRM" => info.chrm_chunk.is_some(),
        b"pHYs" => info.pixel_dims.is_some(),
        b"eXIf" => info.exif_metadata.is_some(),
        // What nothing is made of.
        _ => true,
    }
}
