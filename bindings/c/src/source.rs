//! The picture to encode.

use core::ffi::c_void;

use image_gip::{ColorModel, EncodeError, Metadata, Source};

use crate::metadata::CMetadata;
use crate::pointers;
use crate::status::{Failure, Status};
use crate::structures::{self, structure};
use crate::view::{self, Samples};

/// A picture to encode. The library copies nothing of it but for rows with padding and floats; all that it
/// points to must remain as it is during the call.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CSource {
    /// sizeof(gip_source).
    pub struct_size: usize,
    /// Width in pixels, 1 to 2^20.
    pub width: u32,
    /// Height in pixels, 1 to 2^20.
    pub height: u32,
    /// The channels, a gip_color other than GIP_COLOR_FILE.
    pub color: u32,
    /// The type of samples: GIP_SAMPLES_U8, _U16, or _F32, whose values are 0 to 1 and which are stored as
    /// pictures of 16 bits.
    pub samples: u32,
    /// The samples: rows from the top, aligned for their type.
    pub pixels: *const c_void,
    /// Bytes from a row to the next, a whole number of samples; 0 stands for rows without padding.
    pub stride: usize,
    /// Bytes of all rows; the last one needs no padding.
    pub size: usize,
    /// What to store with the picture; null for nothing.
    pub metadata: *const CMetadata,
}

structure!(CSource, "gip_source", metadata: *const CMetadata);

/// Samples of a picture, without padding.
#[derive(Debug)]
pub(crate) enum Pixels<'a> {
    U8(&'a [u8]),
    U16(&'a [u16]),
    CopyU8(Vec<u8>),
    CopyU16(Vec<u16>),
}

/// A picture whose samples were found.
#[derive(Debug)]
pub(crate) struct Picture<'a> {
    width: u32,
    height: u32,
    color: ColorModel,
    pixels: Pixels<'a>,
    pub(crate) metadata: Metadata,
}

impl Picture<'_> {
    pub(crate) fn source(&self) -> Result<Source<'_>, EncodeError> {
        let Self { width, height, color, .. } = *self;
        Ok(match &self.pixels {
            Pixels::U8(samples) => Source::new_u8(width, height, color, samples)?,
            Pixels::CopyU8(samples) => Source::new_u8(width, height, color, samples)?,
            Pixels::U16(samples) => Source::new_u16(width, height, color, samples)?,
            Pixels::CopyU16(samples) => Source::new_u16(width, height, color, samples)?,
        })
    }
}

impl CSource {
    /// # Safety
    /// All that it points to is there, and remains as it is during `'a`.
    pub(crate) unsafe fn picture<'a>(&self) -> Result<Picture<'a>, Failure> {
        let color = view::color_model(self.color)?;
        let color = color.ok_or_else(|| Failure::argument("the source has no color"))?;
        let row = u64::from(self.width) * color.channels() as u64;
        let row = usize::try_from(row).map_err(|_| Failure::argument("width is out of range"))?;
        let of = |samples: Samples| self.samples == samples as u32;
        let pixels = if of(Samples::U8) {
            // SAFETY: the same contract.
            match unsafe { self.rows::<u8>(row) }? {
                Rows::Whole(samples) => Pixels::U8(samples),
                rows => Pixels::CopyU8(rows.copied(Ok)?),
            }
        } else if of(Samples::U16) {
            // SAFETY: the same contract.
            match unsafe { self.rows::<u16>(row) }? {
                Rows::Whole(samples) => Pixels::U16(samples),
                rows => Pixels::CopyU16(rows.copied(Ok)?),
            }
        } else if of(Samples::F32) {
            // SAFETY: the same contract.
            Pixels::CopyU16(unsafe { self.rows::<f32>(row) }?.copied(from_unit)?)
        } else {
            let message = format!("samples {} of a source; see gip_source", self.samples);
            return Err(Failure::argument(message));
        };
        let metadata = if self.metadata.is_null() {
            Metadata::default()
        } else {
            // SAFETY: the same contract.
            let metadata = unsafe { structures::read(self.metadata) }?;
            // SAFETY: the same contract.
            unsafe { metadata.copied() }?
        };
        Ok(Picture { width: self.width, height: self.height, color, pixels, metadata })
    }

    /// The rows, with so many samples each.
    ///
    /// # Safety
    /// As of [`CSource::picture`]; `T` is a type of numbers.
    unsafe fn rows<'a, T>(&self, row: usize) -> Result<Rows<'a, T>, Failure> {
        if self.width == 0 || self.height == 0 {
            return Err(Failure::argument("the source has no pixels"));
        }
        let least = pointers::check_size(row.checked_mul(size_of::<T>()), "the source")?;
        let stride = if self.stride == 0 { least } else { self.stride };
        if stride < least || !stride.is_multiple_of(size_of::<T>()) {
            return Err(Failure::argument(format!(
                "stride {stride}; it must be a whole number of samples, and {least} bytes at least"
            )));
        }
        let rows = stride.checked_mul(self.height as usize - 1);
        let wanted = rows.and_then(|rows| rows.checked_add(least));
        let wanted = pointers::check_size(wanted, "the source")?;
        if self.size < wanted {
            let message = format!("a source of {} bytes; {wanted} are needed", self.size);
            return Err(Failure::argument(message));
        }
        let count = wanted / size_of::<T>();
        // SAFETY: the caller passes at least so many bytes.
        let samples = unsafe { pointers::elements(self.pixels.cast::<T>(), count, "pixels") }?;
        let stride = stride / size_of::<T>();
        Ok(if stride == row || self.height == 1 {
            Rows::Whole(samples)
        } else {
            Rows::Padded { samples, row, stride }
        })
    }
}

/// The rows of a picture.
enum Rows<'a, T> {
    Whole(&'a [T]),
    Padded { samples: &'a [T], row: usize, stride: usize },
}

impl<T: Copy> Rows<'_, T> {
    /// A copy without padding, of what becomes of each sample.
    fn copied<U>(self, convert: impl Fn(T) -> Result<U, Failure>) -> Result<Vec<U>, Failure> {
        let (samples, row, stride) = match self {
            Self::Whole(samples) => (samples, samples.len(), samples.len()),
            Self::Padded { samples, row, stride } => (samples, row, stride),
        };
        let mut copy = Vec::new();
        copy.try_reserve_exact(samples.len().div_ceil(stride) * row).map_err(|_| {
            Failure::new(Status::Memory, "there is no memory for a copy of the source")
        })?;
        for samples in samples.chunks(stride) {
            for &sample in &samples[..row] {
                copy.push(convert(sample)?);
            }
        }
        Ok(copy)
    }
}

/// The 16-bit sample of a float, of which 1.0 is a full one.
fn from_unit(value: f32) -> Result<u16, Failure> {
    if !(0.0..=1.0).contains(&value) {
        return Err(Failure::argument(format!("a float of the source is {value}, not 0 to 1")));
    }
    Ok((value * 65535.0 + 0.5) as u16)
}
