//! The caller's memory for samples.

use core::ffi::c_void;
use core::{ptr, slice};

use image_gip::Picture;

use crate::decoder::Decoder;
use crate::pointers;
use crate::status::{Failure, Status, guard};
use crate::structures::{self, structure};
use crate::view::{Request, Samples, View};

/// What gip_render writes for a view.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Output {
    /// sizeof(gip_output).
    pub struct_size: usize,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// The channels, a gip_color other than GIP_COLOR_FILE, which is also their number.
    pub color: u32,
    /// The type of samples, a gip_samples other than GIP_SAMPLES_FILE.
    pub samples: u32,
    /// Bytes of a row without padding: the least stride.
    pub row_size: usize,
    /// Bytes of all rows without padding.
    pub size: usize,
}

structure!(Output, "gip_output", size: usize);

/// Fills `output`, whose struct_size is set, with the size of what gip_render writes for this view. It is
/// checked against the limits, so that it is safe to allocate. `view` may be null for the whole picture as
/// it is stored.
///
/// Fails with GIP_STATUS_NEED_MORE if the header has not arrived, GIP_STATUS_ARGUMENT for a view that is out
/// of range or does not suit the picture, and GIP_STATUS_LIMIT if it exceeds a limit.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gip_output_size(
    decoder: *const Decoder,
    view: *const View,
    output: *mut Output,
) -> Status {
    guard(|| {
        // SAFETY: the caller passes null or a view with its size.
        let view = unsafe { structures::read_or_default(view) }?;
        // SAFETY: the caller passes a decoder.
        let state = unsafe { Decoder::of(decoder) }?.read()?;
        // SAFETY: the caller passes a structure with its size.
        unsafe { structures::check(output) }?;
        let picture = state.input.picture()?;
        let request = view.request(picture.header())?;
        let shape = Shape::of(&request, &picture)?;
        let size = Output {
            struct_size: size_of::<Output>(),
            width: request.size.0,
            height: request.size.1,
            color: request.returned.channels() as u32,
            samples: request.samples as u32,
            row_size: shape.row * request.samples.bytes(),
            size: shape.row * shape.rows * request.samples.bytes(),
        };
        // SAFETY: the caller passes a structure with its size.
        unsafe { structures::write(output, size) }
    })
}

/// How many samples there are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape {
    /// Samples in a row.
    pub(crate) row: usize,
    /// Rows, those of all planes together.
    pub(crate) rows: usize,
}

impl Shape {
    /// That of the output for a request, after a check of the limits.
    pub(crate) fn of(request: &Request, picture: &Picture<'_>) -> Result<Self, Failure> {
        let rendered = picture.output_len(&request.options)?;
        let (width, height) = (request.size.0 as usize, request.size.1 as usize);
        let channels = request.returned.channels();
        // The output may have more channels than are rendered, if it is composed.
        let samples = (rendered / request.rendered.channels()).checked_mul(channels);
        let bytes = samples.and_then(|samples| samples.checked_mul(request.samples.bytes()));
        pointers::check_size(bytes, "the output")?;
        Ok(if request.samples == Samples::F32Planes {
            Self { row: width, rows: height * channels }
        } else {
            Self { row: width * channels, rows: height }
        })
    }

    /// How many samples there are.
    pub(crate) fn samples(self) -> usize {
        self.row * self.rows
    }
}

/// Rows of samples in the memory of a caller.
#[derive(Debug)]
pub(crate) struct Rows<T> {
    first: *mut T,
    /// Samples from a row to the next.
    stride: usize,
    shape: Shape,
}

impl<T> Rows<T> {
    /// Checks that so many bytes suffice for all rows.
    ///
    /// # Safety
    /// If `out` is not null, nobody else uses these bytes while the result exists, and `T` is a type of
    /// numbers.
    pub(crate) unsafe fn new(
        out: *mut c_void,
        stride: usize,
        size: usize,
        shape: Shape,
    ) -> Result<Self, Failure> {
        let first = out.cast::<T>();
        if first.is_null() || !first.is_aligned() {
            return Err(Failure::argument("the output is null or not aligned for its samples"));
        }
        let least = shape.row * size_of::<T>();
        let stride = if stride == 0 { least } else { stride };
        if stride < least || !stride.is_multiple_of(size_of::<T>()) {
            return Err(Failure::argument(format!(
                "stride {stride}; it must be a whole number of samples, and {least} bytes at least"
            )));
        }
        let wanted = stride.checked_mul(shape.rows - 1).and_then(|rows| rows.checked_add(least));
        let wanted = pointers::check_size(wanted, "the output")?;
        if size < wanted {
            let message = format!("an output of {size} bytes; {wanted} are needed");
            return Err(Failure::argument(message));
        }
        Ok(Self { first, stride: stride / size_of::<T>(), shape })
    }

    /// All samples, if no row has padding. They are 0.
    pub(crate) fn whole(&mut self) -> Option<&mut [T]> {
        if self.stride != self.shape.row && self.shape.rows > 1 {
            return None;
        }
        let samples = self.shape.samples();
        // SAFETY: `new` checked that so many samples are there; they are numbers, of which all may be 0.
        unsafe { ptr::write_bytes(self.first, 0, samples) };
        // SAFETY: they were set just now, and belong to `self`, which is borrowed.
        Some(unsafe { slice::from_raw_parts_mut(self.first, samples) })
    }

    /// The samples of a row. They are 0.
    pub(crate) fn row(&mut self, row: usize) -> &mut [T] {
        assert!(row < self.shape.rows, "row {row} is outside");
        // SAFETY: `new` checked that it is inside.
        let first = unsafe { self.first.add(row * self.stride) };
        // SAFETY: so is the whole row, of numbers, which may be 0.
        unsafe { ptr::write_bytes(first, 0, self.shape.row) };
        // SAFETY: they were set just now, and belong to `self`, which is borrowed.
        unsafe { slice::from_raw_parts_mut(first, self.shape.row) }
    }
}
