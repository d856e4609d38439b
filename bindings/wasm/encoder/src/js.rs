//! What is called in JavaScript, and the encoder's errors there.

use image_gip::{EncodeError, LimitKind, Progress};
use wasm_bindgen::prelude::*;

#[wasm_bindgen(raw_module = "./encoder-calls.js")]
extern "C" {
    /// Hears of progress. `false` cancels.
    #[wasm_bindgen(js_name = progressed)]
    fn call_progressed(
        fraction: f64,
        iteration: u32,
        iterations: u32,
        gaussians: u32,
        psnr: f64,
    ) -> bool;

    /// Makes the error object of a kind.
    #[wasm_bindgen(js_name = encodeError)]
    fn new_error(kind: &str, message: &str) -> JsValue;

    /// Makes the error object for a limit, which is named as in `limits.js`.
    #[wasm_bindgen(js_name = limitError)]
    fn new_limit_error(message: &str, limit: &str, wanted: f64, allowed: f64) -> JsValue;

    /// Makes the object of a file and its report.
    #[wasm_bindgen(js_name = encoded)]
    pub(crate) fn new_encoded(
        file: &[u8],
        gaussians: u32,
        psnr: f64,
        quality: f64,
        texture_bytes: f64,
        iterations: u32,
        shortfall: Option<String>,
    ) -> JsValue;
}

/// Tells the caller of progress, and whether to go on.
pub(crate) fn progressed(progress: &Progress) -> bool {
    let Progress { fraction, iteration, iterations, gaussians, psnr, .. } = *progress;
    call_progressed(fraction, iteration, iterations, gaussians, psnr)
}

/// The exception for an error of the encoder.
pub(crate) fn exception(error: &EncodeError) -> JsValue {
    let message = error.to_string();
    let kind = match error {
        EncodeError::Source(_) | EncodeError::Option(_) => "request",
        EncodeError::Cancelled => "cancelled",
        EncodeError::Limit { kind, wanted, allowed } => {
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
        _ => "failed",
    };
    new_error(kind, &message)
}
