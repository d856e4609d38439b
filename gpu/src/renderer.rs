//! The shader with its pipelines, and what is drawn with it.

use std::sync::Arc;

use image_gip::Picture;
use wgpu::{BindGroupDescriptor, BindGroupEntry, BufferUsages, TextureUsages};

use crate::device::{buffer, check, checked};
use crate::error::RenderError;
use crate::picture::GpuPicture;
use crate::pipelines::{FORMAT, Pipelines};
use crate::view::{Frame, View};
use crate::work;

/// Gaussians for each workgroup of `prepare`.
const PREPARE: u32 = 256;
/// The default of [`GpuRenderer::with_max_work`].
const MAX_WORK: u64 = 1 << 34;

/// Renders pictures on a GPU: the compute shader [`SHADER`](crate::SHADER) and its pipelines on one
/// device.
///
/// Calls submit work, and only [`GpuRenderer::wait`] and [`GpuRenderer::read`] wait for it.
#[derive(Debug)]
pub struct GpuRenderer {
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipelines: Pipelines,
    max_work: u64,
    /// Tells pictures of other renderers apart: devices of different instances compare as equal.
    identity: Arc<()>,
}

impl GpuRenderer {
    /// Compiles the shader for a device. It needs no features, and no limits above
    /// [`wgpu::Limits::downlevel_defaults`]; pictures may.
    ///
    /// # Errors
    /// [`RenderError::DeviceLimit`] when the device has no compute shaders, or too small ones, and
    /// [`RenderError::Device`] when it refuses the shader.
    pub fn new(device: wgpu::Device, queue: wgpu::Queue) -> Result<Self, RenderError> {
        let pipelines = Pipelines::new(&device)?;
        Ok(Self { device, queue, pipelines, max_work: MAX_WORK, identity: Arc::new(()) })
    }

    /// Sets the most kernel evaluations of one rendering beyond 128 for each pixel, which is more
    /// than ordinary pictures take. They are counted as an upper bound, in tiles of 16 x 16 pixels. A
    /// file from an unknown source could otherwise stop the GPU for minutes, until the system resets
    /// it. Default 2^34.
    #[must_use]
    pub fn with_max_work(mut self, evaluations: u64) -> Self {
        self.max_work = evaluations;
        self
    }

    /// Draws a picture to a new texture: [`GpuRenderer::upload`], [`GpuRenderer::create_texture`]
    /// and [`GpuRenderer::draw`] in one call.
    ///
    /// # Errors
    /// As these.
    pub fn render(&self, picture: &Picture<'_>, view: &View) -> Result<wgpu::Texture, RenderError> {
        let picture = self.upload(picture)?;
        let texture = self.create_texture(&picture, view)?;
        self.draw(&picture, view, &texture)?;
        Ok(texture)
    }

    /// Copies a picture to the GPU, so that it can be drawn many times.
    ///
    /// # Errors
    /// [`RenderError::DeviceLimit`] when a buffer would be larger than the device allows: with the
    /// default limits of devices, from 2.8 million Gaussians on. [`RenderError::Device`] when it has
    /// no memory left, and [`RenderError::Map`] when the decoder's limits forbid to render the map of the
    /// texture.
    pub fn upload(&self, picture: &Picture<'_>) -> Result<GpuPicture, RenderError> {
        let workgroups = picture.gaussians().len().div_ceil(PREPARE as usize) as u64;
        let most = self.device.limits().max_compute_workgroups_per_dimension;
        check("workgroups for the Gaussians", workgroups, most.into())?;
        GpuPicture::new((&self.device, &self.queue), &self.identity, picture)
    }

