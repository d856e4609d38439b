//! Encoding.

use core::ffi::c_void;

use image_gip::{
    Encoder, MetadataLoss, MetadataPolicy, Precision, Report, Shortfall, Target, Threads, Tune,
};

use crate::buffer::Buffer;
use crate::decoder;
use crate::limits::CLimits;
use crate::progress::{self, ProgressFn};
use crate::source::CSource;
use crate::status::{Failure, Status, guard};
use crate::structures::{self, structure};
use crate::threads;

/// What gip_encode_options.value is that a file has to meet.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CTarget {
    /// A picture that a person accepts without looking twice: a quality of 75. The value is not looked at.
    Auto = 0,
    /// A visual quality, 0 to 100, on the scale of SSIMULACRA2: about 50 is medium, 70 high, and from 90 on
    /// people see no difference. No more than 97 is aimed at.
    Quality = 1,
    /// At most so many bytes, a whole number from 1 to 2^30.
    Bytes = 2,
    /// At most so many bits per pixel, 1e-6 to 1e6.
    BitsPerPixel = 3,
    /// A PSNR of the decoded file without its texture in dB, 1 to 120.
    Psnr = 4,
    /// At most so many Gaussians, a whole number from 1 to 2^22.
    Gaussians = 5,
    /// A Lagrange multiplier, 0.01 to 1e6: the squared error that a bit must save, where samples are 0 to
    /// 255. All files of a set at the same one have the least error for their size.
    Lambda = 6,
}

/// What to minimize for the size of a file.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CTune {
    /// The error that a person sees.
    Visual = 0,
    /// The squared error, without texture.
    Psnr = 1,
}

/// How Gaussians are stored.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CPrecision {
    /// Entropy coding, for the smallest files.
    Entropy = 0,
    /// Codes of fixed bit depths.
    Packed = 1,
    /// The fitted values themselves, in files several times as large.
    F32 = 2,
}

/// What of the metadata of a source is stored.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CMetadataPolicy {
    /// All of it.
    All = 0,
    /// Profile, orientation, resolution, copyright, artist, description and dates. Position, maker notes,
    /// thumbnails, serial numbers, names of owners, comments and all else are dropped.
    Safe = 1,
    /// Nothing but codes of colours: cicp, mastering_display and content_light.
    None = 2,
}

/// Why a file does not meet its target. It comes as close as it can.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CShortfall {
    /// It meets it, within 1 % of a size, 0.05 dB of a PSNR and 1 of a quality.
    None = 0,
    /// The PSNR is below the target: this is what the effort and the precision reach.
    PsnrBelow = 1,
    /// The PSNR is above the target even with these few Gaussians.
    PsnrAbove = 2,
    /// The quality is below the target: this is what the effort and the precision reach.
    QualityBelow = 3,
    /// The quality is about the highest that is aimed at.
    QualityCapped = 4,
    /// The quality is above the target even with these few Gaussians.
    QualityAbove = 5,
    /// The file has no Gaussian, and is larger than the target all the same.
    SizeAbove = 6,
    /// A file of the target's size shows no better picture at this effort than this smaller one.
    SizeUseless = 7,
    /// The file is smaller: the picture needs no more, or the next Gaussian would not fit.
    SizeBelow = 8,
    /// The file is smaller, and the picture could be better, but this effort finds no use for more bytes.
    SizeUnused = 9,
    /// Another reason, of a later version of the library.
    Other = 10,
}

/// For gip_encode_options.flags: keeps colours where alpha is 0. By default what does not show takes the
/// colours around it: the file is smaller, and scaled pictures have no fringes.
pub const GIP_ENCODE_KEEP_INVISIBLE: u32 = 1;
/// For gip_encode_options.texture: no texture.
pub const GIP_TEXTURE_NONE: i32 = -1;

