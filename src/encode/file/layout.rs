//! The chunks of a file, around its layers (spec, sections 4 and 5).

use super::layers;
use crate::chunk::ChunkType;
use crate::coding::entropy::{Code, EncodedLayer, Quantization, QuantizedCodes, steps};
use crate::coding::layer_count::LayerCount;
use crate::coding::packed::{PackedCodes, Quantizer};
use crate::color::SampleDepth;
use crate::container::{ChunkWriter, Coding, Dequantizer, Header, Metadata};
use crate::encode::error::{OptionError, Result};
use crate::encode::progress::Observer;
use crate::encode::source::Source;
use crate::gaussian::{Gaussian, MAX_COMPONENTS, Parameterization};
use crate::kernel::Kernel;

/// Most bytes of a Gaussian that has a layer of its own.
const BYTES_OF_GAUSSIAN: usize = 32;
/// How many more bytes numbers of Gaussians and lengths may take than the least.
const BYTES_OF_NUMBERS: usize = 4;

/// Codes in the order of their file, with centres as the decoder reads them, and the layers that they
/// make.
#[derive(Debug)]
pub(crate) struct CodedLayers {
    pub(crate) quantization: Quantization,
    pub(crate) codes: Vec<Code>,
    pub(crate) layers: Vec<EncodedLayer>,
}

/// The header, the metadata and the texture of a file, which its codes complete.
#[derive(Clone, Debug)]
pub(crate) struct FileLayout<'a> {
    header: Header,
    metadata: &'a Metadata,
    /// The payload of `tXTR`.
    texture: Option<&'a [u8]>,
    /// Most bytes of the file that the first layer makes; `None` for one with its usual share.
    first_layer: Option<u32>,
}

impl<'a> FileLayout<'a> {
    /// `mean` is the mean of each channel, where a full sample is 1; it becomes the base colour.
    pub(crate) fn new(
        source: &Source<'_>,
        mean: [f32; 4],
        kernel: Kernel,
        parameterization: Parameterization,
        metadata: &'a Metadata,
    ) -> Self {
        let header = Header {
            depth: source.depth(),
            kernel,
            parameterization,
            base_color: mean.map(|value| match source.depth() {
                SampleDepth::Eight => (value * 255.0).round() as u16 * 257,
                SampleDepth::Sixteen => (value * 65535.0).round() as u16,
            }),
            ..Header::new(source.width(), source.height(), source.color())
        };
        Self::of(header, metadata)
    }

    /// That of Gaussians that come with a header, of which the numbers of another file do not matter.
    pub(crate) fn of_fitted(header: &Header, metadata: &'a Metadata) -> Self {
        let &Header { width, height, color, depth, kernel, base_color, .. } = header;
        let header = Header { depth, kernel, base_color, ..Header::new(width, height, color) };
        Self::of(header, metadata)
    }

    /// That of pictures with this header.
    pub(crate) fn of(header: Header, metadata: &'a Metadata) -> Self {
        Self { header, metadata, texture: None, first_layer: None }
    }

    /// The same with a first layer that makes a file of at most so many bytes ([`Prefixes`](crate::Prefixes)).
    pub(crate) fn with_first_layer(self, bytes: Option<u32>) -> Self {
        Self { first_layer: bytes, ..self }
    }

