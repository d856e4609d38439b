//! `gip info`.

use core::fmt::{self, Display};
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result, anyhow};
use image_gip::{
    ChunkType, Cicp, Coding, ColorModel, ContentLight, Header, Kernel, MasteringDisplay,
    Parameterization, Prefix, Prefixes, Quantizer, StreamDecoder,
};
use serde::Serialize;

use crate::args;
use crate::cicp;
use crate::decode::skipped;
use crate::encode::bits_per_pixel;
use crate::errors::{SOME_FAILED, one_line};
use crate::files;

/// How many prefixes the text shows.
const SHOWN_PREFIXES: usize = 3;

pub(crate) fn run(args: &args::Info) -> Result<ExitCode> {
    if let [path] = &args.files[..] {
        files::print(&told(path, args)?, None)?;
        return Ok(ExitCode::SUCCESS);
    }
    let (mut shown, mut failed) = (0, false);
    for path in &args.files {
        match told(path, args) {
            Ok(json) if args.json => files::print(&json, None)?,
            Ok(text) => {
                let space = if shown > 0 { "\n" } else { "" };
                files::print(&format!("{space}{}:\n{text}", files::input_name(path)), None)?;
                shown += 1;
            }
            Err(error) => {
                files::tell(&format!("error: {}", one_line(&error)));
                failed = true;
            }
        }
    }
    Ok(if failed { ExitCode::from(SOME_FAILED) } else { ExitCode::SUCCESS })
}

/// What is printed of a file.
fn told(path: &Path, args: &args::Info) -> Result<String> {
    let context = || files::input_name(path);
    let bytes = files::read(path)?;
    let mut stream = StreamDecoder::new().with_limits(args.limits.limits()).with_statistics();
    stream.feed(&bytes).and_then(|_| stream.finish()).with_context(context)?;
    let header = stream.header().ok_or_else(|| anyhow!("the file has no header"))?;
    let prefixes = Prefixes::new(&bytes).with_context(context)?;
    let name = files::unique_text(path);
    let info = FileInfo::new(name, header, &stream, &prefixes, bytes.len());
    Ok(if args.json { serde_json::to_string(&info)? } else { info.to_string().trim_end().into() })
}

/// The name of a kernel, wherever the tool writes it.
pub(crate) fn kernel_name(kernel: Kernel) -> &'static str {
    match kernel {
        Kernel::Exponential { .. } => "exponential",
        Kernel::Quartic => "quartic",
        _ => "unknown",
    }
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct FileInfo {
    file: String,
    bytes: usize,
    bpp: f64,
    version: u8,
    coding: &'static str,
    width: u32,
    height: u32,
    /// As Exif counts it.
    orientation: u8,
    upright_width: u32,
    upright_height: u32,
    color: &'static str,
    channels: usize,
    depth: u8,
    gaussians: u32,
    layers: u16,
    kernel: &'static str,
    cutoff: f32,
    parameterization: &'static str,
    base_color: Vec<u16>,
    chunks: Vec<Chunk>,
    bits_per_gaussian: BitsPerGaussian,
    /// The files that the first layers make.
    prefixes: Vec<PrefixInfo>,
    /// Of the packed coding; empty with the entropy coding.
    components: Vec<Component>,
    /// Of the entropy coding; `None` with the packed coding.
    quantization_steps: Option<StepSizes>,
    /// `None` without texture.
    texture: Option<Texture>,
    metadata: MetadataSizes,
    /// Chunks that break a rule and are skipped.
    warnings: Vec<String>,
}

/// The texture: the Gaussians of its map, and what its chunk takes; `None` if the file has other chunks of the
/// type, which are skipped and counted with it.
#[derive(Debug, Serialize)]
struct Texture {
    gaussians: usize,
    bytes: Option<u64>,
    bits_per_gaussian: Option<f64>,
}

/// What the first layers are: so many Gaussians, which end at this byte of the file, and what `gip prefix` writes.
#[derive(Debug, Serialize)]
struct PrefixInfo {
    layers: u16,
    gaussians: u32,
    end: usize,
    bytes: usize,
}

/// The chunks of one type. Their bytes include type, length and CRC.
#[derive(Debug, Serialize)]
struct Chunk {
    /// The letters of the type.
    kind: String,
    /// With what they stand for, for people.
    #[serde(skip)]
    name: String,
    count: u32,
    bytes: u64,
}

