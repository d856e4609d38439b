//! The samples of a page as they are stored.

use std::io::Cursor;

use anyhow::{Context, Result, bail};
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::Tag;
use tiff::{TiffError, TiffResult};

use super::strips::{reverse_bits, strips};
use super::tags::Tags;
use crate::limits::MemoryLimit;
use crate::source::{clipping, fault};

/// The tag `PhotometricInterpretation`.
const PHOTOMETRIC: u16 = 262;
/// Its value for gray, where more is brighter.
const BLACK_IS_ZERO: u16 = 1;

/// Samples, pixel after pixel, and channel after channel within it. What has fewer than 8 bits is in the
/// lowest of them.
#[derive(Debug)]
pub(super) enum Samples {
    Eight(Vec<u8>),
    Sixteen(Vec<u16>),
}

/// Reads all samples, what is damaged if some are missing, and what of floats is clipped.
pub(super) fn read(
    file: &[u8],
    tags: &Tags,
    max_memory: u64,
    allow_partial: bool,
) -> Result<(Samples, Option<&'static str>, Option<String>)> {
    let (limits, over) = (limits(max_memory, tags), MemoryLimit { allowed: max_memory });
    let mut file = without_colors(file).context("the directory of the page is damaged")?;
    if tags.is_reversed && !tags.is_jpeg {
        let strips = strips(&mut Decoder::new(Cursor::new(&file[..]))?)?;
        reverse_bits(&mut file, &strips);
    }
    let mut decoder = Decoder::new(Cursor::new(&file[..]))?.with_limits(limits.clone());
    let layout = decoder.image_buffer_layout()?;
    let mut decoded = DecodingResult::U8(Vec::new());
    let mut damage = decoder.read_image_to_buffer(&mut decoded).err();
    if let Some(TiffError::LimitsExceeded) = damage {
        bail!(over);
    }
    let is_blank = |decoded: &mut DecodingResult| {
        decoded.as_buffer(0).as_bytes().iter().all(|&byte| byte == 0)
    };
    if allow_partial && damage.is_some() && is_blank(&mut decoded) {
        // A strip is read as a whole, with zeros for what is missing.
        file.resize(file.len() + layout.complete_len, 0);
        let mut decoder = Decoder::new(Cursor::new(&file[..]))?.with_limits(limits);
        let _ = decoder.read_image_to_buffer(&mut decoded);
    }
    if let Some(error) = damage.take_if(|_| !allow_partial || is_blank(&mut decoded)) {
        bail!(error);
    }
    if decoded.as_buffer(0).as_bytes().len() < layout.complete_len {
        bail!(over);
    }
    let planes = if layout.planes > 1 { tags.samples } else { 1 };
    let clipped = match &decoded {
        DecodingResult::F16(samples) => clipping::warning(samples.iter().map(|s| s.to_f32())),
        DecodingResult::F32(samples) => clipping::warning(samples.iter().copied()),
        DecodingResult::F64(samples) => clipping::warning(samples.iter().map(|&s| s as f32)),
        _ => None,
    };
    let samples = match decoded {
        DecodingResult::U8(bytes) if tags.bits < 8 => {
            Samples::Eight(unpacked(&bytes, tags, tags.samples / planes))
        }
        DecodingResult::U8(samples) => Samples::Eight(samples),
        DecodingResult::U16(samples) => Samples::Sixteen(samples),
        DecodingResult::U32(samples) => {
            Samples::Sixteen(samples.into_iter().map(|sample| (sample >> 16) as u16).collect())
        }
        DecodingResult::F16(samples) => of_floats(samples.into_iter().map(f32::from)),
        DecodingResult::F32(samples) => of_floats(samples.into_iter()),
        DecodingResult::F64(samples) => of_floats(samples.into_iter().map(|sample| sample as f32)),
        // Of Lab, a* and b* have signs that the tag need not tell.
        DecodingResult::I8(samples) if tags.photometric.colors() == 3 => {
            Samples::Eight(samples.into_iter().map(|sample| sample as u8).collect())
        }
        _ => bail!("samples that are signed integers, or have 64 bits, are not read"),
    };
    let samples = match samples {
        Samples::Eight(samples) => Samples::Eight(interleaved(samples, planes)),
        Samples::Sixteen(samples) => Samples::Sixteen(interleaved(samples, planes)),
    };
    Ok((samples, damage.and_then(|error| fault::damage(&error)), clipped))
}

