//! Small files that are the beginning of large ones.

use core::ffi::c_void;

use image_gip::Prefixes;

use crate::buffer::Buffer;
use crate::pointers;
use crate::status::{Failure, Status, guard};

/// Makes a small file of the first layers of another one: of as many as fit `most` bytes. It keeps what says
/// how the picture is shown, its colours and its orientation; texture and other metadata are left out.
/// Nothing is decoded.
///
/// `data` is a file of `size` bytes, or the beginning of one. `*prefix` is set to the small file, to be freed
/// with gip_buffer_free, or to an empty buffer on failure: GIP_STATUS_ARGUMENT if the file of the first
/// layer has more than `most` bytes, GIP_STATUS_NEED_MORE if no layer is complete, and else what
/// gip_decoder_feed says of a damaged file.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gip_prefix(
    data: *const c_void,
    size: usize,
    most: usize,
    prefix: *mut Buffer,
) -> Status {
    guard(|| {
        // SAFETY: the caller passes a buffer.
        unsafe { Buffer::clear(prefix) }?;
        // SAFETY: the caller passes so many bytes.
        let file = unsafe { pointers::bytes(data, size, "data") }?;
        let prefixes = Prefixes::new(file).map_err(|error| {
            let incomplete = error.is_unexpected_end();
            let failure = Failure::from(error);
            if incomplete { Failure { status: Status::NeedMore, ..failure } } else { failure }
        })?;
        let Some(first) = prefixes.iter().next() else {
            return Err(Failure::new(Status::NeedMore, "the file has no complete layer"));
        };
        let Some(longest) = prefixes.within(most) else {
            let least = first.bytes;
            return Err(Failure::argument(format!(
                "the file of the first layer has {least} bytes, and {most} are allowed"
            )));
        };
        // SAFETY: the buffer was checked.
        unsafe { Buffer::fill(prefix, prefixes.file(longest)) }
    })
}