#[derive(Debug, Serialize)]
struct BitsPerGaussian {
    /// The bits of all layers, framing included, divided by the number of Gaussians; `None`
    /// without Gaussians.
    coded: Option<f64>,
    /// The sum of the attributes below.
    total: f64,
    position: f64,
    precision: f64,
    shape: f64,
    color: f64,
}

/// How one component of every Gaussian is stored.
#[derive(Debug, Serialize)]
struct Component {
    attribute: &'static str,
    name: &'static str,
    kind: &'static str,
    bits: u8,
    scale: Option<f32>,
    offset: Option<f32>,
}

/// The quantization steps of the entropy coding (spec, section 7.5).
#[derive(Debug, Serialize)]
struct StepSizes {
    position: f32,
    size: f32,
    ratio: f32,
    slant: f32,
    color: Vec<f32>,
}

impl From<image_gip::QuantizationSteps> for StepSizes {
    fn from(steps: image_gip::QuantizationSteps) -> Self {
        let image_gip::QuantizationSteps { position, size, ratio, slant, color, .. } = steps;
        Self { position, size, ratio, slant, color }
    }
}

/// The colour space, as PNG's `cICP` has it.
#[derive(Debug, Serialize)]
struct ColorSpace {
    primaries: u8,
    transfer: u8,
}

/// The display on which the picture was made.
#[derive(Debug, Serialize)]
struct Mastering {
    /// CIE 1931 x and y.
    red: [f64; 2],
    green: [f64; 2],
    blue: [f64; 2],
    white: [f64; 2],
    /// In cd/m².
    max_luminance: f64,
    min_luminance: f64,
}

/// How bright the picture is, in cd/m²; 0 if it is not known.
#[derive(Debug, Serialize)]
struct Light {
    max_content: f64,
    max_frame_average: f64,
}

impl From<MasteringDisplay> for Mastering {
    fn from(display: MasteringDisplay) -> Self {
        let point = |point: [u16; 2]| point.map(|value| f64::from(value) / 50_000.0);
        Self {
            red: point(display.red),
            green: point(display.green),
            blue: point(display.blue),
            white: point(display.white),
            max_luminance: luminance(display.max_luminance),
            min_luminance: luminance(display.min_luminance),
        }
    }
}

impl From<ContentLight> for Light {
    fn from(light: ContentLight) -> Self {
        Self {
            max_content: luminance(light.max_content),
            max_frame_average: luminance(light.max_frame_average),
        }
    }
}

/// In cd/m², of a number of 0.0001 cd/m².
fn luminance(stored: u32) -> f64 {
    f64::from(stored) / 10_000.0
}

/// What the metadata say of colours, and sizes in bytes of each other kind.
#[derive(Debug, Serialize)]
struct MetadataSizes {
    cicp: Option<ColorSpace>,
    mastering_display: Option<Mastering>,
    content_light: Option<Light>,
    icc_profile: Option<usize>,
    exif: Option<usize>,
    xmp: Option<usize>,
    texts: Vec<TextSize>,
}

#[derive(Debug, Serialize)]
struct TextSize {
    keyword: String,
    bytes: usize,
}

