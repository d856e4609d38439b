//! PLY with the properties of 3D Gaussian splatting (Kerbl et al. 2023), which its viewers read. The format is
//! described in docs/gaussians.md.

use anyhow::{Context, Result, anyhow, bail};
use image_gip::{Gaussian, Header, Kernel};

use super::model::{BYTE_ORDER_MARK, Fields, Imported, Spots, amplitudes, factor_of};
use crate::args;

/// The spherical harmonic of degree 0, by which viewers multiply `f_dc`; 0.5 is added then.
const HARMONIC: f64 = 0.282_094_791_773_878_14;
/// The logit that stands for an opacity of 1: rounded to a float, its sigmoid is that.
const OPAQUE: f32 = 20.0;
/// The standard deviation of the Gaussians across the picture, in pixels.
const THICKNESS: f64 = 1e-3;
/// How the comments begin that hold the header.
const COMMENT: &str = "gip ";
/// Longest header that is read, in bytes, and most properties of a vertex.
const MAX_HEADER: usize = 1 << 16;
const MAX_PROPERTIES: usize = 1024;

/// The properties that are always there. After them, pictures with alpha have its amplitude.
const PROPERTIES: [&str; 17] = [
    "x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1",
    "scale_2", "rot_0", "rot_1", "rot_2", "rot_3",
];
const ALPHA: &str = "alpha";

/// The picture in binary.
pub(crate) fn write(spots: &Spots) -> Vec<u8> {
    let Spots { header, gaussians } = spots;
    let Fields { width, height, depth, kernel, cutoff, base_color } = Fields::of(header);
    let base: Vec<String> = base_color.iter().flatten().map(u16::to_string).collect();
    let mut text = String::from("ply\nformat binary_little_endian 1.0\n");
    for (name, value) in [
        ("width", width.unwrap_or_default().to_string()),
        ("height", height.unwrap_or_default().to_string()),
        ("depth", depth.unwrap_or_default().to_string()),
        ("kernel", kernel.unwrap_or_default()),
        ("cutoff", cutoff.unwrap_or_default().to_string()),
        ("base_color", base.join(",")),
    ] {
        text.push_str(&format!("comment {COMMENT}{name} {value}\n"));
    }
    text.push_str(&format!("element vertex {}\n", gaussians.len()));
    let has_alpha = header.color.has_alpha();
    for name in PROPERTIES.iter().chain(has_alpha.then_some(&ALPHA)) {
        text.push_str(&format!("property float {name}\n"));
    }
    text.push_str("end_header\n");
    let mut bytes = text.into_bytes();
    for gaussian in gaussians {
        bytes.extend(vertex(gaussian, header).into_iter().flat_map(f32::to_le_bytes));
    }
    bytes
}

/// The properties of a Gaussian.
fn vertex(gaussian: &Gaussian, header: &Header) -> Vec<f32> {
    let channels = header.color.channels();
    let colors = channels - usize::from(header.color.has_alpha());
    // Gray is shown as three equal colours.
    let f_dc = [0, 1, 2].map(|color: usize| {
        let channel = color.min(colors - 1);
        let base = f64::from(header.base_color[channel]) / 65535.0;
        ((f64::from(gaussian.color[channel]) + base - 0.5) / HARMONIC) as f32
    });
    let (scales, angle) = axes(gaussian.cholesky);
    let scales = [scales[0], scales[1], THICKNESS].map(|scale| scale.ln() as f32);
    // A turn by the angle around z.
    let (sin, cos) = (angle / 2.0).sin_cos();
    let [x, y] = gaussian.center;
    let mut values = vec![x, y, 0.0, 0.0, 0.0, 1.0];
    values.extend(f_dc);
    values.push(OPAQUE);
    values.extend(scales);
    values.extend([cos as f32, 0.0, 0.0, sin as f32]);
    if header.color.has_alpha() {
        values.push(gaussian.color[colors]);
    }
    values
}