    /// The same with a texture, unless the payload is `None`.
    pub(crate) fn with_texture<'b>(&self, texture: Option<&'b [u8]>) -> FileLayout<'b>
    where
        'a: 'b,
    {
        let first_layer = self.first_layer;
        FileLayout { header: self.header.clone(), metadata: self.metadata, texture, first_layer }
    }

    /// The header. Its coding and its numbers of Gaussians and layers are those of an empty packed
    /// file.
    pub(crate) fn header(&self) -> &Header {
        &self.header
    }

    /// The base colour to which Gaussians are added, rounded as in the header.
    pub(crate) fn base(&self) -> [f32; 4] {
        self.header.base()
    }

    /// What a file with so many Gaussians begins with, as far as its limits are concerned.
    pub(crate) fn start(&self, gaussians: u32) -> Vec<u8> {
        let layers = u16::from(gaussians > 0);
        let header = Header { gaussians, layers, ..self.header.clone() };
        let mut file = ChunkWriter::new();
        let quantizers = Dequantizer::Packed(vec![Quantizer::Float; header.components()]);
        file.chunk(ChunkType::HEADER, &[&header.to_payload(Some(&quantizers))]);
        for (kind, payload) in self.metadata.chunks() {
            file.chunk(kind, &[&payload]);
        }
        file.into_bytes()
    }

    /// Size in bytes of a file with the packed coding and so many Gaussians.
    pub(crate) fn packed_length(&self, quantizers: &[Quantizer], gaussians: usize) -> u64 {
        let (layers, length) = layers::packed_layers_length(quantizers, gaussians);
        let header =
            Header { gaussians: gaussians as u32, layers: layers as u16, ..self.header.clone() };
        let header = header.to_payload(Some(&Dequantizer::Packed(quantizers.to_vec())));
        ChunkWriter::length(header.len(), self.metadata_length()) as u64 + length
    }

    /// A file with the packed coding. Its codes are sorted as [`FileLayout::ordered`] does.
    pub(crate) fn write_packed(&self, packed: &PackedCodes) -> Vec<u8> {
        let PackedCodes { quantizers, codes } = self.ordered(packed);
        let layers = layers::write_packed_layers(&codes, &quantizers);
        let layers = layers.iter().map(|(count, bytes)| (*count, &bytes[..]));
        let header =
            Header { coding: Coding::Packed, gaussians: codes.len() as u32, ..self.header.clone() };
        self.write(&header, &Dequantizer::Packed(quantizers), None, layers)
    }

    /// The layers that codes make in a file.
    pub(crate) fn coded(
        &self,
        QuantizedCodes { quantization, mut codes }: QuantizedCodes,
        observer: &mut Observer<'_>,
    ) -> Result<CodedLayers> {
        let coder = self.header.layer_coder(&quantization);
        let room =
            self.first_layer.map(|bytes| (bytes as usize).saturating_sub(self.least_prefix()));
        let layers = layers::write_entropy_layers(&coder, &mut codes, room, observer)?;
        Ok(CodedLayers { quantization, codes, layers })
    }

    /// A file with the entropy coding.
    pub(crate) fn write_entropy(
        &self,
        coded: &CodedLayers,
        observer: &mut Observer<'_>,
    ) -> Result<Vec<u8>> {
        let CodedLayers { quantization, codes, layers } = coded;
        let header = Header {
            coding: Coding::Entropy,
            parameterization: Parameterization::Cholesky,
            gaussians: codes.len() as u32,
            ..self.header.clone()
        };
        let coder = header.layer_coder(quantization);
        let bounds = layers::bounds_payload(&coder, codes, layers, &header, observer)?;
        let layers = layers.iter().map(|layer| (layer.count(), &layer.bytes[..]));
        Ok(self.write(&header, &Dequantizer::Entropy(quantization.clone()), bounds, layers))
    }

    /// Bytes of a file of one layer, and of what says how the picture is shown, less those of the coded Gaussians.
    fn least_prefix(&self) -> usize {
        // With Gaussians, it has their steps as well, and a byte for the number of layers.
        let header = self.header.to_payload(None).len();
        let header = header + steps::usual_length(self.header.color.channels()) + 1;
        let shown = self.metadata.chunks().filter_map(|(kind, payload)| {
            Some(kind.framed(Metadata::for_placeholder(kind, &payload)?.len()))
        });
        let shown = shown.sum::<usize>();
        ChunkWriter::length(header, shown + ChunkType::LAYER.framed(0)) + BYTES_OF_NUMBERS
    }

    /// Refuses a first layer that has no room for a Gaussian.
    pub(crate) fn check_first_layer(&self) -> Result<(), OptionError> {
        let least = (self.least_prefix() + BYTES_OF_GAUSSIAN) as u32;
        match self.first_layer {
            Some(bytes) if bytes < least => Err(OptionError::FirstLayer { bytes, least }),
            _ => Ok(()),
        }
    }

    /// A file of either coding, from its layers: the numbers of their Gaussians, and their bytes.
    fn write<'b>(
        &self,
        header: &Header,
        dequantizer: &Dequantizer,
        bounds: Option<Vec<u8>>,
        layers: impl ExactSizeIterator<Item = (usize, &'b [u8])>,
    ) -> Vec<u8> {
        let header = Header { layers: layers.len() as u16, ..header.clone() };
        let last = layers.len().saturating_sub(1);
        let mut file = ChunkWriter::new();
        file.chunk(ChunkType::HEADER, &[&header.to_payload(Some(dequantizer))]);
        let mut early: Vec<_> = self.metadata.chunks().collect();
        early.extend(bounds.map(|bounds| (ChunkType::BNDS, bounds)));
        let mut late = Vec::new();
        if self.first_layer.is_some() && last > 0 {
            // What need not be known at once stands after a first layer that is to come early.
            (early, late) = early
                .into_iter()
                .partition(|(kind, payload)| Metadata::is_of_display(*kind, payload));
        }
        early.iter().for_each(|(kind, payload)| file.chunk(*kind, &[payload]));
        for (number, (count, bytes)) in layers.enumerate() {
            if number == 1 {
                late.iter().for_each(|(kind, payload)| file.chunk(*kind, &[payload]));
            }
            // What has few Gaussians yet looks better without noise.
            if let Some(texture) = self.texture.filter(|_| number == last) {
                file.chunk(ChunkType::TXTR, &[texture]);
            }
            let count = LayerCount::written(count as u32, number == last);
            file.chunk(ChunkType::LAYER, &[&count, bytes]);
        }
        file.finish()
    }

    /// Size in bytes of the metadata.
    pub(crate) fn metadata_length(&self) -> usize {
        self.metadata.chunks().map(|(kind, payload)| kind.framed(payload.len())).sum()
    }

    /// Refuses a target of `bytes` that a file without Gaussians, of `least`, exceeds by its metadata
    /// alone.
    pub(crate) fn check_size(&self, bytes: u64, least: u64) -> Result<(), OptionError> {
        let metadata = self.metadata_length() as u64;
        if (least - metadata..least).contains(&bytes) {
            return Err(OptionError::Size { bytes, least, metadata });
        }
        Ok(())
    }

    /// The codes sorted by the energy of their Gaussians, largest first, so that every prefix
    /// of the file is a picture.
    pub(crate) fn ordered(&self, fitted: &PackedCodes) -> PackedCodes {
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
                let gaussian = Gaussian::from_components(values, self.header.parameterization);
                (gaussian.energy(), codes)
            })
            .collect();
        order.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let codes = order.into_iter().map(|(_, codes)| *codes).collect();
        PackedCodes { quantizers: fitted.quantizers.clone(), codes }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coding::entropy::{CenterGrid, Code};
    use crate::coding::packed::UniformQuantizer;
    use crate::color::ColorModel;
    use crate::decode::Decoder;
    use crate::encode::progress::unobserved;
    use crate::encode::rate_model;
    use crate::encode::testing::source;
    use crate::region::Region;
    use crate::render::RenderOptions;

    const SIDES: [u32; 2] = [900, 700];

    /// A file of random Gaussians, some of them outside the picture.
    fn file(count: usize) -> Vec<u8> {
        let [width, height] = SIDES;
        let samples = vec![9; (width * height) as usize];
        let source = source(SIDES.map(|side| side as usize), ColorModel::Gray, &samples);
        let metadata = Metadata::default();
        let layout = FileLayout::new(
            &source,
            [0.0; 4],
            Kernel::Quartic,
            Parameterization::Cholesky,
            &metadata,
        );
        let grid = CenterGrid::new(width, height);
        let mut random = fastrand::Rng::with_seed(3);
        let mut code = || Code {
            exponent: 2,
            color: [random.i32(-20..=20), 0, 0, 0],
            size: random.i32(-6..=6),
            ratio: random.i32(-3..=3),
            slant: random.i32(-3..=3),
            center: grid.units(SIDES.map(|side| random.f32() * (side as f32 + 60.0) - 30.0)),
        };
        let codes = (0..count).map(|_| code()).collect();
        let quantization = rate_model::quantization(0.0, &[1.0]);
        unobserved(|observer| {
            let coded = layout.coded(QuantizedCodes { quantization, codes }, observer)?;
            layout.write_entropy(&coded, observer)
        })
    }

    /// The samples of a region, and how many Gaussians the decoder keeps. If `all`, it decodes the
    /// whole file first.
    fn decoded(file: &[u8], options: &RenderOptions, all: bool) -> (Vec<u8>, usize) {
        let mut decoder = Decoder::new(file).expect("the header is valid");
        if all {
            decoder.read_to_end().expect("the file is valid");
        }
        decoder.set_options(options.clone());
        let mut samples = vec![0; decoder.output_len().expect("it is within the limits")];
        decoder.decode_into(&mut samples).expect("the file is valid");
        (samples, decoder.stream().gaussians().len())
    }

    #[test]
    fn the_length_of_a_packed_file_is_known_before_its_codes() {
        let samples = [9; 12];
        let source = source([2, 2], ColorModel::Rgb, &samples);
        let metadata = Metadata { xmp: Some(vec![b'x'; 200]), ..Metadata::default() };
        let kernel = Kernel::Exponential { cutoff: 9.0 };
        let shape = Parameterization::Covariance;
        let layout = FileLayout::new(&source, [0.5; 4], kernel, shape, &metadata);
        let steps = UniformQuantizer { bits: 9, scale: 1.0, offset: 0.0 };
        let mut quantizers = vec![Quantizer::Linear(steps); layout.header().components()];
        quantizers[1] = Quantizer::Float;
        for count in [0, 1, 127, 128, 511, 512, 4000, 20_000] {
            let codes = vec![[0; MAX_COMPONENTS]; count];
            let file = layout.write_packed(&PackedCodes { quantizers: quantizers.clone(), codes });
            assert_eq!(layout.packed_length(&quantizers, count), file.len() as u64, "{count}");
        }
    }

    #[test]
    fn a_region_of_a_large_picture_is_that_part_of_it() {
        let file = file(33_000);
        for (scale, x, y) in [(1, 0, 0), (1, 430, 330), (1, 860, 660), (3, 2000, 800)] {
            let region = Region { x, y, width: 40, height: 40 };
            let options = RenderOptions::new().with_size(SIDES[0] * scale, SIDES[1] * scale);
            let options = options.with_region(region);
            let (expected, gaussians) = decoded(&file, &options, true);
            assert_eq!(gaussians, 33_000);
            // Gaussians that are decoded for a region alone are not kept.
            assert_eq!(decoded(&file, &options, false), (expected, 0), "{region:?}");
        }
    }

    #[test]
    fn a_file_of_few_layers_has_no_bounds_and_is_decoded_whole() {
        let options = RenderOptions::new().with_region(Region { x: 0, y: 0, width: 9, height: 9 });
        assert_eq!(decoded(&file(3000), &options, false).1, 3000);
    }
}
