//! The decoder object: bytes that arrive in pieces, or a file in memory.

use core::ffi::{c_char, c_void};
use core::{ptr, slice};
use std::io::{self, Read};
use std::sync::{RwLock, RwLockReadGuard, RwLockWriteGuard};

use image_gip::{DecodeError, Limits, Metadata, Picture, RenderOptions, StreamDecoder, Threads};

use crate::limits::CLimits;
use crate::metadata::Texts;
use crate::status::{Failure, Status, guard};
use crate::strings::CallersText;
use crate::{pointers, structures, threads};

/// A decoder of one file. Several threads may call functions with the same decoder at the same time, but
/// for gip_decoder_free. They wait for each other, except that a decoder which is fed renders for all of
/// them at once.
#[derive(Debug)]
pub struct Decoder(RwLock<State>);

#[derive(Debug)]
pub(crate) struct State {
    pub(crate) input: Input,
    /// What the caller has pointers to.
    pub(crate) texts: Texts,
    warnings: Vec<CallersText>,
    /// What was wrong with the file when it was read last.
    failure: Option<Failure>,
}

#[derive(Debug)]
pub(crate) enum Input {
    /// The file arrives in pieces.
    Fed(StreamDecoder),
    /// The file is in the caller's memory.
    Memory(image_gip::Decoder<Bytes>),
}

/// What is still to be read of a file in the caller's memory. It is no slice, so that a decoder may be freed
/// after the file.
#[derive(Debug)]
pub(crate) struct Bytes {
    next: *const u8,
    size: usize,
}

// SAFETY: the caller of gip_decoder_open lets the library read the bytes, on any thread.
unsafe impl Send for Bytes {}
// SAFETY: a shared reference gives no access to the bytes.
unsafe impl Sync for Bytes {}

impl Read for Bytes {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let length = buffer.len().min(self.size);
        if length == 0 {
            return Ok(0);
        }
        // SAFETY: the caller of gip_decoder_open leaves the file alone while it uses the decoder, so this
        // many bytes are there.
        let bytes = unsafe { slice::from_raw_parts(self.next, length) };
        buffer[..length].copy_from_slice(bytes);
        // SAFETY: the end of the bytes is the furthest that this gets.
        self.next = unsafe { self.next.add(length) };
        self.size -= length;
        Ok(length)
    }
}

impl Input {
    /// The push decoder, which is inside of the other one as well.
    pub(crate) fn stream(&self) -> &StreamDecoder {
        match self {
            Self::Fed(stream) => stream,
            Self::Memory(decoder) => decoder.stream(),
        }
    }

    /// The picture of the Gaussians that are decoded.
    pub(crate) fn picture(&self) -> Result<Picture<'_>, Failure> {
        self.stream()
            .picture()
            .ok_or_else(|| Failure::new(Status::NeedMore, "the header has not arrived yet"))
    }

    pub(crate) fn metadata(&self) -> &Metadata {
        self.stream().metadata()
    }
}

impl State {
    /// What reading or decoding comes to. Where the crate says no more than that it has failed before, this says
    /// again how.
    pub(crate) fn told<T>(&mut self, result: Result<T, DecodeError>) -> Result<T, Failure> {
        result.map_err(|error| match (&self.failure, error) {
            (Some(before), DecodeError::AlreadyFailed) => before.clone(),
            (_, error) => self.failure.insert(error.into()).clone(),
        })
    }

    /// Refuses a file in memory that was found to be damaged: what is before the damage is not all of it.
    pub(crate) fn check(&self) -> Result<(), Failure> {
        use Status::{Malformed, UnexpectedEnd, Unsupported};

        match &self.failure {
            Some(failure) if matches!(failure.status, Malformed | UnexpectedEnd | Unsupported) => {
                Err(failure.clone())
            }
            _ => Ok(()),
        }
    }

    /// Reads and decodes what is left of a file in memory; of one that is fed, tells whether it is complete.
    fn finish(&mut self, threads: Threads) -> Result<(), Failure> {
        let finished = match &mut self.input {
            Input::Fed(stream) => stream.finish(),
            Input::Memory(decoder) => {
                decoder.set_options(RenderOptions::new().with_threads(threads));
                decoder.read_to_end()
            }
        };
        self.told(finished)
    }
}

