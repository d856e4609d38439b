//! The Gaussians of a picture, for programs that render them by themselves.

use core::ptr;

use image_gip::Gaussian;

use crate::decoder::Decoder;
use crate::pointers;
use crate::status::{Failure, Status, guard};

/// One Gaussian of a picture. At a point whose squared Mahalanobis distance from the centre is q, it adds
/// the colour times the weight of q, which gip_info.cutoff tells, to gip_info.base_color.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CGaussian {
    /// Centre in pixels of the stored size: x to the right, y down. That of the first pixel is 0.5, 0.5.
    pub center: [f32; 2],
    /// The lower triangular Cholesky factor l11, l21, l22 of the covariance, in pixels of the stored size.
    pub cholesky: [f32; 3],
    /// Amplitude in each channel, where 1.0 is a full sample; may be negative. 0 in channels that the
    /// picture lacks.
    pub color: [f32; 4],
}

impl From<&Gaussian> for CGaussian {
    fn from(gaussian: &Gaussian) -> Self {
        let Gaussian { center, cholesky, color } = *gaussian;
        Self { center, cholesky, color }
    }
}

/// Copies the Gaussians that are decoded, from number `first` on and at most `count` of them, to
/// `gaussians`, in the order of the file. gip_info.decoded_gaussians has their number. `copied` is set to
/// how many were copied.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gip_decoder_gaussians(
    decoder: *const Decoder,
    first: usize,
    count: usize,
    gaussians: *mut CGaussian,
    copied: *mut usize,
) -> Status {
    guard(|| {
        // SAFETY: the caller passes a decoder.
        let state = unsafe { Decoder::of(decoder) }?.read()?;
        let found = state.input.stream().gaussians().get(first..).unwrap_or_default();
        let found: Vec<CGaussian> = found.iter().take(count).map(CGaussian::from).collect();
        if !found.is_empty() && (gaussians.is_null() || !gaussians.is_aligned()) {
            return Err(Failure::argument("gaussians is null or not aligned"));
        }
        if !found.is_empty() {
            // SAFETY: the caller passes memory for `count`, which are at least as many.
            unsafe { ptr::copy_nonoverlapping(found.as_ptr(), gaussians, found.len()) };
        }
        // SAFETY: the caller passes a place for the number.
        unsafe { pointers::store(copied, found.len(), "copied") }
    })
}
