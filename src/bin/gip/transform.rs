//! `gip transform`.

use std::collections::HashSet;

use anyhow::{Context, Result, anyhow};
use image_gip::{
    Coding, Gaussian, Header, Limits, Orientation, Picture, PictureError, Precision, Region,
    RenderOptions, StreamDecoder, WriteError, Writer, metrics,
};

use crate::args;
use crate::decode::skipped;
use crate::files::{self, Output};
use crate::in_grid::Grid;

/// Pixels of the picture between two of its texture's map.
const CELL: f32 = 8.0;

pub(crate) fn run(args: &args::Transform) -> Result<()> {
    let output = Output::new(&args.output)?;
    if !args.force {
        output.check_name("transform")?;
    }
    let times = args.keep.preserve_times.then(|| output.times_of(&args.input)).transpose()?;
    let context = || files::input_name(&args.input);
    let limits = args.limits.limits();
    let file = files::read(&args.input)?;
    let mut stream = StreamDecoder::new().with_limits(limits.clone());
    stream.feed(&file).and_then(|_| stream.finish()).with_context(context)?;
    let picture = stream.picture().ok_or_else(|| anyhow!("the file has no header"))?;

    let mut warnings = skipped(&stream);
    let upright = stream.metadata().orientation();
    let moved = Move::new(args, picture.header(), upright).with_context(context)?;
    let header = moved.header(picture.header());
    let gaussians = moved.gaussians(picture.gaussians(), &header);
    let map = picture.texture_map();
    let texture = map.map(|map| moved.texture(map.gaussians())).unwrap_or_default();
    let mut metadata = stream.metadata().clone();
    metadata.reset_orientation();
    let losses = metadata.retain(args.keep.policy().unwrap_or_default());
    warnings.extend(losses.iter().map(ToString::to_string));

    let mut writer =
        Writer::new(header.clone()).with_metadata(metadata).with_limits(limits.clone());
    let steps = stream.quantization_steps();
    let is_coded = steps.is_some();
    if let Some(steps) = steps {
        writer = writer.with_precision(Precision::Entropy).with_steps(steps);
    }
    let mut writing = Writing { writer, texture, warnings };
    let (turned, difference) = args.threads.pool()?.install(|| {
        let turned = if is_coded {
            writing.entropy_coded(&gaussians, Grid::new(header.width, header.height))?
        } else {
            writing.write(&gaussians)?
        };
        let difference = difference(&header, &gaussians, &turned, &limits)?;
        anyhow::Ok((turned, difference))
    })?;
    if picture.header().coding == Coding::Packed && !is_of_floats(&stream) {
        writing.warnings.push("its packed codes have become floats".into());
    }
    files::warn(&args.input, &writing.warnings);
    output.write(&turned, times)?;
    let name = files::output_name(&args.output);
    let (width, height) = (header.width, header.height);
    let text = format!("{name}: {width}x{height} pixels, {} bytes, {difference}", turned.len());
    files::print(&text, Some(&args.output))
}

/// What is done to the Gaussians of a picture.
struct Move {
    /// The part of the stored picture that is kept.
    part: Region,
    /// How it is turned.
    turn: Orientation,
}

impl Move {
    fn new(args: &args::Transform, header: &Header, upright: Orientation) -> Result<Self> {
        let (width, height) = upright.turned_size(header.width, header.height);
        let crop = args.crop.unwrap_or(Region { x: 0, y: 0, width, height });
        let part = upright.stored_region(crop, width, height)?;
        Ok(Self { part, turn: upright.then(args.turn()) })
    }

    fn header(&self, header: &Header) -> Header {
        let (width, height) = self.turn.turned_size(self.part.width, self.part.height);
        let mut turned = Header::new(width, height, header.color);
        turned.depth = header.depth;
        turned.kernel = header.kernel;
        turned.base_color = header.base_color;
        turned
    }

    /// Those of the Gaussians that show in a picture with this header.
    fn gaussians(&self, gaussians: &[Gaussian], header: &Header) -> Vec<Gaussian> {
        let [x, y, width, height] = self.sides();
        let of_part = |gaussian: &Gaussian| {
            let [column, row] = gaussian.center;
            let moved = Gaussian { center: [column - x, row - y], ..*gaussian };
            self.turn.apply_to_gaussian(&moved, width, height)
        };
        let drawn = gaussians.iter().filter(|spot| spot.is_drawable());
        drawn.map(of_part).filter(|spot| shows(spot, header)).collect()
    }

    /// The Gaussians of the texture's map. Its pixel (0, 0), whose centre is (0.5, 0.5), stands for the corner of the
    /// picture.
    fn texture(&self, gaussians: &[Gaussian]) -> Vec<Gaussian> {
        let [x, y, width, height] = self.sides().map(|side| side / CELL);
        let exchanges_axes = self.turn.turned_size(1, 2) == (2, 1);
        let of_part = |gaussian: &Gaussian| {
            let [column, row] = gaussian.center;
            let mut moved = Gaussian { center: [column - x, row - y], ..*gaussian };
            if exchanges_axes {
                // Horizontal streaks become vertical ones.
                moved.color[2] = -moved.color[2];
            }
            self.turn.apply_to_gaussian(&moved, width + 1.0, height + 1.0)
        };
        gaussians.iter().filter(|spot| spot.is_drawable()).map(of_part).collect()
    }