impl FileInfo {
    fn new(
        file: String,
        header: &Header,
        stream: &StreamDecoder,
        prefixes: &Prefixes<'_>,
        bytes: usize,
    ) -> Self {
        let channels = header.color.channels();
        let components = components(header, stream.quantizers());
        let chunks = stream.chunks();
        let layers = chunks.iter().find(|chunk| chunk.kind == ChunkType::LAYER);
        let map = stream.picture().and_then(|picture| picture.texture_map());
        let texture = map.map(|map| {
            let gaussians = map.gaussians().len();
            let only = chunks.iter().find(|c| c.kind == ChunkType::TXTR && c.count == 1);
            let bytes = only.map(|chunk| chunk.bytes);
            let bits_per_gaussian = bytes.map(|bytes| bytes as f64 * 8.0 / gaussians.max(1) as f64);
            Texture { gaussians, bytes, bits_per_gaussian }
        });
        let gaussians = f64::from(header.gaussians.max(1));
        let bits = stream.attribute_bits().unwrap_or_default();
        let bits_per_gaussian = BitsPerGaussian {
            coded: layers.map(|l| l.bytes as f64 * 8.0 / gaussians),
            total: (bits.position + bits.precision + bits.shape + bits.color) / gaussians,
            position: bits.position / gaussians,
            precision: bits.precision / gaussians,
            shape: bits.shape / gaussians,
            color: bits.color / gaussians,
        };
        let metadata = stream.metadata();
        let orientation = metadata.orientation();
        let (upright_width, upright_height) = orientation.turned_size(header.width, header.height);
        let size = |blob: &Option<Vec<u8>>| blob.as_ref().map(Vec::len);
        Self {
            file,
            bytes,
            bpp: bits_per_pixel(bytes, header.width, header.height),
            version: header.version,
            coding: match header.coding {
                Coding::Packed => "packed",
                Coding::Entropy => "entropy",
                _ => "unknown",
            },
            width: header.width,
            height: header.height,
            orientation: orientation.to_exif(),
            upright_width,
            upright_height,
            color: match header.color {
                ColorModel::Gray => "gray",
                ColorModel::GrayAlpha => "gray-alpha",
                ColorModel::Rgb => "rgb",
                ColorModel::Rgba => "rgba",
                _ => "unknown",
            },
            channels,
            depth: header.depth.bits(),
            gaussians: header.gaussians,
            layers: header.layers,
            kernel: kernel_name(header.kernel),
            cutoff: header.kernel.cutoff(),
            parameterization: match header.parameterization {
                Parameterization::Covariance => "covariance",
                Parameterization::Cholesky => "cholesky",
                Parameterization::RotationScale => "rotation-scale",
                _ => "unknown",
            },
            base_color: header.base_color[..channels].to_vec(),
            chunks: chunks
                .iter()
                .map(|c| Chunk {
                    kind: c.kind.letters().to_string(),
                    name: c.kind.to_string(),
                    count: c.count,
                    bytes: c.bytes,
                })
                .collect(),
            bits_per_gaussian,
            prefixes: prefixes
                .iter()
                .map(|Prefix { layers, gaussians, end, bytes, .. }| PrefixInfo {
                    layers,
                    gaussians,
                    end,
                    bytes,
                })
                .collect(),
            components,
            quantization_steps: stream.quantization_steps().map(StepSizes::from),
            texture,
            metadata: MetadataSizes {
                cicp: metadata
                    .cicp
                    .map(|Cicp { primaries, transfer, .. }| ColorSpace { primaries, transfer }),
                mastering_display: metadata.mastering_display.map(Mastering::from),
                content_light: metadata.content_light.map(Light::from),
                icc_profile: size(&metadata.icc_profile),
                exif: size(&metadata.exif),
                xmp: size(&metadata.xmp),
                texts: metadata
                    .texts
                    .iter()
                    .map(|text| TextSize { keyword: text.keyword.clone(), bytes: text.text.len() })
                    .collect(),
            },
            warnings: skipped(stream),
        }
    }
}

/// So many layers, in words.
fn plural(layers: u16) -> String {
    if layers == 1 { "1 layer".into() } else { format!("{layers} layers") }
}

/// The stored components in file order.
fn components(header: &Header, quantizers: &[Quantizer]) -> Vec<Component> {
    let shape = match header.parameterization {
        Parameterization::Covariance => ["xx", "xy", "yy"],
        Parameterization::Cholesky => ["l11", "l21", "l22"],
        Parameterization::RotationScale => ["s1", "s2", "angle"],
        _ => ["1", "2", "3"],
    };
    let color: &[_] = match header.color {
        ColorModel::Gray => &["gray"],
        ColorModel::GrayAlpha => &["gray", "alpha"],
        _ => &["red", "green", "blue", "alpha"],
    };
    let position = ["x", "y"].map(|name| ("position", name));
    let shape = shape.map(|name| ("shape", name));
    let color = color.iter().map(|&name| ("color", name));
    let names = position.into_iter().chain(shape).chain(color);
    names
        .zip(quantizers)
        .map(|((attribute, name), quantizer)| {
            let (kind, steps) = match quantizer {
                Quantizer::Float => ("float", None),
                Quantizer::Linear(steps) => ("linear", Some(steps)),
                Quantizer::Log(steps) => ("log", Some(steps)),
                _ => ("unknown", None),
            };
            Component {
                attribute,
                name,
                kind,
                bits: quantizer.bits(),
                scale: steps.map(|steps| steps.scale),
                offset: steps.map(|steps| steps.offset),
            }
        })
        .collect()
}