/// The standard deviations along the axes of a Gaussian, and the angle from x to the first one.
fn axes(cholesky: [f32; 3]) -> ([f64; 2], f64) {
    let [l11, l21, l22] = cholesky.map(f64::from);
    let (xx, xy, yy) = (l11 * l11, l11 * l21, l21 * l21 + l22 * l22);
    let (mean, half) = ((xx + yy) / 2.0, (xx - yy) / 2.0);
    let long = (mean + half.hypot(xy)).sqrt();
    // By the determinant, as a difference would lose the digits of thin ones.
    ([long, l11 * l22 / long], xy.atan2(half) / 2.0)
}

/// The type of a property.
#[derive(Clone, Copy, Debug)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Takes a number from the beginning of bytes.
    fn take(self, bytes: &mut &[u8], big: bool) -> Option<f64> {
        macro_rules! take {
            ($type:ty) => {{
                let (number, rest) = bytes.split_first_chunk()?;
                *bytes = rest;
                let number = if big {
                    <$type>::from_be_bytes(*number)
                } else {
                    <$type>::from_le_bytes(*number)
                };
                f64::from(number)
            }};
        }
        Some(match self {
            Self::I8 => take!(i8),
            Self::U8 => take!(u8),
            Self::I16 => take!(i16),
            Self::U16 => take!(u16),
            Self::I32 => take!(i32),
            Self::U32 => take!(u32),
            Self::F32 => take!(f32),
            Self::F64 => take!(f64),
        })
    }
}

/// How the numbers are written.
#[derive(Clone, Copy, Debug)]
enum Encoding {
    Ascii,
    Binary { big: bool },
}

/// The header of a PLY.
#[derive(Debug)]
struct PlyHeader {
    encoding: Encoding,
    fields: Fields,
    vertices: usize,
    properties: Vec<(String, Scalar)>,
    /// Lines of the header.
    lines: usize,
}

/// Reads a PLY: of this tool, or of 3D Gaussians, which are looked at along z and added up. Amplitudes are what the shown
/// colours are over the base colour that the file says; else over that of the arguments.
pub(crate) fn read(bytes: &[u8], args: &args::HeaderArgs) -> Result<Imported> {
    let bytes = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
    // A comment may have the same word.
    let end = b"\nend_header";
    let end = bytes.windows(end.len()).take(MAX_HEADER).position(|part| part == end);
    let (text, rest) = bytes.split_at(end.context("not a PLY file: it has no end_header")? + 1);
    let after = rest.iter().position(|&byte| byte == b'\n').context("it ends in its header")?;
    // Comments may have any encoding.
    let header = parse_header(&String::from_utf8_lossy(text))?;
    let names: Vec<&str> = header.properties.iter().map(|(name, _)| &**name).collect();
    let at = |name: &str| names.iter().position(|&known| known == name);
    let required = |name: &str| at(name).with_context(|| format!("it has no property {name}"));
    let columns = Columns {
        center: [required("x")?, required("y")?],
        f_dc: ["f_dc_0", "f_dc_1", "f_dc_2"].map(required).into_iter().collect::<Result<_>>()?,
        scales: [required("scale_0")?, required("scale_1")?],
        depth: at("scale_2"),
        rotation: ["rot_0", "rot_1", "rot_2", "rot_3"]
            .map(required)
            .into_iter()
            .collect::<Result<_>>()?,
        opacity: at("opacity"),
        alpha: at(ALPHA),
    };
    let mut imported = Imported { fields: header.fields.clone(), ..Imported::default() };
    let ours = imported.fields.kernel.is_some();
    if !ours {
        // What viewers draw.
        imported.fields.kernel = Some("exponential".into());
        imported.fields.cutoff = Some(Kernel::PAPER.cutoff());
    }
    let has_alpha = columns.alpha.is_some();
    if imported.fields.base_color.is_none() {
        let channels = if has_alpha { 4 } else { 3 };
        imported.fields.base_color = args.base_color(imported.fields.depth, channels)?;
    }
    let of_base = imported.fields.base_color.as_ref().map(Vec::len);
    let channels = of_base.unwrap_or(if has_alpha { 4 } else { 3 });
    if !(1..=4).contains(&channels) || channels.is_multiple_of(2) != has_alpha {
        bail!("base_color has {channels} numbers, which do not fit the properties");
    }
    imported.channels = Some(channels);
    if names.iter().any(|name| name.starts_with("f_rest_")) {
        let warning = "colours that depend on the direction (f_rest) are left out";
        imported.warnings.push(warning.into());
    }
    let mut rows = Rows::new(&rest[after + 1..], &header)?;
    for index in 0..header.vertices {
        let row = rows.next_row(index)?;
        let gaussian = columns.gaussian(row, channels, imported.fields.base_color.as_deref());
        imported.gaussians.push(gaussian.map_err(|rule| anyhow!("vertex {index}: {rule}"))?);
    }
    Ok(imported)
}

