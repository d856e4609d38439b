//! Gaussians to samples: view, tiles, kernel, output (spec, section 9).

mod kernel;
mod output;
mod splat;
mod tile;
mod tiling;
mod view;

use alloc::format;
use alloc::vec::Vec;

pub use kernel::Kernel;
pub use view::{Region, RenderOptions};

#[cfg(feature = "encode")]
pub(crate) use kernel::simd as kernel_simd;
pub(crate) use output::Sample;
pub(crate) use splat::Splat;
#[cfg(feature = "encode")]
pub(crate) use tile::centers;
pub(crate) use tile::{Backend, Plane, TILE_HEIGHT, TILE_WIDTH};
pub(crate) use tiling::{TileRow, Tiling};
#[cfg(feature = "encode")]
pub(crate) use view::View;

use crate::container::Header;
use crate::error::{DecodeError, LimitKind};
use crate::gaussian::Gaussian;
use crate::limits::Limits;

/// Most bytes that a row of tiles takes for slices of the output.
const STRIP: u64 = 128;

/// A picture that can be rendered: a header and the Gaussians that have arrived so far.
///
/// Rendering evaluates the continuous model at the centres of the output's pixels: at the stored
/// size, at any other size, for the whole picture or any region of it, with all Gaussians or the
/// first few. All output is bit-exact: it depends neither on the machine nor on SIMD or threads.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'a> {
    header: &'a Header,
    gaussians: &'a [Gaussian],
    limits: &'a Limits,
    /// Bytes that the decoder holds.
    held: u64,
}

impl<'a> Picture<'a> {
    pub(crate) fn new(
        header: &'a Header,
        gaussians: &'a [Gaussian],
        limits: &'a Limits,
        held: u64,
    ) -> Self {
        Self { header, gaussians, limits, held }
    }

    /// What the file says of the picture.
    #[must_use]
    pub fn header(&self) -> &'a Header {
        self.header
    }

    /// The Gaussians that have arrived, in file order.
    #[must_use]
    pub fn gaussians(&self) -> &'a [Gaussian] {
        self.gaussians
    }

    /// The number of samples that rendering with these options writes, checked against the picture
    /// and the limits: safe to allocate.
    ///
    /// # Errors
    /// When the options do not fit the picture, or when a limit would be exceeded.
    pub fn output_len(&self, options: &RenderOptions) -> Result<usize, DecodeError> {
        let view = options.view(self.header, self.limits)?;
        let samples = view.region.pixels() * options.output_color(self.header)?.channels() as u64;
        usize::try_from(samples).map_err(|_| DecodeError::Limit {
            kind: LimitKind::Memory,
            wanted: samples,
            allowed: usize::MAX as u64,
        })
    }

    /// Renders interleaved 8-bit samples, rows from the top, without padding.
    ///
    /// # Errors
    /// When `out` is not [`RenderOptions::output_len`] long, when the options do not fit the
    /// picture, or when a limit would be exceeded. `out` is untouched then.
    pub fn render_u8(&self, options: &RenderOptions, out: &mut [u8]) -> Result<(), DecodeError> {
        self.render(options, out)
    }

    /// Renders interleaved 16-bit samples in the machine's byte order.
    ///
    /// # Errors
    /// As [`Picture::render_u8`].
    pub fn render_u16(&self, options: &RenderOptions, out: &mut [u16]) -> Result<(), DecodeError> {
        self.render(options, out)
    }

    /// Renders planes of `f32`, one after the other: all of the first channel, then all of the
    /// second. 1.0 is a full sample; values are neither clamped nor rounded.
    ///
    /// # Errors
    /// As [`Picture::render_u8`].
    pub fn render_planes(
        &self,
        options: &RenderOptions,
        out: &mut [f32],
    ) -> Result<(), DecodeError> {
        let job = self.prepare(options, out.len())?;
        let width = job.region.width as usize;
        let pixels = width * job.region.height as usize;
        let mut planes: Vec<&mut [f32]> = out.chunks_exact_mut(pixels).collect();
        let mut strips = Vec::with_capacity(job.tiling.rows());
        for row in 0..job.tiling.rows() {
            let length = planes[0].len().min(width * TILE_HEIGHT);
            let strip = planes.iter_mut().map(|plane| {
                let (strip, rest) = core::mem::take(plane).split_at_mut(length);
                *plane = rest;
                strip
            });
            strips.push((row, strip.collect::<Vec<_>>()));
        }
        for_each(options.parallel, strips, |(row, mut strip)| {
            job.row(row, |planes, x| {
                output::write_planes(planes, x, job.sources, &mut strip, width);
            });
        });
        Ok(())
    }

    fn render<T: Sample>(&self, options: &RenderOptions, out: &mut [T]) -> Result<(), DecodeError> {
        let job = self.prepare(options, out.len())?;
        let stride = job.region.width as usize * job.sources.len();
        let strips: Vec<_> = out.chunks_mut(stride * TILE_HEIGHT).enumerate().collect();
        for_each(options.parallel, strips, |(row, strip)| {
            job.row(row, |planes, x| {
                output::write_interleaved(planes, x, job.sources, strip, stride);
            });
        });
        Ok(())
    }

    /// Checks everything and bins the splats; nothing of the output is touched before.
    fn prepare(&self, options: &RenderOptions, out: usize) -> Result<Job, DecodeError> {
        let wanted = self.output_len(options)?;
        if wanted != out {
            return Err(DecodeError::Request(format!(
                "the output buffer holds {out} samples, {wanted} are needed"
            )));
        }
        let view = options.view(self.header, self.limits)?;
        let color = options.output_color(self.header)?;
        let count = options.prefix.map_or(self.gaussians.len(), |count| count as usize);
        let gaussians = &self.gaussians[..count.min(self.gaussians.len())];
        let strips = u64::from(view.region.height).div_ceil(TILE_HEIGHT as u64) * STRIP;
        let held = self.held + strips + gaussians.len() as u64 * size_of::<Splat>() as u64;
        self.limits.check_memory(held)?;
        let mut splats = Vec::with_capacity(gaussians.len());
        splats.extend(gaussians.iter().filter_map(|g| Splat::new(g, &view)));
        let kernel = self.header.kernel;
        let (region, cutoff) = (view.region, kernel.cutoff());
        let threads = threads(options.parallel);
        let tiling = Tiling::new(&splats, cutoff, region, self.limits, held, threads)?;
        Ok(Job {
            splats,
            tiling,
            region,
            kernel,
            channels: self.header.color.channels(),
            sources: output::sources(self.header.color, color),
            base: self.header.base(),
            backend: options.backend(),
        })
    }
}

