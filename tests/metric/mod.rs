//! SSIMULACRA2 of an independent implementation.

use fast_ssim2::{PixelDescriptor, PixelSlice, compute_ssimulacra2};

/// How much `found`, interleaved RGB of 8 bits, is like `source`, on a scale up to 100.
pub(crate) fn ssimulacra2(source: &[u8], found: &[u8], width: usize) -> f64 {
    let height = source.len() / (3 * width);
    let picture = |samples| {
        let descriptor = PixelDescriptor::RGB8_SRGB;
        PixelSlice::new(samples, width as u32, height as u32, 3 * width, descriptor)
            .expect("whole rows of pixels")
    };
    compute_ssimulacra2(&picture(source), &picture(found)).expect("two pictures of one size")
}