fn parse_header(text: &str) -> Result<PlyHeader> {
    let mut lines = text.lines().map(str::trim).enumerate();
    if lines.next().is_none_or(|(_, line)| line != "ply") {
        bail!("not a PLY file: its first line must be ply");
    }
    let (mut encoding, mut vertices, mut properties) = (None, None, Vec::new());
    let mut fields = Fields::default();
    // Elements after the vertices are not read.
    let mut is_after = false;
    for (index, line) in lines {
        let number = index + 1;
        let wrong = || format!("line {number} of its header: {line:?} is wrong");
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["format", name, "1.0"] => {
                encoding = Some(match name {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::Binary { big: false },
                    "binary_big_endian" => Encoding::Binary { big: true },
                    _ => bail!(wrong()),
                });
            }
            ["comment", "gip", name, value] => {
                set_field(&mut fields, name, value).with_context(wrong)?;
            }
            ["comment" | "obj_info", ..] | [] => {}
            ["element", "vertex", count] if vertices.is_none() => {
                vertices = Some(count.parse().with_context(wrong)?);
            }
            ["element", ..] if vertices.is_some() => is_after = true,
            ["element", name, _] => {
                bail!(
                    "its first element is {name}: only files that begin with their vertices are read"
                )
            }
            ["property", ..] if is_after => {}
            ["property", kind, name] if vertices.is_some() && properties.len() < MAX_PROPERTIES => {
                properties.push((name.to_owned(), Scalar::named(kind).with_context(wrong)?));
            }
            ["property", "list", ..] => {
                bail!("line {number} of its header: vertices with lists are not read")
            }
            _ => bail!(wrong()),
        }
    }
    Ok(PlyHeader {
        encoding: encoding.context("its header has no format")?,
        fields,
        vertices: vertices.context("it has no element vertex")?,
        properties,
        lines: text.lines().count() + 1,
    })
}

/// Sets a field of the picture's header from a comment. Those that are not known are skipped.
fn set_field(fields: &mut Fields, name: &str, value: &str) -> Result<()> {
    match name {
        "width" => fields.width = Some(value.parse()?),
        "height" => fields.height = Some(value.parse()?),
        "depth" => fields.depth = Some(value.parse()?),
        "kernel" => fields.kernel = Some(value.to_owned()),
        "cutoff" => fields.cutoff = Some(value.parse()?),
        "base_color" => {
            let numbers = value.split(',').map(str::parse).collect::<Result<_, _>>();
            fields.base_color = Some(numbers?);
        }
        _ => {}
    }
    Ok(())
}

/// The numbers of one vertex after the other.
struct Rows<'a> {
    encoding: Encoding,
    properties: &'a [(String, Scalar)],
    bytes: &'a [u8],
    lines: Option<core::str::Lines<'a>>,
    /// Lines that were read, with those of the header.
    line: usize,
    row: Vec<f64>,
}

