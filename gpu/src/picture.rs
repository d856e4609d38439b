//! A picture in the memory of the GPU.

use std::sync::Arc;

use image_gip::{Gaussian, Header, Kernel, Picture};
use wgpu::BufferUsages;

use crate::device::{buffer, check, checked};
use crate::error::RenderError;
use crate::view::{Frame, MAX_BINS};

/// Bytes of a Gaussian in the buffer `gaussians` of the shader: nine binary32.
const GAUSSIAN_BYTES: u64 = 36;
/// Bytes of a `Splat` of the shader.
const SPLAT_BYTES: u64 = 48;

/// A picture in the memory of the GPU, to be drawn many times: see
/// [`GpuRenderer::upload`](crate::GpuRenderer::upload). Each Gaussian takes 116 bytes there.
#[derive(Debug)]
pub struct GpuPicture {
    /// That of the renderer.
    pub(crate) identity: Arc<()>,
    header: Header,
    /// For the work of a view.
    gaussians: Vec<Gaussian>,
    pub(crate) gaussian_buffer: wgpu::Buffer,
    pub(crate) splat_buffer: wgpu::Buffer,
    pub(crate) bin_buffer: wgpu::Buffer,
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

        let mut contents = Vec::with_capacity((count.max(1) * GAUSSIAN_BYTES) as usize);
        for Gaussian { center, cholesky, color } in gaussians {
            for value in center.iter().chain(cholesky).chain(color) {
                contents.extend_from_slice(&value.to_ne_bytes());
            }
        }
        contents.resize(contents.capacity(), 0);
        let filled = BufferUsages::STORAGE | BufferUsages::COPY_DST;
        checked(device, || {
            let gaussian_buffer = buffer(device, "gip gaussians", contents.len() as u64, filled);
            queue.write_buffer(&gaussian_buffer, 0, &contents);
            Self {
                identity: Arc::clone(identity),
                header: picture.header().clone(),
                gaussians: gaussians.to_vec(),
                gaussian_buffer,
                splat_buffer: buffer(device, "gip splats", splat_bytes, BufferUsages::STORAGE),
                bin_buffer: buffer(device, "gip bins", bin_bytes, filled),
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
    pub(crate) fn uniform(&self, frame: &Frame) -> Result<[u8; 96], RenderError> {
        let Header { kernel, color, base_color, .. } = self.header;
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
            0,
            frame.ratio[0].to_bits(),
            frame.ratio[1].to_bits(),
            frame.offset[0].to_bits(),
            frame.offset[1].to_bits(),
            region.width,
            region.height,
            0,
            0,
        ];
        let mut bytes = [0; 96];
        for (bytes, word) in bytes.chunks_exact_mut(4).zip(words) {
            bytes.copy_from_slice(&word.to_ne_bytes());
        }
        Ok(bytes)
    }
}

/// The bytes of a bin for so many Gaussians: a bit for each, in whole words.
fn bin_bytes(gaussians: u64) -> u64 {
    gaussians.div_ceil(32) * 4
}