impl Display for FileInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { width, height, color, depth, kernel, cutoff, .. } = self;
        let bits = &self.bits_per_gaussian;
        let mut row = |name: &str, value: &dyn Display| writeln!(f, "{name:<20}{value}");
        row("size", &format_args!("{width}x{height}, {color}, {depth} bits per sample"))?;
        if self.orientation != 1 {
            let Self { orientation, upright_width: width, upright_height: height, .. } = self;
            row(
                "upright",
                &format_args!("{width}x{height}, by orientation {orientation} of Exif"),
            )?;
        }
        row("file", &format_args!("{} bytes, {:.3} bits per pixel", self.bytes, self.bpp))?;
        row("version", &self.version)?;
        let layers = plural(self.layers);
        row("Gaussians", &format_args!("{} in {layers}", self.gaussians))?;
        row("kernel", &format_args!("{kernel}, cut-off {cutoff}"))?;
        row("parameterization", &self.parameterization)?;
        row("base colour", &format_args!("{:?} / 65535", self.base_color))?;
        row("coding", &self.coding)?;
        let BitsPerGaussian { total, position, precision, shape, color, .. } = bits;
        row(
            "bits per Gaussian",
            &format_args!(
                "{total:.2}: position {position:.2}, precision {precision:.2}, shape {shape:.2}, \
                 colour {color:.2}"
            ),
        )?;
        if let Some(coded) = bits.coded {
            row("  with framing", &format_args!("{coded:.2}"))?;
        }
        if let Some(StepSizes { position, size, ratio, slant, color }) = &self.quantization_steps {
            row(
                "  steps",
                &format_args!(
                    "position {position}, size {size}, ratio {ratio}, slant {slant}, colour \
                     {color:?}"
                ),
            )?;
        }
        for component in &self.components {
            let Component { attribute, name, kind, bits, scale, offset } = component;
            let steps = match (scale, offset) {
                (Some(scale), Some(offset)) => format!(", scale {scale:e}, offset {offset:e}"),
                _ => String::new(),
            };
            let name = format!("  {attribute} {name}");
            row(&name, &format_args!("{kind}, {bits} bits{steps}"))?;
        }
        if let Some(Texture { gaussians, bytes, bits_per_gaussian }) = &self.texture {
            let size = match (bytes, bits_per_gaussian) {
                (Some(bytes), Some(bits)) => {
                    format!(", {bytes} bytes, {bits:.2} bits per Gaussian")
                }
                _ => String::new(),
            };
            row("texture", &format_args!("{gaussians} Gaussians{size}"))?;
        }
        // Of many layers, those of a picture of its parts are of no interest.
        for PrefixInfo { layers, gaussians, bytes, .. } in self.prefixes.iter().take(SHOWN_PREFIXES)
        {
            let name = format!("prefix of {}", plural(*layers));
            row(&name, &format_args!("{gaussians} Gaussians, {bytes} bytes"))?;
        }
        for Chunk { name, count, bytes, .. } in &self.chunks {
            row(&format!("chunk {name}"), &format_args!("{count}, {bytes} bytes"))?;
        }
        for warning in &self.warnings {
            row("warning", warning)?;
        }
        let MetadataSizes { icc_profile, exif, xmp, texts, .. } = &self.metadata;
        if let Some(ColorSpace { primaries, transfer }) = self.metadata.cicp {
            row("colour space", &cicp::name(Cicp::new(primaries, transfer)))?;
        }
        if let Some(display) = &self.metadata.mastering_display {
            let Mastering { min_luminance: least, max_luminance: most, .. } = display;
            row("mastering display", &format_args!("{least} to {most} cd/m²"))?;
        }
        if let Some(Light { max_content, max_frame_average }) = &self.metadata.content_light {
            row(
                "content light",
                &format_args!("{max_content} cd/m² at most, {max_frame_average} cd/m² in the mean"),
            )?;
        }
        for (name, bytes) in [("ICC profile", icc_profile), ("Exif", exif), ("XMP", xmp)] {
            if let Some(bytes) = bytes {
                row(name, &format_args!("{bytes} bytes"))?;
            }
        }
        for TextSize { keyword, bytes } in texts {
            row("text", &format_args!("{}, {bytes} bytes", keyword.escape_debug()))?;
        }
        Ok(())
    }
}
