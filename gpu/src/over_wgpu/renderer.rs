//! The shader with its pipelines, and what is drawn with it.

use std::sync::Arc;

use image_gip::{Header, Picture};

use super::device::{buffer, check, checked};
use super::error::RenderError;
use super::picture::GpuPicture;
use super::pipelines::{FORMAT, Pipelines};
use super::wgpu::{self, BindGroupDescriptor, BindGroupEntry, BufferUsages, TextureUsages};
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
    /// The texture must be one of this device: `wgpu` may panic otherwise. It can be the program's own:
    /// `Rgba8Unorm` with the usage `STORAGE_BINDING`, and with `Rgba8UnormSrgb` among its view formats if
    /// it is to be sampled as sRGB. If it has mip levels, all are drawn, each from the Gaussians at its own size;
    /// the view must then be of the whole picture, at the size of the texture.
    ///
    /// Gray is written as red, green and blue, and a picture without alpha is opaque. Alpha is
    /// straight. The samples are those of the file, so in general sRGB-encoded.
    ///
    /// # Errors
    /// [`RenderError::OtherRenderer`] for a picture that was uploaded by another renderer,
    /// [`RenderError::View`] when the view is out of range, [`RenderError::Work`] when it takes too
    /// much work at one of the levels, [`RenderError::Texture`] when the texture is too small, not
    /// `Rgba8Unorm`, or no storage texture, or has mip levels which the view does not fill, and
    /// [`RenderError::Device`] when the device fails. Nothing is drawn then.
    pub fn draw(
        &self,
        picture: &GpuPicture,
        view: &View,
        texture: &wgpu::Texture,
    ) -> Result<(), RenderError> {
        if !Arc::ptr_eq(&picture.identity, &self.identity) {
            return Err(RenderError::OtherRenderer);
        }
        let header = picture.header();
        let levels = 0..texture.mip_level_count();
        let frames = levels
            .map(|level| view.mip_level(header, level).resolve(header, picture.len()))
            .collect::<Result<Vec<_>, _>>()?;
        check_texture(texture, view, header, &frames[0])?;
        let uniforms = frames.iter().map(|frame| picture.uniform(frame));
        let uniforms = uniforms.collect::<Result<Vec<_>, _>>()?;
        for frame in &frames {
            let wanted = work::evaluations(picture.drawn(frame), frame, header.kernel);
            let allowed = work::allowed(frame, self.max_work);
            if wanted > allowed {
                return Err(RenderError::Work { wanted, allowed });
            }
        }
        checked(&self.device, || {
            let frames = (0..).zip(frames.iter().zip(&uniforms));
            let commands = frames.map(|(level, (frame, uniform))| {
                self.record(picture, frame, uniform, (texture, level))
            });
            self.queue.submit(commands);
        })
    }

    /// The commands that draw a frame to a mip level of a texture.
    fn record(
        &self,
        picture: &GpuPicture,
        frame: &Frame,
        uniform: &[u8],
        (texture, level): (&wgpu::Texture, u32),
    ) -> wgpu::CommandBuffer {
        let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
        let view = buffer(&self.device, "gip view", uniform.len() as u64, usage);
        self.queue.write_buffer(&view, 0, uniform);
        let output = texture.create_view(&wgpu::TextureViewDescriptor {
            base_mip_level: level,
            mip_level_count: Some(1),
            ..Default::default()
        });
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

    /// Waits for what was drawn to a texture with the usage `COPY_SRC`, and reads it: height x width x 4
    /// interleaved samples, rows from the top, without padding.
    ///
    /// # Errors
    /// [`RenderError::Texture`] when the texture cannot be copied, [`RenderError::DeviceLimit`] when
    /// a buffer cannot hold it, [`RenderError::Device`], [`RenderError::Wait`] and [`RenderError::Read`]
    /// when the device fails.
    pub fn read(&self, texture: &wgpu::Texture) -> Result<Vec<u8>, RenderError> {
        self.read_mip_level(texture, 0)
    }

    /// As [`GpuRenderer::read`], of a mip level: its sides are those of the texture, halved `level` times and
    /// rounded down, but at least 1.
    ///
    /// # Errors
    /// As [`GpuRenderer::read`], and [`RenderError::Texture`] when there is no such level.
    pub fn read_mip_level(
        &self,
        texture: &wgpu::Texture,
        level: u32,
    ) -> Result<Vec<u8>, RenderError> {
        if texture.format() != FORMAT || !texture.usage().contains(TextureUsages::COPY_SRC) {
            return Err(RenderError::Texture("not Rgba8Unorm that can be copied"));
        }
        if level >= texture.mip_level_count() {
            return Err(RenderError::Texture("without this mip level"));
        }
        let extent = texture.size().mip_level_size(level, texture.dimension());
        let row = extent.width as usize * 4;
        // The rows of a copy are aligned.
        let padded = (extent.width * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let size = u64::from(padded) * u64::from(extent.height);
        check("bytes of a buffer for the samples", size, self.device.limits().max_buffer_size)?;
        let buffer = checked(&self.device, || {
            let usage = BufferUsages::COPY_DST | BufferUsages::MAP_READ;
            let buffer = buffer(&self.device, "gip samples", size, usage);
            let mut encoder = self.device.create_command_encoder(&Default::default());
            encoder.copy_texture_to_buffer(
                wgpu::TexelCopyTextureInfo { mip_level: level, ..texture.as_image_copy() },
                wgpu::TexelCopyBufferInfo {
                    buffer: &buffer,
                    layout: wgpu::TexelCopyBufferLayout {
                        offset: 0,
                        bytes_per_row: Some(padded),
                        rows_per_image: None,
                    },
                },
                extent,
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
        let mapped = super::mapped(&buffer)?;
        let rows = mapped.chunks_exact(padded as usize);
        Ok(rows.flat_map(|line| &line[..row]).copied().collect())
    }
}

/// Refuses a texture that a view of a picture, whose frame at level 0 is given, cannot be drawn to.
fn check_texture(
    texture: &wgpu::Texture,
    view: &View,
    header: &Header,
    frame: &Frame,
) -> Result<(), RenderError> {
    let problem = if texture.format() != FORMAT {
        "not Rgba8Unorm"
    } else if !texture.usage().contains(TextureUsages::STORAGE_BINDING) {
        "not a storage texture"
    } else if texture.dimension() != wgpu::TextureDimension::D2
        || texture.depth_or_array_layers() != 1
    {
        "not a single 2D image"
    } else if texture.width() < frame.region.width || texture.height() < frame.region.height {
        "smaller than the view"
    } else if texture.mip_level_count() > 1
        && !view.fills(header, (texture.width(), texture.height()))
    {
        "with mip levels, and not as large as the whole picture is drawn"
    } else {
        return Ok(());
    };
    Err(RenderError::Texture(problem))
}