/// For gip_report.metadata_losses: a colour profile other than that of sRGB was dropped.
pub const GIP_LOSS_COLOR_PROFILE: u32 = 1;
/// An orientation other than upright was dropped.
pub const GIP_LOSS_ORIENTATION: u32 = 2;
/// The Exif data are damaged: what could be read of them is kept.
pub const GIP_LOSS_DAMAGED_EXIF: u32 = 4;
/// The XMP packet is damaged, and was dropped.
pub const GIP_LOSS_DAMAGED_XMP: u32 = 8;

/// How to encode. 0 in every field is the default. The file depends on the source and on these options
/// alone, not on threads.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct EncodeOptions {
    /// sizeof(gip_encode_options).
    pub struct_size: usize,
    /// What the file has to meet, a gip_target.
    pub target: u32,
    /// What to minimize, a gip_tune.
    pub tune: u32,
    /// The number that the target is about.
    pub value: f64,
    /// How much time to spend, 1 (least) to 7 (most); each takes twice as long as the one before. Default 4.
    pub effort: u32,
    /// How Gaussians are stored, a gip_precision.
    pub precision: u32,
    /// Strength of the texture, 1 to 100, or GIP_TEXTURE_NONE; default 50. It takes the place of fine
    /// irregular detail that the file has no bits for, such as sand, water and leaves.
    pub texture: i32,
    /// Most bytes of the file that the first layer makes, 80 to 65536: a placeholder, with which the whole
    /// file begins, and which gip_prefix cuts off. Default: a tenth of the file, about.
    pub first_layer: u32,
    /// The seed of all random numbers.
    pub seed: u64,
    /// Number of threads that work, 0 to 1024; 0 is 1. The calling thread waits for them, and they end
    /// before the call does.
    pub threads: u32,
    /// 0, or GIP_ENCODE_KEEP_INVISIBLE.
    pub flags: u32,
    /// What of the metadata is stored, a gip_metadata_policy.
    pub metadata_policy: u32,
    /// Those of the decoder that is to read the file: what it would refuse is not encoded. Null for the
    /// defaults, with which every decoder reads the file that is not told otherwise.
    pub limits: *const CLimits,
    /// What is called meanwhile; null for nothing.
    pub progress: ProgressFn,
    /// What it is called with.
    pub user: *mut c_void,
}

structure!(EncodeOptions, "gip_encode_options", user: *mut c_void);

/// What an encoding has achieved and cost.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CReport {
    /// sizeof(gip_report).
    pub struct_size: usize,
    /// PSNR in dB of the decoded file without its texture against the source, at the depth of the source;
    /// infinite for an exact copy.
    pub psnr: f64,
    /// The same of samples that are clamped but not rounded, as papers report it.
    pub psnr_float: f64,
    /// An estimate of the visual quality of the decoded file without its texture, 0 to 100: the score of
    /// SSIMULACRA2, within about 2.
    pub quality: f64,
    /// Wall-clock time in seconds.
    pub seconds: f64,
    /// Most bytes that the buffers of the encoder took at one time, without source and file.
    pub peak_memory: u64,
    /// Bytes of the texture in the file.
    pub texture_size: u64,
    /// Gaussians in the file, without those of the texture.
    pub gaussians: u32,
    /// Gaussians of the texture; 0 if there is none.
    pub texture_gaussians: u32,
    /// Iterations of training.
    pub iterations: u32,
    /// Why the file does not meet its target, a gip_shortfall.
    pub shortfall: u32,
    /// What of the metadata was dropped that may be missed: GIP_LOSS_COLOR_PROFILE and so on, combined by |.
    pub metadata_losses: u32,
}

structure!(CReport, "gip_report", metadata_losses: u32);

