//! Rendering to typed arrays, in strips.

use image_gip::{DecodeError, Orientation, Picture, RenderOptions};
use wasm_bindgen::JsValue;

use crate::js::{Uint8ClampedArray, Uint16Array};
use crate::request::Request;

/// Most pixels that are rendered in one go. WebAssembly's memory never shrinks, so that a large
/// output is rendered in strips and copied out.
const STRIP_PIXELS: u64 = 1 << 22;

/// A sample, 0 to its largest value.
pub(crate) trait Sample: Copy + Default {
    /// The typed array of such samples.
    type Array: Into<JsValue>;

    /// Renders to a slice of the right length.
    fn render(
        picture: &Picture<'_>,
        options: &RenderOptions,
        out: &mut [Self],
    ) -> Result<(), DecodeError>;

    /// A new array.
    fn allocate(length: u32) -> Self::Array;

    /// Copies to the array at an index.
    fn copy(array: &Self::Array, at: u32, samples: &[Self]);
}

macro_rules! sample {
    ($sample:ty, $render:ident, $array:ident) => {
        impl Sample for $sample {
            type Array = $array;

            fn render(
                picture: &Picture<'_>,
                options: &RenderOptions,
                out: &mut [Self],
            ) -> Result<(), DecodeError> {
                picture.$render(options, out)
            }

            fn allocate(length: u32) -> $array {
                $array::new(length)
            }

            fn copy(array: &$array, at: u32, samples: &[Self]) {
                array.set(samples, at);
            }
        }
    };
}

sample!(u8, render_u8, Uint8ClampedArray);
sample!(u16, render_u16, Uint16Array);

/// The rows of a strip of a request, and the number of strips.
pub(crate) fn strips(request: &Request) -> (u32, u32) {
    let rows = (STRIP_PIXELS / u64::from(request.region.width).max(1)).clamp(1, u32::MAX.into());
    let rows = rows as u32;
    (rows, request.region.height.div_ceil(rows))
}

/// Renders a request.
pub(crate) fn render<T: Sample>(
    picture: &Picture<'_>,
    request: &Request,
) -> Result<T::Array, DecodeError> {
    let length = picture.output_len(&request.options()?)?;
    let out = T::allocate(length as u32);
    let (rows, _) = strips(request);
    let mut samples = Vec::new();
    let mut at = 0;
    for first in (0..request.region.height).step_by(rows as usize) {
        let strip = request.rows(first, rows.min(request.region.height - first));
        let options = strip.options()?;
        samples.resize(picture.output_len(&options)?, T::default());
        T::render(picture, &options, &mut samples)?;
        if strip.orientation == Orientation::NoTransforms {
            T::copy(&out, at, &samples);
        } else {
            let (columns, _) = options.output_size(picture.header());
            let channels = strip.color.channels();
            T::copy(&out, at, &strip.orientation.apply(&samples, columns as usize, channels));
        }
        at += samples.len() as u32;
    }
    Ok(out)
}