impl<'a> Rows<'a> {
    fn new(bytes: &'a [u8], header: &'a PlyHeader) -> Result<Self> {
        let lines = match header.encoding {
            Encoding::Ascii => {
                Some(str::from_utf8(bytes).context("its vertices are no text")?.lines())
            }
            Encoding::Binary { .. } => None,
        };
        let PlyHeader { encoding, properties, lines: line, .. } = header;
        Ok(Self { encoding: *encoding, properties, bytes, lines, line: *line, row: Vec::new() })
    }

    fn next_row(&mut self, index: usize) -> Result<&[f64]> {
        self.row.clear();
        match self.encoding {
            Encoding::Binary { big } => {
                for (name, kind) in self.properties {
                    let number = kind.take(&mut self.bytes, big);
                    let number =
                        number.with_context(|| format!("it ends at {name} of vertex {index}"));
                    self.row.push(number?);
                }
            }
            Encoding::Ascii => {
                let lines = self.lines.as_mut().expect("they are text");
                let mut next = || {
                    self.line += 1;
                    lines.next().with_context(|| format!("it ends before vertex {index}"))
                };
                let mut line = next()?;
                while line.trim().is_empty() {
                    line = next()?;
                }
                let (number, wanted) = (self.line, self.properties.len());
                for word in line.split_whitespace() {
                    let wrong = || format!("line {number}: {word:?} is not a number");
                    self.row.push(word.parse().with_context(wrong)?);
                }
                let found = self.row.len();
                if found != wanted {
                    bail!("line {number}: {found} numbers; there must be {wanted}");
                }
            }
        }
        Ok(&self.row)
    }
}

/// Where the properties stand that are read.
struct Columns {
    center: [usize; 2],
    f_dc: Vec<usize>,
    scales: [usize; 2],
    depth: Option<usize>,
    rotation: Vec<usize>,
    opacity: Option<usize>,
    alpha: Option<usize>,
}

impl Columns {
    fn gaussian(
        &self,
        row: &[f64],
        channels: usize,
        base: Option<&[u16]>,
    ) -> Result<Gaussian, &'static str> {
        let opacity = self.opacity.map_or(1.0, |at| 1.0 / (1.0 + (-row[at]).exp())) as f32;
        let colors = channels - usize::from(self.alpha.is_some());
        let color = |channel: usize| {
            let base = base.map_or(0.0, |base| f64::from(base[channel]) / 65535.0);
            // What a viewer shows, over the base colour.
            f64::from(opacity) * (0.5 + HARMONIC * row[self.f_dc[channel]] - base)
        };
        let alpha = self.alpha.map(|at| row[at]);
        let color = amplitudes((0..colors).map(color).chain(alpha));

        let rotation: Vec<f64> = self.rotation.iter().map(|&at| row[at]).collect();
        let length = rotation.iter().map(|part| part * part).sum::<f64>().sqrt();
        if !(length.is_finite() && length > 0.0) {
            return Err("its rotation is no quaternion");
        }
        let [w, x, y, z] = [0, 1, 2, 3].map(|part| rotation[part] / length);
        // The first two rows of the rotation's matrix: what is seen along z.
        let rows = [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        ];
        let thickness = self.depth.map_or(0.0, |at| row[at].exp());
        let scales = [row[self.scales[0]].exp(), row[self.scales[1]].exp(), thickness];
        let scaled = rows.map(|row| [0, 1, 2].map(|axis| row[axis] * scales[axis]));
        let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let [a, b] = scaled;
        let cross =
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        // The root of the determinant, without the difference that loses the digits of thin ones.
        let (l11, root) = (dot(a, a).sqrt(), dot(cross, cross).sqrt());
        let factor = [l11, dot(a, b) / l11, root / l11];
        if !factor.iter().all(|entry| entry.is_finite()) {
            return Err("its scales are out of range");
        }
        let cholesky = factor_of(None, Some(factor))?;
        Ok(Gaussian { center: self.center.map(|at| row[at] as f32), cholesky, color })
    }
}