/// A copy of the file whose samples are gray or have no meaning, so that the library gives them as they
/// are.
fn without_colors(file: &[u8]) -> Option<Vec<u8>> {
    let is_little = file.starts_with(b"II");
    let number = |at: usize, bytes: usize| -> Option<usize> {
        let bytes = file.get(at..at.checked_add(bytes)?)?;
        let digits: Box<dyn Iterator<Item = &u8>> =
            if is_little { Box::new(bytes.iter().rev()) } else { Box::new(bytes.iter()) };
        Some(digits.fold(0, |number, &digit| number << 8 | usize::from(digit)))
    };
    let is_big = number(2, 2)? == 43;
    // Where the offset is; bytes of a number of entries, of an entry, and before its value.
    let (offset, count, entry, value) =
        if is_big { ((8, 8), 8, 20, 12) } else { ((4, 4), 2, 12, 8) };
    let directory = number(offset.0, offset.1)?;
    let entries = number(directory, count)?;
    let first = directory + count;
    let at = (0..entries)
        .map(|number| first.saturating_add(number.saturating_mul(entry)))
        .take_while(|&at| at < file.len())
        .find(|&at| number(at, 2) == Some(PHOTOMETRIC.into()))?;
    // The value is in the lower half of a LONG.
    let half = if !is_little && number(at + 2, 2) == Some(4) { 2 } else { 0 };
    let gray = if is_little { BLACK_IS_ZERO.to_le_bytes() } else { BLACK_IS_ZERO.to_be_bytes() };
    let (at, mut file) = (at + value + half, file.to_vec());
    file.get_mut(at..at + 2)?.copy_from_slice(&gray);
    Some(file)
}

/// Samples of fewer than 8 bits, whose rows of so many samples for each pixel begin with a byte.
fn unpacked(bytes: &[u8], tags: &Tags, samples: usize) -> Vec<u8> {
    let (bits, full) = (usize::from(tags.bits), (1_u16 << tags.bits) - 1);
    let length = tags.size.0 as usize * samples;
    let sample = |row: &[u8], index: usize| {
        let at = index * bits;
        let pair = u16::from(row[at / 8]) << 8 | u16::from(*row.get(at / 8 + 1).unwrap_or(&0));
        (pair >> (16 - bits - at % 8) & full) as u8
    };
    let rows = bytes.chunks_exact((length * bits).div_ceil(8));
    rows.flat_map(|row| (0..length).map(move |index| sample(row, index))).collect()
}

/// Floats from 0 to 1 are samples like integers from 0 to their largest.
fn of_floats(samples: impl Iterator<Item = f32>) -> Samples {
    Samples::Sixteen(
        samples.map(|sample| (sample.clamp(0.0, 1.0) * 65535.0).round() as u16).collect(),
    )
}

/// One sample of each plane after the other.
fn interleaved<T: Copy>(samples: Vec<T>, planes: usize) -> Vec<T> {
    if planes <= 1 || samples.len() < planes {
        return samples;
    }
    let planes: Vec<&[T]> = samples.chunks_exact(samples.len() / planes).collect();
    (0..planes[0].len()).flat_map(|index| planes.iter().map(move |plane| plane[index])).collect()
}

/// What reading may take: its own memory, and that of the samples.
fn limits(memory: u64, tags: &Tags) -> Limits {
    let pixels = u64::from(tags.size.0) * u64::from(tags.size.1);
    let bytes = |count: u64| usize::try_from(count).unwrap_or(usize::MAX);
    let mut limits = Limits::default();
    limits.decoding_buffer_size = bytes(memory.saturating_add(pixels.saturating_mul(8)));
    limits.intermediate_buffer_size = bytes(memory);
    limits.ifd_value_size = bytes(memory);
    limits
}

/// The JPEGs of strips and tiles, with the tables that they share.
pub(super) fn jpegs(decoder: &mut Decoder<Cursor<&[u8]>>, file: &[u8]) -> TiffResult<Vec<Vec<u8>>> {
    let tables = decoder.get_tag_u8_vec(Tag::JPEGTables).ok();
    let jpeg = |(offset, length): (u64, u64)| {
        let end = offset.saturating_add(length).min(file.len() as u64) as usize;
        let data = file.get(offset as usize..end).unwrap_or_default();
        match &tables {
            // Without the marker that they end with, and the one that the data begin with.
            Some(tables) if tables.len() >= 4 => {
                [&tables[..tables.len() - 2], data.get(2..).unwrap_or_default()].concat()
            }
            _ => data.to_vec(),
        }
    };
    Ok(strips(decoder)?.into_iter().map(jpeg).collect())
}