impl Decoder {
    /// Hands a new decoder to the caller.
    ///
    /// # Safety
    /// `to` points to memory for a pointer.
    unsafe fn hand_over(to: *mut *mut Self, input: Input) -> Result<(), Failure> {
        let state = State { input, texts: Texts::default(), warnings: Vec::new(), failure: None };
        let decoder = Box::into_raw(Box::new(Self(RwLock::new(state))));
        // SAFETY: the same contract.
        unsafe { pointers::store(to, decoder, "the place for the decoder") }
    }

    /// The decoder of a caller.
    ///
    /// # Safety
    /// The pointer is null, or a decoder that is not freed during `'a`.
    pub(crate) unsafe fn of<'a>(decoder: *const Self) -> Result<&'a Self, Failure> {
        // SAFETY: the same contract; all that changes is behind a lock.
        unsafe { pointers::shared(decoder, "the decoder") }
    }

    pub(crate) fn read(&self) -> Result<RwLockReadGuard<'_, State>, Failure> {
        self.0.read().map_err(|_| poisoned())
    }

    pub(crate) fn write(&self) -> Result<RwLockWriteGuard<'_, State>, Failure> {
        self.0.write().map_err(|_| poisoned())
    }
}

fn poisoned() -> Failure {
    Failure::new(Status::Internal, "an earlier call with this decoder has ended in a bug")
}

/// The limits of a caller.
///
/// # Safety
/// As of [`structures::read`].
pub(crate) unsafe fn limits(limits: *const CLimits) -> Result<Limits, Failure> {
    // SAFETY: the same contract.
    unsafe { structures::read_or_default(limits) }.map(CLimits::limits)
}

/// Makes a decoder for a file that arrives in pieces: see gip_decoder_feed.
///
/// `limits` may be null for the defaults. `*decoder` is set to the new decoder, to be freed with
/// gip_decoder_free, or to null on failure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gip_decoder_new(
    limits: *const CLimits,
    decoder: *mut *mut Decoder,
) -> Status {
    guard(|| {
        // SAFETY: the caller passes a place for a pointer.
        unsafe { pointers::store(decoder, ptr::null_mut(), "the place for the decoder") }?;
        // SAFETY: the caller passes null or limits with their size.
        let limits = unsafe { self::limits(limits) }?;
        let stream = StreamDecoder::new().with_limits(limits);
        // SAFETY: the place was checked.
        unsafe { Decoder::hand_over(decoder, Input::Fed(stream)) }
    })
}

/// Makes a decoder for a whole file of `size` bytes in memory, and reads it up to its first layer. This is
/// the fast way: several threads decode layers, those that do not show in a region are skipped, and for
/// gip_view.gaussians no more is read than these take.
///
/// The bytes are not copied: they must remain as they are until the last use of the decoder before
/// gip_decoder_free. `limits` may be null for the defaults. `*decoder` is set to the new decoder, or to null
/// on failure: for a file that is damaged before its first layer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gip_decoder_open(
    data: *const c_void,
    size: usize,
    limits: *const CLimits,
    decoder: *mut *mut Decoder,
) -> Status {
    guard(|| {
        // SAFETY: the caller passes a place for a pointer.
        unsafe { pointers::store(decoder, ptr::null_mut(), "the place for the decoder") }?;
        // SAFETY: the caller passes null or limits with their size.
        let limits = unsafe { self::limits(limits) }?;
        // SAFETY: the caller passes so many bytes, and leaves them alone.
        unsafe { pointers::bytes(data, size, "data") }?;
        let file = Bytes { next: data.cast(), size };
        let file = image_gip::Decoder::new_with_limits(file, limits)?;
        // SAFETY: the place was checked.
        unsafe { Decoder::hand_over(decoder, Input::Memory(file)) }
    })
}

/// Frees a decoder, and all that its functions have pointed to. Null is left alone.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gip_decoder_free(decoder: *mut Decoder) {
    guard(|| {
        if !decoder.is_null() {
            // SAFETY: it was a box until `hand_over`, and the caller frees it once.
            drop(unsafe { Box::from_raw(decoder) });
        }
        Ok(())
    });
}

