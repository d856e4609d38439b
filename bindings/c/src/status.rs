//! How a call ends: its status, and a text for people.

use core::cell::RefCell;
use core::ffi::{CStr, c_char};
use std::ffi::CString;
use std::panic::{AssertUnwindSafe, catch_unwind};

use image_gip::{DecodeError, EncodeError, OptionError};

/// How a call has ended. gip_last_error says more about a failure.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// It has done what it is for.
    Ok = 0,
    /// An argument is null, out of range, or does not fit the others or the picture. Nothing was done.
    Argument = 1,
    /// The bytes are not those of a .gip file.
    Signature = 2,
    /// The file breaks a rule of the format.
    Malformed = 3,
    /// The file requires something that this library does not have, such as a later version of the format.
    Unsupported = 4,
    /// The file ends too early.
    UnexpectedEnd = 5,
    /// The file or the output requires more than a limit allows.
    Limit = 6,
    /// The bytes so far do not suffice: call again after gip_decoder_feed.
    NeedMore = 7,
    /// The callback has cancelled the encoding.
    Cancelled = 8,
    /// There is no memory for a copy of the samples.
    Memory = 9,
    /// The threads could not be started.
    Threads = 10,
    /// The library has an error of its own. The objects of the call can only be freed.
    Internal = 11,
}

/// Why a call fails.
#[derive(Clone, Debug)]
pub(crate) struct Failure {
    pub(crate) status: Status,
    pub(crate) message: String,
}

impl Failure {
    pub(crate) fn new(status: Status, message: impl Into<String>) -> Self {
        Self { status, message: message.into() }
    }

    /// The failure of an argument.
    pub(crate) fn argument(message: impl Into<String>) -> Self {
        Self::new(Status::Argument, message)
    }
}

impl From<DecodeError> for Failure {
    fn from(error: DecodeError) -> Self {
        let status = match error {
            DecodeError::Signature => Status::Signature,
            DecodeError::Malformed { .. } => Status::Malformed,
            DecodeError::Unsupported { .. } => Status::Unsupported,
            DecodeError::UnexpectedEnd { .. } => Status::UnexpectedEnd,
            DecodeError::Limit { .. } => Status::Limit,
            DecodeError::Request(_) => Status::Argument,
            _ => Status::Internal,
        };
        Self::new(status, error.to_string())
    }
}

impl From<EncodeError> for Failure {
    fn from(error: EncodeError) -> Self {
        let status = match error {
            EncodeError::Option(OptionError::Threads(_)) => Status::Threads,
            EncodeError::Source(_) | EncodeError::Option(_) => Status::Argument,
            EncodeError::Limit { .. } => Status::Limit,
            EncodeError::Cancelled => Status::Cancelled,
            _ => Status::Internal,
        };
        Self::new(status, error.to_string())
    }
}

thread_local! {
    static LAST_ERROR: RefCell<CString> = RefCell::default();
}

/// Returns what was wrong in the last call of this thread that has failed, as an English text in UTF-8 for
/// people; an empty text if none has. It is valid until the next call of this thread that fails. The texts
/// may change in any release.
#[unsafe(no_mangle)]
pub extern "C" fn gip_last_error() -> *const c_char {
    let text = LAST_ERROR.try_with(|last| last.try_borrow().map(|last| last.as_ptr()));
    // A thread that ends has no texts any more.
    text.ok().and_then(Result::ok).unwrap_or(CStr::as_ptr(c""))
}

/// Runs the body of a function of the library: remembers the text of a failure, and turns a panic into one.
pub(crate) fn guard(body: impl FnOnce() -> Result<(), Failure>) -> Status {
    // What a panic leaves behind is freed, or refused by a lock that it poisons.
    let result = catch_unwind(AssertUnwindSafe(body)).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<&str>().copied();
        let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
        Err(Failure::new(Status::Internal, format!("a bug: {}", text.unwrap_or("a panic"))))
    });
    let Err(Failure { status, message }) = result else { return Status::Ok };
    let message = CString::new(message.replace('\0', "\u{FFFD}")).unwrap_or_default();
    // Where the thread ends, nobody can ask.
    let _ = LAST_ERROR.try_with(|last| last.replace(message));
    status
}