/// A rendering that was checked and can no longer fail.
struct Job {
    splats: Vec<Splat>,
    tiling: Tiling,
    region: Region,
    kernel: Kernel,
    channels: usize,
    /// See [`output::sources`].
    sources: &'static [Option<usize>],
    base: [f32; 4],
    backend: Backend,
}

impl Job {
    /// Renders one row of tiles and hands each over with its first column in the region.
    fn row(&self, row: usize, write: impl FnMut(&[Plane], usize)) {
        match self.channels {
            1 => self.row_of::<1>(row, write),
            2 => self.row_of::<2>(row, write),
            3 => self.row_of::<3>(row, write),
            _ => self.row_of::<4>(row, write),
        }
    }

    fn row_of<const CHANNELS: usize>(&self, row: usize, mut write: impl FnMut(&[Plane], usize)) {
        let y = self.region.y + (row * TILE_HEIGHT) as u32;
        let tiles = TileRow::new(&self.tiling, row);
        let splats = self.tiling.splats(row, &self.splats);
        for column in 0..self.tiling.columns() {
            let x = column * TILE_WIDTH;
            let origin = (self.region.x + x as u32, y);
            let mut planes: [Plane; CHANNELS] =
                core::array::from_fn(|channel| [[self.base[channel]; TILE_WIDTH]; TILE_HEIGHT]);
            self.backend.add(&mut planes, origin, &splats, tiles.spans(column), self.kernel);
            write(&planes, x);
        }
    }
}

/// How many threads [`for_each`] uses.
fn threads(parallel: bool) -> usize {
    #[cfg(feature = "rayon")]
    if parallel {
        return rayon::current_num_threads();
    }
    let _ = parallel;
    1
}

/// Runs `work` on every item, on the threads of the current pool if there are any.
fn for_each<T: Send>(parallel: bool, items: Vec<T>, work: impl Fn(T) + Send + Sync) {
    #[cfg(feature = "rayon")]
    if parallel {
        use rayon::iter::{IntoParallelIterator, ParallelIterator};
        items.into_par_iter().for_each(work);
        return;
    }
    let _ = parallel;
    items.into_iter().for_each(work);
}
