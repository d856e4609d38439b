//! Fitted Gaussians to a file: order, layers, chunks (spec, sections 4 to 7).

use super::EncodeError;
use super::coded::{Coded, write_layers};
use super::fit::Fitted;
use super::source::Source;
use super::training::Training;
use crate::bounds::Bounds;
use crate::coding::fixed;
use crate::coding::set::SetCoding;
use crate::container::{ChunkType, Coding, Header, Metadata, SIGNATURE, write_chunk};
use crate::gaussian::{Chart, Gaussian, MAX_COMPONENTS};
use crate::quantizer::Quantizer;

/// Fewest Gaussians that are worth a layer of their own.
const LEAST_LAYER: usize = 64;
/// The layers of a file with enough Gaussians, as shares of them: each ends with a checksum, and
/// the first already shows the picture.
const LAYERS: [f64; 4] = [0.125, 0.125, 0.25, 0.5];

/// Of more layers than this it is said where they show.
const FEW_LAYERS: usize = 8;

/// All of a file but its Gaussians.
#[derive(Debug)]
pub(crate) struct Layout<'a> {
    header: Header,
    metadata: &'a Metadata,
}

impl<'a> Layout<'a> {
    /// `mean` is the mean of each channel.
    pub(crate) fn new(
        source: &Source<'_>,
        training: &Training,
        mean: [f32; 4],
        metadata: &'a Metadata,
    ) -> Self {
        let header = Header {
            version: crate::container::VERSION,
            coding: Coding::Fixed,
            width: source.width(),
            height: source.height(),
            color: source.color(),
            depth: source.depth(),
            gaussians: 0,
            layers: 0,
            kernel: training.kernel,
            chart: training.parameterization,
            base_color: mean.map(|value| (value * 65535.0).round() as u16),
        };
        Self { header, metadata }
    }

    /// The header, but for the numbers of Gaussians and layers.
    pub(crate) fn header(&self) -> &Header {
        &self.header
    }

    /// The colour that Gaussians are added to, as the decoder has it.
    pub(crate) fn base(&self) -> [f32; 4] {
        self.header.base()
    }

    /// The file.
    pub(crate) fn write(&self, fitted: &Fitted) -> Vec<u8> {
        let quantizers = &fitted.quantizers;
        let Fitted { codes, .. } = self.ordered(fitted);
        let layers = layers(codes.len());
        let header = Header {
            gaussians: codes.len() as u32,
            layers: layers.len() as u16,
            ..self.header.clone()
        };
        let mut file = SIGNATURE.to_vec();
        write_chunk(&mut file, ChunkType::GHDR, &header.to_payload());
        let entries: Vec<u8> = quantizers.iter().flat_map(|q| q.to_entry()).collect();
        write_chunk(&mut file, ChunkType::QNTZ, &entries);
        for (kind, payload) in self.metadata.chunks() {
            write_chunk(&mut file, kind, &payload);
        }
        let mut rest = &codes[..];
        for count in layers {
            let (layer, later) = rest.split_at(count);
            rest = later;
            write_chunk(&mut file, ChunkType::GAUS, &fixed::write_layer(layer, quantizers));
        }
        write_chunk(&mut file, ChunkType::GEND, &[]);
        file
    }

    /// The file of coded Gaussians.
    pub(crate) fn write_set(&self, coded: &Coded) -> Vec<u8> {
        let coding = SetCoding::new(&coded.lattice, &self.header);
        let mut codes = coded.codes.clone();
        let layers = write_layers(&coding, &mut codes);
        let header = Header {
            coding: Coding::Set,
            chart: Chart::Cholesky,
            gaussians: coded.codes.len() as u32,
            layers: layers.len() as u16,
            ..self.header.clone()
        };
        let mut file = SIGNATURE.to_vec();
        write_chunk(&mut file, ChunkType::GHDR, &header.to_payload());
        write_chunk(&mut file, ChunkType::QNTZ, &coded.lattice.to_payload());
        for (kind, payload) in self.metadata.chunks() {
            write_chunk(&mut file, kind, &payload);
        }
        if layers.len() > FEW_LAYERS {
            let mut rest = &codes[..];
            let mut bounds = Vec::new();
            for layer in &layers {
                let (codes, later) = rest.split_at(layer.levels.len());
                rest = later;
                let gaussians = codes.iter().map(|code| {
                    let shape = coding.lattice.shape(code);
                    coding.lattice.gaussian(code, &shape, &coding.grid, header.color)
                });
                bounds.extend(Bounds::of(gaussians, &header).to_entry());
            }
            write_chunk(&mut file, ChunkType::BNDS, &bounds);
        }
        for layer in layers {
            write_chunk(&mut file, ChunkType::GAUS, &layer.payload);
        }
        write_chunk(&mut file, ChunkType::GEND, &[]);
        file
    }