/// Encodes a picture. This is an optimization, and takes seconds.
///
/// `options` may be null for the defaults. `*file` is set to the file, to be freed with gip_buffer_free, or
/// to an empty buffer on failure; what it was before is not freed. `report` may be null; else its struct_size
/// is set, and it is filled. A target that cannot be met is no failure: gip_report.shortfall says why.
///
/// Fails with GIP_STATUS_ARGUMENT for a source or options that are out of range, and for a size that only
/// the metadata keep out of reach; GIP_STATUS_LIMIT if a decoder with these limits would refuse the file;
/// GIP_STATUS_CANCELLED, _MEMORY and _THREADS.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gip_encode(
    source: *const CSource,
    options: *const EncodeOptions,
    file: *mut Buffer,
    report: *mut CReport,
) -> Status {
    guard(|| {
        // SAFETY: the caller passes a buffer.
        unsafe { Buffer::clear(file) }?;
        // SAFETY: the caller passes a source with its size.
        let source = unsafe { structures::read(source) }?;
        // SAFETY: the caller passes null or options with their size.
        let options = unsafe { structures::read_or_default(options) }?;
        if !report.is_null() {
            // SAFETY: the caller passes null or a report with its size, which is checked before the work.
            unsafe { structures::write(report, CReport::EMPTY) }?;
        }
        // SAFETY: all that the source points to is there during the call.
        let mut picture = unsafe { source.picture() }?;
        let losses = options.policy()?.map_or(0, |policy| losses(&picture.metadata.retain(policy)));
        let metadata = core::mem::take(&mut picture.metadata);
        // SAFETY: the caller passes null or limits with their size.
        let limits = unsafe { decoder::limits(options.limits) }?;
        let encoder = options.encoder()?.with_metadata(metadata).with_limits(limits);
        let source = picture.source()?;
        let threads = threads::checked(options.threads)?;
        // SAFETY: the caller lets its function be called with this pointer.
        let encoded = unsafe {
            progress::encode(&encoder, &source, threads, options.progress, options.user)
        }?;
        if !report.is_null() {
            // SAFETY: it was checked before.
            unsafe { structures::write(report, CReport::of(&encoded.report, losses)) }?;
        }
        // SAFETY: the buffer was checked.
        unsafe { Buffer::fill(file, encoded.bytes) }
    })
}

impl EncodeOptions {
    fn encoder(&self) -> Result<Encoder, Failure> {
        if self.flags & !GIP_ENCODE_KEEP_INVISIBLE != 0 {
            return Err(Failure::argument(format!("flags {}; it has others", self.flags)));
        }
        let precision = match self.precision {
            precision if precision == CPrecision::Entropy as u32 => Precision::Entropy,
            precision if precision == CPrecision::Packed as u32 => Precision::Packed,
            precision if precision == CPrecision::F32 as u32 => Precision::Float,
            other => return Err(unknown("precision", other)),
        };
        let tune = match self.tune {
            tune if tune == CTune::Visual as u32 => Tune::Visual,
            tune if tune == CTune::Psnr as u32 => Tune::Psnr,
            other => return Err(unknown("tune", other)),
        };
        let first_layer = match self.first_layer {
            0 => None,
            bytes @ 80..=65_536 => Some(bytes),
            bytes => {
                let message = format!("first_layer {bytes}; it must be 0, or 80 to 65536");
                return Err(Failure::argument(message));
            }
        };
        let mut encoder = Encoder::new()
            .with_target(self.target()?)
            .with_tune(tune)
            .with_precision(precision)
            .with_first_layer(first_layer)
            .with_seed(self.seed)
            .with_keep_invisible(self.flags & GIP_ENCODE_KEEP_INVISIBLE != 0)
            // Those of the pool that it runs on.
            .with_threads(Threads::Pool);
        if self.effort != 0 {
            encoder = encoder.with_effort(u8::try_from(self.effort).unwrap_or(u8::MAX));
        }
        match self.texture {
            0 => {}
            GIP_TEXTURE_NONE => encoder = encoder.with_texture(0),
            1..=100 => encoder = encoder.with_texture(self.texture as u8),
            other => {
                let message = format!("texture {other}; it must be 0 to 100, or GIP_TEXTURE_NONE");
                return Err(Failure::argument(message));
            }
        }
        Ok(encoder)
    }

