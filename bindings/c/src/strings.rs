//! Texts that callers have pointers to.

use core::ffi::c_char;

/// A text with a NUL at its end. A `CString` will not do: it is a box, and to move one ends what points into
/// it.
#[derive(Debug)]
pub(crate) struct CallersText(Vec<u8>);

impl CallersText {
    /// A NUL in the text, which the format has in none, would be its end.
    pub(crate) fn new(text: &str) -> Self {
        Self([text.as_bytes(), &[0]].concat())
    }

    /// Points to the text until it is dropped, wherever that is moved.
    pub(crate) fn as_ptr(&self) -> *const c_char {
        self.0.as_ptr().cast()
    }
}
