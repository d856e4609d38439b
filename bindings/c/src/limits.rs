//! What a file may cost at most.

use image_gip::Limits;

use crate::structures::structure;

/// What a decoder spends on a file at most, and what a file that is encoded may require of decoders. Each
/// limit is checked before the memory is allocated or the work is done. 0 is the default of each; the
/// largest number of its type is no limit. The defaults accept every ordinary picture, and bound what a
/// hostile file costs to a few hundred megabytes and a few seconds.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CLimits {
    /// sizeof(gip_limits).
    pub struct_size: usize,
    /// Largest width in pixels, of the file and of what is rendered. Default 65536.
    pub max_width: u32,
    /// Largest height in pixels, of the file and of what is rendered. Default 65536.
    pub max_height: u32,
    /// Most pixels, of the file and of what is rendered. Default 2^28.
    pub max_pixels: u64,
    /// Most bytes that the decoder and the renderer may hold at any time, without the output. Default 2^29.
    pub max_memory: u64,
    /// Most kernel evaluations in one rendering beyond 64 for each pixel that is rendered, which is more
    /// than ordinary pictures take. Default 2^32, a few seconds on one core.
    pub max_work: u64,
    /// Most Gaussians. Default 2^22.
    pub max_gaussians: u32,
}

structure!(CLimits, "gip_limits", max_gaussians: u32);

impl CLimits {
    pub(crate) fn limits(self) -> Limits {
        fn or<T: Default + PartialEq>(limit: T, default: T) -> T {
            if limit == T::default() { default } else { limit }
        }
        let default = Limits::default();
        let mut limits = default.clone();
        limits.max_width = or(self.max_width, default.max_width);
        limits.max_height = or(self.max_height, default.max_height);
        limits.max_pixels = or(self.max_pixels, default.max_pixels);
        limits.max_gaussians = or(self.max_gaussians, default.max_gaussians);
        limits.max_memory = or(self.max_memory, default.max_memory);
        limits.max_work = or(self.max_work, default.max_work);
        limits
    }
}