/// Takes the next `size` bytes of a file, of which there may be any number, and copies what it needs of
/// them. Every layer is decoded as soon as its last byte has arrived, on this thread; gip_render shows what
/// has arrived.
///
/// `used` may be null; else it is set to how many of the bytes belong to the file: all, unless the file ends
/// within them; 0 on failure. After a failure for what the file is (GIP_STATUS_SIGNATURE, _MALFORMED, _UNSUPPORTED,
/// _LIMIT) the decoder takes no more bytes and fails again in the same way, but gip_render still shows the
/// Gaussians before the error.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gip_decoder_feed(
    decoder: *mut Decoder,
    data: *const c_void,
    size: usize,
    used: *mut usize,
) -> Status {
    guard(|| {
        // SAFETY: the caller passes a decoder.
        let mut state = unsafe { Decoder::of(decoder) }?.write()?;
        let Input::Fed(stream) = &mut state.input else {
            return Err(Failure::argument("the decoder of a file in memory takes no other bytes"));
        };
        // SAFETY: the caller passes so many bytes.
        let bytes = unsafe { pointers::bytes(data, size, "data") }?;
        let fed = stream.feed(bytes);
        if !used.is_null() {
            // SAFETY: the caller passes a place for the number.
            unsafe { pointers::store(used, *fed.as_ref().unwrap_or(&0), "used") }?;
        }
        state.told(fed).map(|_| ())
    })
}

/// Says that the file is all there. Fails with GIP_STATUS_UNEXPECTED_END if it is not.
///
/// Of a file in memory, this reads all that is left, on `threads` threads as in gip_view, and keeps it
/// decoded: renderings of many regions, one after the other, are faster then. Where the file is damaged, it
/// fails, and gip_decoder_feed of another decoder gives what can be shown of it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gip_decoder_finish(decoder: *mut Decoder, threads: u32) -> Status {
    guard(|| {
        let count = threads::checked(threads)?;
        // SAFETY: the caller passes a decoder.
        let mut state = unsafe { Decoder::of(decoder) }?.write()?;
        let state = &mut *state;
        if let Input::Memory(_) = state.input {
            state.check()?;
        }
        threads::decoding(count, |threads| state.finish(threads))?
    })
}

/// Sets `*gaussians` to how many Gaussians suffice for a preview with this size of the whole output in
/// pixels, which is a value for gip_view.gaussians: a sixth of all where that is one for 16 pixels, and all
/// otherwise. Fails with GIP_STATUS_NEED_MORE if the header has not arrived.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gip_decoder_gaussians_for(
    decoder: *const Decoder,
    width: u32,
    height: u32,
    gaussians: *mut u32,
) -> Status {
    guard(|| {
        // SAFETY: the caller passes a decoder.
        let state = unsafe { Decoder::of(decoder) }?.read()?;
        pointers::check(gaussians, "gaussians")?;
        let enough = state.input.picture()?.header().gaussians_for(width, height);
        // SAFETY: the caller passes a place for the number.
        unsafe { pointers::store(gaussians, enough, "gaussians") }
    })
}

/// Returns what was wrong with part number `index` of those that break a rule of the format, and were
/// skipped because the picture can be shown without them, such as a second ICC profile. It is an English
/// text in UTF-8 for people, or null if there are no more. gip_info.skipped has their number, at most 16.
/// The text is valid until the decoder is fed or freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gip_decoder_skipped(decoder: *mut Decoder, index: usize) -> *const c_char {
    let mut found = ptr::null();
    guard(|| {
        // SAFETY: the caller passes a decoder.
        let mut state = unsafe { Decoder::of(decoder) }?.write()?;
        let State { input, warnings, .. } = &mut *state;
        // Those that were handed out stay where they are.
        for skipped in &input.stream().skipped()[warnings.len()..] {
            warnings.push(CallersText::new(&skipped.to_string()));
        }
        found = warnings.get(index).map_or(ptr::null(), CallersText::as_ptr);
        Ok(())
    });
    found
}
