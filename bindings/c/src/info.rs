//! What a decoder knows of its picture.

use image_gip::Kernel;

use crate::decoder::Decoder;
use crate::status::{Status, guard};
use crate::structures::{self, structure};

/// What is known of a picture.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Info {
    /// sizeof(gip_info).
    pub struct_size: usize,
    /// Width in pixels as stored, 1 to 2^20.
    pub width: u32,
    /// Height in pixels as stored, 1 to 2^20.
    pub height: u32,
    /// The channels: GIP_COLOR_GRAY, _GRAY_ALPHA, _RGB or _RGBA. This is also their number.
    pub color: u32,
    /// Bits of a sample of the picture that was encoded: 8 or 16.
    pub depth: u32,
    /// How the picture is turned for display, as a value of Exif: 1 (upright as stored) to 8; from 5 on,
    /// rows become columns. 0 if it is not known yet. It is always known when the first layer has arrived.
    pub orientation: u32,
    /// 1 if the whole file has been read, else 0.
    pub is_complete: u32,
    /// Gaussians in the whole file.
    pub gaussians: u32,
    /// Layers in the whole file.
    pub layers: u32,
    /// Gaussians that are decoded. Of a file in memory, gip_decoder_finish decodes all.
    pub decoded_gaussians: u32,
    /// Layers that are decoded.
    pub decoded_layers: u32,
    /// Parts so far that break a rule of the format and were skipped: see gip_decoder_skipped.
    pub skipped: u32,
    /// The version of the format, 1.
    pub version: u32,
    /// The colour that the Gaussians are added to, where 65535 is a full sample; 0 in channels that the
    /// picture lacks.
    pub base_color: [u16; 4],
    /// The kernel of the Gaussians, the weight at a squared Mahalanobis distance q: 0 for the usual one,
    /// (1 - q / 4)^2 up to q = 4; else exp(-q / 2) up to this q.
    pub cutoff: f32,
}

structure!(Info, "gip_info", cutoff: f32);

/// Fills `info`, whose struct_size is set. Fails with GIP_STATUS_NEED_MORE if the header has not arrived;
/// that of a file in memory always has.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gip_decoder_info(decoder: *const Decoder, info: *mut Info) -> Status {
    guard(|| {
        // SAFETY: the caller passes a decoder.
        let state = unsafe { Decoder::of(decoder) }?.read()?;
        // SAFETY: the caller passes a structure with its size.
        unsafe { structures::check(info) }?;
        let (header, stream) = (state.input.picture()?.header(), state.input.stream());
        let orientation = stream.orientation().map_or(0, |orientation| orientation.to_exif());
        let known = Info {
            struct_size: size_of::<Info>(),
            width: header.width,
            height: header.height,
            color: header.color.channels() as u32,
            depth: header.depth.bits().into(),
            orientation: orientation.into(),
            is_complete: stream.is_complete().into(),
            gaussians: header.gaussians,
            layers: header.layers.into(),
            decoded_gaussians: stream.gaussians().len() as u32,
            decoded_layers: stream.layers().len() as u32,
            skipped: stream.skipped().len() as u32,
            version: header.version.into(),
            base_color: header.base_color,
            cutoff: match header.kernel {
                Kernel::Exponential { cutoff } => cutoff,
                _ => 0.0,
            },
        };
        // SAFETY: the caller passes a structure with its size.
        unsafe { structures::write(info, known) }
    })
}