    fn target(&self) -> Result<Target, Failure> {
        let value = self.value;
        // The encoder refuses what is out of range, and names what a cast has left of it.
        let whole = || {
            let number = value as u32;
            if f64::from(number) == value {
                return Ok(number);
            }
            let message = format!("value {value}; it must be a positive whole number of 32 bits");
            Err(Failure::argument(message))
        };
        Ok(match self.target {
            target if target == CTarget::Auto as u32 => Target::Auto,
            target if target == CTarget::Quality as u32 => Target::Quality(value),
            target if target == CTarget::Bytes as u32 => Target::Bytes(whole()?.into()),
            target if target == CTarget::BitsPerPixel as u32 => Target::BitsPerPixel(value),
            target if target == CTarget::Psnr as u32 => Target::Psnr(value),
            target if target == CTarget::Gaussians as u32 => Target::Gaussians(whole()?),
            target if target == CTarget::Lambda as u32 => Target::Lambda(value),
            other => return Err(unknown("target", other)),
        })
    }

    /// What of the metadata is kept; `None` for all.
    fn policy(&self) -> Result<Option<MetadataPolicy>, Failure> {
        match self.metadata_policy {
            policy if policy == CMetadataPolicy::All as u32 => Ok(None),
            policy if policy == CMetadataPolicy::Safe as u32 => Ok(Some(MetadataPolicy::Safe)),
            policy if policy == CMetadataPolicy::None as u32 => Ok(Some(MetadataPolicy::None)),
            other => Err(unknown("metadata_policy", other)),
        }
    }
}

fn unknown(name: &str, value: u32) -> Failure {
    Failure::argument(format!("{name} {value} is none of gip_{name}"))
}

/// The flags of what was dropped.
fn losses(losses: &[MetadataLoss]) -> u32 {
    let flag = |loss: &MetadataLoss| match loss {
        MetadataLoss::ColorProfile => GIP_LOSS_COLOR_PROFILE,
        MetadataLoss::Orientation => GIP_LOSS_ORIENTATION,
        MetadataLoss::DamagedExif => GIP_LOSS_DAMAGED_EXIF,
        MetadataLoss::DamagedXmp => GIP_LOSS_DAMAGED_XMP,
        // Of XMP that is in two, which no file has.
        _ => 0,
    };
    losses.iter().map(flag).fold(0, |all, flag| all | flag)
}

impl CReport {
    const EMPTY: Self = Self {
        struct_size: 0,
        psnr: 0.0,
        psnr_float: 0.0,
        quality: 0.0,
        seconds: 0.0,
        peak_memory: 0,
        texture_size: 0,
        gaussians: 0,
        texture_gaussians: 0,
        iterations: 0,
        shortfall: 0,
        metadata_losses: 0,
    };

    fn of(report: &Report, metadata_losses: u32) -> Self {
        Self {
            struct_size: size_of::<Self>(),
            psnr: report.psnr,
            psnr_float: report.psnr_float,
            quality: report.quality,
            seconds: report.seconds,
            peak_memory: report.peak_memory,
            texture_size: report.texture_bytes,
            gaussians: report.gaussians,
            texture_gaussians: report.texture_gaussians,
            iterations: report.iterations,
            shortfall: CShortfall::of(report.shortfall) as u32,
            metadata_losses,
        }
    }
}

impl CShortfall {
    fn of(shortfall: Option<Shortfall>) -> Self {
        match shortfall {
            None => Self::None,
            Some(Shortfall::PsnrBelow { .. }) => Self::PsnrBelow,
            Some(Shortfall::PsnrAbove { .. }) => Self::PsnrAbove,
            Some(Shortfall::QualityBelow { .. }) => Self::QualityBelow,
            Some(Shortfall::QualityCapped { .. }) => Self::QualityCapped,
            Some(Shortfall::QualityAbove { .. }) => Self::QualityAbove,
            Some(Shortfall::SizeAbove { .. }) => Self::SizeAbove,
            Some(Shortfall::SizeUseless { .. }) => Self::SizeUseless,
            Some(Shortfall::SizeBelow { .. }) => Self::SizeBelow,
            Some(Shortfall::SizeUnused { .. }) => Self::SizeUnused,
            Some(_) => Self::Other,
        }
    }
}