    /// A texture for a view of a picture: `Rgba8Unorm`, which can be drawn to, sampled and copied.
    ///
    /// # Errors
    /// [`RenderError::View`] when the view is out of range, [`RenderError::DeviceLimit`] when it is
    /// larger than a texture can be, and [`RenderError::Device`] when there is no memory for it.
    pub fn create_texture(
        &self,
        picture: &GpuPicture,
        view: &View,
    ) -> Result<wgpu::Texture, RenderError> {
        let region = view.resolve(picture.header(), picture.len())?.region;
        let most = self.device.limits().max_texture_dimension_2d;
        check("pixels along a side", region.width.max(region.height).into(), most.into())?;
        checked(&self.device, || {
            self.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("gip picture"),
                size: wgpu::Extent3d {
                    width: region.width,
                    height: region.height,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: FORMAT,
                usage: TextureUsages::STORAGE_BINDING
                    | TextureUsages::TEXTURE_BINDING
                    | TextureUsages::COPY_SRC,
                view_formats: &[],
            })
        })
    }

    /// Draws a view of a picture to the upper left corner of a texture, which is at least as large
    /// as the view. Submits the work, and does not wait for it.
    ///
    /// The texture must be one of this device: `wgpu` may panic otherwise.
    ///
    /// Gray is written as red, green and blue, and a picture without alpha is opaque. Alpha is
    /// straight. The samples are those of the file, so in general sRGB-encoded.
    ///
    /// # Errors
    /// [`RenderError::OtherRenderer`] for a picture that was uploaded by another renderer,
    /// [`RenderError::View`] when the view is out of range, [`RenderError::Work`] when it takes too
    /// much work, [`RenderError::Texture`] when the texture is too small, not `Rgba8Unorm`, or no
    /// storage texture, and [`RenderError::Device`] when the device fails.
    pub fn draw(
        &self,
        picture: &GpuPicture,
        view: &View,
        texture: &wgpu::Texture,
    ) -> Result<(), RenderError> {
        if !Arc::ptr_eq(&picture.identity, &self.identity) {
            return Err(RenderError::OtherRenderer);
        }
        let frame = view.resolve(picture.header(), picture.len())?;
        let uniform = picture.uniform(&frame)?;
        check_texture(texture, &frame)?;
        let kernel = picture.header().kernel;
        let wanted = work::evaluations(picture.drawn(&frame), &frame, kernel);
        let allowed = work::allowed(&frame, self.max_work);
        if wanted > allowed {
            return Err(RenderError::Work { wanted, allowed });
        }
        checked(&self.device, || {
            let commands = self.record(picture, &frame, &uniform, texture);
            self.queue.submit([commands]);
        })
    }

    /// The commands that draw a frame.
    fn record(
        &self,
        picture: &GpuPicture,
        frame: &Frame,
        uniform: &[u8],
        texture: &wgpu::Texture,
    ) -> wgpu::CommandBuffer {
        let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
        let view = buffer(&self.device, "gip view", uniform.len() as u64, usage);
        self.queue.write_buffer(&view, 0, uniform);
        let output = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let buffers = [&view, &picture.gaussian_buffer, &picture.splat_buffer, &picture.bin_buffer];
        let mut entries: Vec<_> = (0..)
            .zip(buffers)
            .map(|(binding, buffer)| BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        entries.push(BindGroupEntry {
            binding: 4,
            resource: wgpu::BindingResource::TextureView(&output),
        });
        entries
            .push(BindGroupEntry { binding: 5, resource: picture.map_buffer.as_entire_binding() });
        let bindings = self.device.create_bind_group(&BindGroupDescriptor {
            label: Some("gip bindings"),
            layout: &self.pipelines.layout,
            entries: &entries,
        });
        let mut encoder = self
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("gip drawing") });
        encoder.clear_buffer(&picture.bin_buffer, 0, Some(GpuPicture::bin_bytes(frame)));
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_bind_group(0, &bindings, &[]);
            pass.set_pipeline(&self.pipelines.prepare);
            pass.dispatch_workgroups(frame.gaussians.div_ceil(PREPARE), 1, 1);
            pass.set_pipeline(&self.pipelines.render);
            let [columns, rows] = frame.workgroups();
            pass.dispatch_workgroups(columns, rows, 1);
        }
        encoder.finish()
    }

    /// Waits until all that was submitted to the device is done.
    ///
    /// # Errors
    /// [`RenderError::Wait`] when the device fails.
    pub fn wait(&self) -> Result<(), RenderError> {
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        Ok(())
    }

    /// Waits for what was drawn to a texture of [`GpuRenderer::create_texture`], and reads it:
    /// height x width x 4 interleaved samples, rows from the top, without padding.
    ///
    /// # Errors
    /// [`RenderError::Texture`] when the texture cannot be copied, [`RenderError::DeviceLimit`] when
    /// a buffer cannot hold it, [`RenderError::Device`], [`RenderError::Wait`] and [`RenderError::Read`]
    /// when the device fails.
    pub fn read(&self, texture: &wgpu::Texture) -> Result<Vec<u8>, RenderError> {
        if texture.format() != FORMAT || !texture.usage().contains(TextureUsages::COPY_SRC) {
            return Err(RenderError::Texture("not Rgba8Unorm that can be copied"));
        }
        let row = texture.width() as usize * 4;
        // The rows of a copy are aligned.
        let padded = (texture.width() * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let size = u64::from(padded) * u64::from(texture.height());
        check("bytes of a buffer for the samples", size, self.device.limits().max_buffer_size)?;
        let buffer = checked(&self.device, || {
            let usage = BufferUsages::COPY_DST | BufferUsages::MAP_READ;
            let buffer = buffer(&self.device, "gip samples", size, usage);
            let mut encoder = self.device.create_command_encoder(&Default::default());
            encoder.copy_texture_to_buffer(
                texture.as_image_copy(),
                wgpu::TexelCopyBufferInfo {
                    buffer: &buffer,
                    layout: wgpu::TexelCopyBufferLayout {
                        offset: 0,
                        bytes_per_row: Some(padded),
                        rows_per_image: None,
                    },
                },
                texture.size(),
            );
            self.queue.submit([encoder.finish()]);
            buffer
        })?;
        let (sender, receiver) = std::sync::mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            // The receiver waits for it.
            let _ = sender.send(result);
        });
        self.wait()?;
        let result = receiver.recv().map_err(|_| wgpu::BufferAsyncError);
        result.and_then(|result| result).map_err(|error| RenderError::Read(Box::new(error)))?;
        let mapped =
            buffer.get_mapped_range(..).map_err(|error| RenderError::Read(Box::new(error)))?;
        let rows = mapped.chunks_exact(padded as usize);
        Ok(rows.flat_map(|line| &line[..row]).copied().collect())
    }
}

/// Refuses a texture that a frame cannot be drawn to.
fn check_texture(texture: &wgpu::Texture, frame: &Frame) -> Result<(), RenderError> {
    let problem = if texture.format() != FORMAT {
        "not Rgba8Unorm"
    } else if !texture.usage().contains(TextureUsages::STORAGE_BINDING) {
        "not a storage texture"
    } else if texture.dimension() != wgpu::TextureDimension::D2
        || texture.depth_or_array_layers() != 1
        || texture.mip_level_count() != 1
    {
        "not a single 2D image"
    } else if texture.width() < frame.region.width || texture.height() < frame.region.height {
        "smaller than the view"
    } else {
        return Ok(());
    };
    Err(RenderError::Texture(problem))
}