    /// Refuses a size that is less than a file takes without any Gaussian.
    pub(crate) fn check_size(&self, bytes: u64, least: u64) -> Result<(), EncodeError> {
        if bytes < least {
            return Err(EncodeError::Option(format!(
                "a size of {bytes} bytes; this picture takes at least {least} without any Gaussian"
            )));
        }
        Ok(())
    }

    /// The bytes of a file without any Gaussian.
    pub(crate) fn least_length(&self, quantizers: &[Quantizer]) -> u64 {
        let empty = Fitted { quantizers: quantizers.to_vec(), codes: Vec::new() };
        self.write(&empty).len() as u64
    }

    /// The Gaussian that adds most to the picture first, so that every prefix of the file is a
    /// picture.
    pub(crate) fn ordered(&self, fitted: &Fitted) -> Fitted {
        let mut order: Vec<_> = fitted
            .codes
            .iter()
            .map(|codes| {
                let mut values = [0.0; MAX_COMPONENTS];
                for ((value, &code), quantizer) in
                    values.iter_mut().zip(codes).zip(&fitted.quantizers)
                {
                    *value = quantizer.value(code);
                }
                let values = &values[..fitted.quantizers.len()];
                let gaussian = Gaussian::from_components(values, self.header.chart);
                (gaussian.importance(), codes)
            })
            .collect();
        order.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let codes = order.into_iter().map(|(_, codes)| *codes).collect();
        Fitted { quantizers: fitted.quantizers.clone(), codes }
    }
}

/// The bytes that the layers of `count` Gaussians add to a file.
pub(crate) fn layers_length(quantizers: &[Quantizer], count: usize) -> u64 {
    let layer = |count| 12 + fixed::LAYER_PREFIX + fixed::packed_length(quantizers, count as u32);
    layers(count).into_iter().map(layer).sum()
}

/// The sizes of the layers of a file with `count` Gaussians.
fn layers(count: usize) -> Vec<usize> {
    if count == 0 {
        return Vec::new();
    }
    if count < LEAST_LAYER * 8 {
        return vec![count];
    }
    let mut sizes: Vec<_> = LAYERS.map(|share| (share * count as f64) as usize).into();
    // Rounding leaves a few over.
    let last = sizes.len() - 1;
    sizes[last] += count - sizes.iter().sum::<usize>();
    sizes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::ColorModel;
    use crate::decoder::Decoder;
    use crate::encode::rate;
    use crate::lattice::{Code, Grid};
    use crate::render::{Region, RenderOptions};

    const SIDES: [u32; 2] = [900, 700];

    /// A file of so many Gaussians, some of them beside the picture.
    fn file(count: usize) -> Vec<u8> {
        let [width, height] = SIDES;
        let samples = vec![9; (width * height) as usize];
        let source =
            Source::new_u8(width, height, ColorModel::Gray, &samples).expect("sizes agree");
        let metadata = Metadata::default();
        let layout = Layout::new(&source, &Training::fast(1), [0.0; 4], &metadata);
        let grid = Grid::new(width, height);
        let mut random = fastrand::Rng::with_seed(3);
        let mut code = || Code {
            class: 2,
            color: [random.i32(-20..=20), 0, 0, 0],
            size: random.i32(-6..=6),
            ratio: random.i32(-3..=3),
            slant: random.i32(-3..=3),
            center: grid.units(SIDES.map(|side| random.f32() * (side as f32 + 60.0) - 30.0)),
        };
        let codes = (0..count).map(|_| code()).collect();
        layout.write_set(&Coded { lattice: rate::lattice(0.0, ColorModel::Gray), codes })
    }

    /// The samples of a region, and how many Gaussians are kept then.
    fn decoded(file: &[u8], options: &RenderOptions, all: bool) -> (Vec<u8>, usize) {
        let mut decoder = Decoder::new(file).expect("it begins well");
        if all {
            decoder.read_to_end().expect("it is sound");
        }
        decoder.set_options(options.clone());
        let mut samples = vec![0; decoder.output_len().expect("it fits")];
        decoder.decode_into(&mut samples).expect("it is sound");
        (samples, decoder.picture().gaussians().len())
    }

    #[test]
    fn a_region_of_a_large_picture_is_that_part_of_it() {
        let file = file(33_000);
        for (scale, x, y) in [(1, 0, 0), (1, 430, 330), (1, 860, 660), (3, 2000, 800)] {
            let region = Region { x, y, width: 40, height: 40 };
            let options = RenderOptions::new().size(SIDES[0] * scale, SIDES[1] * scale);
            let options = options.region(region);
            let (expected, gaussians) = decoded(&file, &options, true);
            assert_eq!(gaussians, 33_000);
            // Those that were decoded for the region alone are not kept.
            assert_eq!(decoded(&file, &options, false), (expected, 0), "{region:?}");
        }
    }

    #[test]
    fn few_layers_say_nothing_of_where_they_show() {
        let options = RenderOptions::new().region(Region { x: 0, y: 0, width: 9, height: 9 });
        assert_eq!(decoded(&file(3000), &options, false).1, 3000);
    }
}
