//! A picture in the memory of the GPU.

use std::sync::Arc;

use image_gip::{DecodeError, Gaussian, Header, Kernel, Picture, RenderOptions};

use super::device::{buffer, check, checked};
use super::error::RenderError;
use super::wgpu::{self, BufferUsages};
use crate::view::{Frame, MAX_BINS};

/// Bytes of a Gaussian in the buffer `gaussians` of the shader: nine binary32.
const GAUSSIAN_BYTES: u64 = 36;
/// Bytes of a `Splat` of the shader.
const SPLAT_BYTES: u64 = 48;

/// A picture in the memory of the GPU, to be drawn many times: see
/// [`GpuRenderer::upload`](super::GpuRenderer::upload). Each Gaussian takes 116 bytes there, and the texture a
/// fifth of a byte for each pixel.
#[derive(Debug)]
pub struct GpuPicture {
    /// That of the renderer.
    pub(crate) identity: Arc<()>,
    header: Header,
    /// For the work of a view.
    gaussians: Vec<Gaussian>,
    has_texture: bool,
    pub(crate) gaussian_buffer: wgpu::Buffer,
    pub(crate) splat_buffer: wgpu::Buffer,
    pub(crate) bin_buffer: wgpu::Buffer,
    pub(crate) map_buffer: wgpu::Buffer,
}

impl GpuPicture {
    pub(crate) fn new(
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        identity: &Arc<()>,
        picture: &Picture<'_>,
    ) -> Result<Self, RenderError> {
        let gaussians = picture.gaussians();
        let count = gaussians.len() as u64;
        // Buffers must not be empty.
        let splat_bytes = count.max(1) * SPLAT_BYTES;
        let bin_bytes = u64::from(MAX_BINS * MAX_BINS) * bin_bytes(count.max(1));
        let limits = device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        check("bytes of a buffer for the Gaussians", splat_bytes.max(bin_bytes), most)?;
        let map = picture.texture_map();
        let sums = map.map_or_else(|| Ok(Vec::new()), |map| sums(&map))?;
        check("bytes of a buffer for the texture", size_of_val(&sums[..]) as u64, most)?;

        let values = gaussians.iter().flat_map(|Gaussian { center, cholesky, color }| {
            center.iter().chain(cholesky).chain(color)
        });
        let contents = bytes(values, count * GAUSSIAN_BYTES);
        let map_contents = bytes(&sums, size_of_val(&sums[..]) as u64);
        let filled = BufferUsages::STORAGE | BufferUsages::COPY_DST;
        checked(device, || {
            let gaussian_buffer = buffer(device, "gip gaussians", contents.len() as u64, filled);
            queue.write_buffer(&gaussian_buffer, 0, &contents);
            let map_buffer = buffer(device, "gip texture map", map_contents.len() as u64, filled);
            queue.write_buffer(&map_buffer, 0, &map_contents);
            Self {
                identity: Arc::clone(identity),
                header: picture.header().clone(),
                gaussians: gaussians.to_vec(),
                has_texture: map.is_some(),
                gaussian_buffer,
                splat_buffer: buffer(device, "gip splats", splat_bytes, BufferUsages::STORAGE),
                bin_buffer: buffer(device, "gip bins", bin_bytes, filled),
                map_buffer,
            }
        })
    }

    /// The header of the picture.
    #[must_use]
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The number of Gaussians.
    #[must_use]
    pub fn len(&self) -> u32 {
        // The device has room for fewer.
        self.gaussians.len() as u32
    }

    /// Whether there are no Gaussians: the picture is all base colour.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.gaussians.is_empty()
    }

    /// The Gaussians that are drawn in a frame.
    pub(crate) fn drawn(&self, frame: &Frame) -> &[Gaussian] {
        &self.gaussians[..frame.gaussians as usize]
    }

    /// The bytes of the bins of a frame.
    pub(crate) fn bin_bytes(frame: &Frame) -> u64 {
        let [columns, rows] = frame.bins();
        u64::from(columns * rows) * bin_bytes(frame.gaussians.into())
    }

    /// The contents of the uniform `View` of the shader.
    pub(crate) fn uniform(&self, frame: &Frame) -> Result<[u8; 112], RenderError> {
        let Header { width, height, kernel, color, base_color, .. } = self.header;
        let code = match kernel {
            Kernel::Exponential { .. } => 0_u32,
            Kernel::Quartic => 1,
            _ => return Err(RenderError::Kernel),
        };
        let (grid, region) = (frame.grid, frame.region);
        let base = base_color.map(|value| (f32::from(value) / 65535.0).to_bits());
        let words = [
            frame.scale[0].to_bits(),
            frame.scale[1].to_bits(),
            (grid.x as f32).to_bits(),
            (grid.y as f32).to_bits(),
            grid.width,
            grid.height,
            frame.gaussians,
            frame.bin_tiles(),
            base[0],
            base[1],
            base[2],
            base[3],
            color.channels() as u32,
            code,
            kernel.cutoff().to_bits(),
            (if self.has_texture { frame.fade } else { 0.0 }).to_bits(),
            frame.ratio[0].to_bits(),
            frame.ratio[1].to_bits(),
            frame.offset[0].to_bits(),
            frame.offset[1].to_bits(),
            region.width,
            region.height,
            width,
            height,
            // The picture is as stored.
            0,
            0,
            0,
            0,
        ];
        let mut bytes = [0; 112];
        for (bytes, word) in bytes.chunks_exact_mut(4).zip(words) {
            bytes.copy_from_slice(&word.to_ne_bytes());
        }
        Ok(bytes)
    }
}

/// The planes of a texture's map.
fn sums(map: &Picture<'_>) -> Result<Vec<f32>, DecodeError> {
    let options = RenderOptions::new();
    let mut sums = vec![0.0; map.output_len(&options)?];
    map.render_planes(&options, &mut sums)?;
    Ok(sums)
}

/// Numbers as `size` bytes for a buffer, which must not be empty.
fn bytes<'a>(values: impl IntoIterator<Item = &'a f32>, size: u64) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(size.max(4) as usize);
    bytes.extend(values.into_iter().flat_map(|value| value.to_ne_bytes()));
    bytes.resize(bytes.len().max(4), 0);
    bytes
}

/// The bytes of a bin for so many Gaussians: a bit for each, in whole words.
fn bin_bytes(gaussians: u64) -> u64 {
    gaussians.div_ceil(32) * 4
}
