//! JSON, as one object or as lines. The format is described in docs/gaussians.md.

use anyhow::{Context, Result, anyhow, bail};
use image_gip::Gaussian;
use serde::{Deserialize, Serialize};

use super::model::{Fields, Imported, Model, Spots, amplitudes, factor_of};

/// What tells the format from others.
const FORMAT: &str = "gip-gaussians";
const VERSION: u32 = 1;

/// The header, which is the first line, or has the Gaussians.
#[derive(Debug, Serialize, Deserialize)]
struct Head {
    format: String,
    version: u32,
    #[serde(flatten)]
    fields: Fields,
}

/// What the header says of the texture.
#[derive(Debug, Serialize)]
struct TextureHead {
    width: u32,
    height: u32,
    base_color: Vec<u16>,
}

/// A Gaussian. There may be either description of its shape.
#[derive(Debug, Deserialize)]
struct Spot {
    center: [f32; 2],
    cholesky: Option<[f64; 3]>,
    /// xx, xy, yy.
    covariance: Option<[f64; 3]>,
    color: Vec<f32>,
}

/// A Gaussian as it is written: floats as the shortest decimals that stand for them.
#[derive(Debug, Serialize)]
struct Written<'a> {
    center: [f32; 2],
    cholesky: [f32; 3],
    color: &'a [f32],
}

/// The Gaussians as text, one on each line.
fn lines(spots: &Spots) -> impl Iterator<Item = Result<String>> {
    let channels = spots.header.color.channels();
    spots.gaussians.iter().map(move |Gaussian { center, cholesky, color }| {
        let color = &color[..channels];
        Ok(serde_json::to_string(&Written { center: *center, cholesky: *cholesky, color })?)
    })
}

/// The header as text, without its last brace.
fn head(model: &Model) -> Result<String> {
    let fields = Fields::of(&model.picture.header);
    let head = Head { format: FORMAT.into(), version: VERSION, fields };
    let mut text = serde_json::to_string(&head)?;
    text.pop();
    Ok(text)
}

/// The header of the texture as text, without its last brace.
fn texture_head(texture: &Spots) -> Result<String> {
    let header = &texture.header;
    let base_color = header.base_color[..header.color.channels()].to_vec();
    let head = TextureHead { width: header.width, height: header.height, base_color };
    let mut text = serde_json::to_string(&head)?;
    text.pop();
    Ok(text)
}

/// The picture as lines: the header, a Gaussian each, and those of the texture with `"texture":`.
pub(crate) fn write_lines(model: &Model) -> Result<String> {
    let mut text = head(model)?;
    text.push_str(&format!(",\"gaussians\":{}", model.picture.gaussians.len()));
    if let Some(texture) = &model.texture {
        let count = texture.gaussians.len();
        text.push_str(&format!(",\"texture\":{},\"gaussians\":{count}}}", texture_head(texture)?));
    }
    text.push_str("}\n");
    for line in lines(&model.picture) {
        text.push_str(&line?);
        text.push('\n');
    }
    for line in model.texture.iter().flat_map(lines) {
        text.push_str(&format!("{{\"texture\":{}}}\n", line?));
    }
    Ok(text)
}

/// The picture as one object.
pub(crate) fn write_object(model: &Model) -> Result<String> {
    let list = |spots| {
        let lines: Vec<String> = lines(spots).collect::<Result<_>>()?;
        Ok::<_, anyhow::Error>(format!("\"gaussians\":[\n{}\n]", lines.join(",\n")))
    };
    let mut text = format!("{},\n{}", head(model)?, list(&model.picture)?);
    if let Some(texture) = &model.texture {
        text.push_str(&format!(",\n\"texture\":{},{}}}", texture_head(texture)?, list(texture)?));
    }
    text.push_str("}\n");
    Ok(text)
}

impl Imported {
    /// Adds a Gaussian that was read.
    fn push(&mut self, spot: &Spot) -> Result<()> {
        let index = self.gaussians.len();
        let channels = *self.channels.get_or_insert(spot.color.len());
        if spot.color.len() != channels {
            let found = spot.color.len();
            bail!("Gaussian {index}: its color has {found} numbers, and others have {channels}");
        }
        let cholesky = factor_of(spot.covariance, spot.cholesky);
        self.gaussians.push(Gaussian {
            center: spot.center,
            cholesky: cholesky.map_err(|rule| anyhow!("Gaussian {index}: {rule}"))?,
            color: amplitudes(spot.color.iter().copied().map(f64::from)),
        });
        Ok(())
    }

    fn take_head(&mut self, head: Head) -> Result<()> {
        if head.format != FORMAT {
            bail!("format {:?}; it must be {FORMAT:?}", head.format);
        }
        if head.version != VERSION {
            bail!("version {}; this tool reads version {VERSION}", head.version);
        }
        self.channels = head.fields.base_color.as_ref().map(Vec::len);
        self.fields = head.fields;
        Ok(())
    }
}

/// What a line may be.
#[derive(Debug, Deserialize)]
struct Kind {
    format: Option<serde_json::Value>,
    texture: Option<serde_json::Value>,
    gaussians: Option<u64>,
}

/// Reads lines. The first one may be a Gaussian: the header's fields then come from elsewhere.
pub(crate) fn read_lines(text: &str) -> Result<Imported> {
    let mut imported = Imported::default();
    let (mut declared, mut textures) = (None, 0);
    for (index, line) in text.lines().enumerate() {
        if line.trim().is_empty() {
            continue;
        }
        let number = index + 1;
        let context = || format!("line {number}");
        let kind: Kind = serde_json::from_str(line).map_err(|error| of_line(&error, number))?;
        if kind.format.is_some() {
            if declared.is_some() || !imported.gaussians.is_empty() {
                bail!("line {number}: a header after the first line");
            }
            let head = serde_json::from_str(line).map_err(|error| of_line(&error, number))?;
            imported.take_head(head).with_context(context)?;
            declared = Some(kind.gaussians);
        } else if kind.texture.is_some() {
            textures += 1;
        } else {
            let spot = serde_json::from_str(line).map_err(|error| of_line(&error, number))?;
            imported.push(&spot).with_context(context)?;
            imported.lines.push(number);
        }
    }
    let found = imported.gaussians.len();
    if let Some(Some(declared)) = declared
        && declared != found as u64
    {
        bail!("the first line says {declared} Gaussians, and there are {found}");
    }
    if textures > 0 {
        imported.warnings.push("its texture is left out".into());
    }
    Ok(imported)
}

/// An error in a line, which `serde_json` takes for the first one.
fn of_line(error: &serde_json::Error, line: usize) -> anyhow::Error {
    let (text, column) = (error.to_string(), error.column());
    let rule = text.rsplit_once(" at line ").map_or(&*text, |(rule, _)| rule);
    anyhow!("line {line}, column {column}: {rule}")
}

/// One object.
#[derive(Debug, Deserialize)]
struct Object {
    #[serde(flatten)]
    head: Head,
    gaussians: Vec<Spot>,
    texture: Option<serde::de::IgnoredAny>,
}

/// Reads one object.
pub(crate) fn read_object(text: &str) -> Result<Imported> {
    let Object { head, gaussians, texture } = serde_json::from_str(text)?;
    let mut imported = Imported::default();
    imported.take_head(head)?;
    for spot in &gaussians {
        imported.push(spot)?;
    }
    if texture.is_some() {
        imported.warnings.push("its texture is left out".into());
    }
    Ok(imported)
}