    fn sides(&self) -> [f32; 4] {
        let Region { x, y, width, height } = self.part;
        [x, y, width, height].map(|side| side as f32)
    }
}

/// Whether the box around a Gaussian reaches into a picture.
fn shows(gaussian: &Gaussian, header: &Header) -> bool {
    let reach = header.kernel.cutoff().sqrt();
    let [xx, _, yy] = gaussian.covariance();
    let reaches = |center: f32, variance: f32, side: u32| {
        let extent = reach * variance.sqrt();
        center + extent > 0.0 && center - extent < side as f32
    };
    let [x, y] = gaussian.center;
    reaches(x, xx, header.width) && reaches(y, yy, header.height)
}

/// A file that is written.
struct Writing {
    writer: Writer,
    texture: Vec<Gaussian>,
    warnings: Vec<String>,
}

impl Writing {
    /// The file with the grid of the input; with floats if a Gaussian has no code: another encoder's input may have larger
    /// codes of shape and colour than are written here.
    fn entropy_coded(&mut self, gaussians: &[Gaussian], grid: Grid) -> Result<Vec<u8>> {
        let brought_in: Vec<_> =
            gaussians.iter().filter_map(|spot| grid.brought_in(spot)).collect();
        match self.write(&brought_in) {
            Err(WriteError::Picture(PictureError::Gaussian { rule, .. })) => {
                self.warnings.push(format!("stored as floats: of one Gaussian, {rule}"));
                self.writer = self.writer.clone().with_precision(Precision::Float);
                Ok(self.write(gaussians)?)
            }
            file => Ok(file?),
        }
    }

    /// The file, without those of the texture's Gaussians that have no code.
    fn write(&mut self, gaussians: &[Gaussian]) -> Result<Vec<u8>, WriteError> {
        let mut left_out = 0;
        loop {
            let writer = self.writer.clone().with_texture(self.texture.clone());
            match writer.write(gaussians) {
                Err(WriteError::Texture(PictureError::Gaussian { index, .. })) => {
                    self.texture.remove(index);
                    left_out += 1;
                }
                file => {
                    if left_out > 0 {
                        let text = "Gaussians of its texture have no code and are left out";
                        self.warnings.push(format!("{left_out} {text}"));
                    }
                    return file;
                }
            }
        }
    }
}

/// Whether a file stores floats.
fn is_of_floats(stream: &StreamDecoder) -> bool {
    stream.quantizers().iter().all(|quantizer| matches!(quantizer, image_gip::Quantizer::Float))
}

/// What is told of how a file differs from the Gaussians that it was to hold.
fn difference(
    header: &Header,
    gaussians: &[Gaussian],
    file: &[u8],
    limits: &Limits,
) -> Result<String> {
    let mut stream = StreamDecoder::new().with_limits(limits.clone());
    stream.feed(file).and_then(|_| stream.finish())?;
    let numbers = |gaussian: &Gaussian| {
        let Gaussian { center: [x, y], cholesky: [l11, l21, l22], color: [r, g, b, a] } = *gaussian;
        // Of the two zeros, it is the positive one.
        [x, y, l11, l21, l22, r, g, b, a].map(|number| (number + 0.0).to_bits())
    };
    let exact: HashSet<_> = gaussians.iter().map(numbers).collect();
    let rounded = stream.gaussians().iter().filter(|spot| !exact.contains(&numbers(spot))).count();
    let all = stream.gaussians().len();
    if rounded == 0 {
        return Ok(format!("all of {all} Gaussians exact"));
    }
    let options = RenderOptions::new().with_texture(false);
    let wanted = Picture::from_gaussians(header, gaussians, limits)?;
    let found = stream.picture().ok_or_else(|| anyhow!("the file has no header"))?;
    let mut exact = vec![0.0; wanted.output_len(&options)?];
    let mut stored = exact.clone();
    wanted.render_planes(&options, &mut exact)?;
    found.render_planes(&options, &mut stored)?;
    let psnr = metrics::psnr(&exact, &stored, 1.0);
    Ok(format!("{rounded} of {all} Gaussians rounded: {psnr:.1} dB from the exact picture"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image_gip::ColorModel;

    #[test]
    fn what_has_no_code_becomes_floats() {
        let header = Header::new(64, 48, ColorModel::Gray);
        let spot = |x: f32, color: f32| Gaussian {
            center: [x, 20.0],
            cholesky: [60.0, 0.0, 40.0],
            color: [color, 0.0, 0.0, 0.0],
        };
        let gaussians = [spot(30.0, 60_000.0), spot(150.0, 0.5)];
        let writer = Writer::new(header.clone()).with_precision(Precision::Entropy);
        let mut writing = Writing { writer, texture: Vec::new(), warnings: Vec::new() };
        let file = writing.entropy_coded(&gaussians, Grid::new(64, 48)).expect("floats hold all");
        assert!(writing.warnings[0].contains("its colour is too strong"), "{:?}", writing.warnings);
        let told = difference(&header, &gaussians, &file, &Limits::default());
        assert_eq!(told.expect("a file"), "all of 2 Gaussians exact");
    }
}
