//! The crate's errors as those of `js/errors.js`.

use image_gip::{DecodeError, LimitKind};
use wasm_bindgen::prelude::*;

#[wasm_bindgen(raw_module = "./errors.js")]
extern "C" {
    /// Makes the error object of a kind.
    #[wasm_bindgen(js_name = decodeError)]
    fn new_error(kind: &str, message: &str, chunk: Option<String>) -> JsValue;

    /// Makes the error object for a limit, which is named as in `js/limits.js`.
    #[wasm_bindgen(js_name = limitError)]
    fn new_limit_error(message: &str, limit: &str, wanted: f64, allowed: f64) -> JsValue;
}

/// The exception for an error of the decoder.
pub(crate) fn exception(error: &DecodeError) -> JsValue {
    let message = error.to_string();
    let (kind, chunk) = match error {
        DecodeError::Signature => ("signature", None),
        DecodeError::Malformed { chunk, .. } => ("malformed", Some(chunk)),
        DecodeError::Unsupported { chunk, .. } => ("unsupported", Some(chunk)),
        DecodeError::UnexpectedEnd { chunk } => ("unexpected-end", chunk.as_ref()),
        DecodeError::Limit { kind, wanted, allowed } => {
            let limit = match kind {
                LimitKind::Width => "width",
                LimitKind::Height => "height",
                LimitKind::Pixels => "pixels",
                LimitKind::Gaussians => "gaussians",
                LimitKind::Memory => "memory",
                LimitKind::Work => "work",
                _ => "unknown",
            };
            return new_limit_error(&message, limit, *wanted as f64, *allowed as f64);
        }
        DecodeError::Request(_) => ("request", None),
        _ => ("failed", None),
    };
    new_error(kind, &message, chunk.map(|chunk| chunk.letters().to_string()))
}

/// The exception for an output with more pixels than this decoder may render at once.
pub(crate) fn too_many_pixels(wanted: u64, allowed: u64) -> JsValue {
    let message =
        format!("limit exceeded: pixels of one rendering: {wanted} required, {allowed} allowed");
    new_limit_error(&message, "outputPixels", wanted as f64, allowed as f64)
}
