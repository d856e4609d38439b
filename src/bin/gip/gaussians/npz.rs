//! NPZ: a ZIP archive of arrays of NumPy. The format is described in docs/gaussians.md.

use std::collections::BTreeMap;

use anyhow::{Context, Result, bail};
use image_gip::Gaussian;

use super::model::{Fields, Imported, Model, Spots, amplitudes, factor_of};
use super::npy::{self, Array};
use super::zip::{self, Archive};

/// The archive of a picture.
pub(crate) fn write(model: &Model) -> Vec<u8> {
    let mut archive = Archive::default();
    let mut add = |name: &str, array: &[u8]| archive.add(&format!("{name}.npy"), array);
    let whole = |number: u32| npy::write("<i4", &[], &number.to_le_bytes());
    let header = &model.picture.header;
    for (name, array) in arrays(&model.picture) {
        add(name, &array);
    }
    add("width", &whole(header.width));
    add("height", &whole(header.height));
    add("depth", &whole(header.depth.bits().into()));
    let fields = Fields::of(header);
    add("kernel", &npy::text(&fields.kernel.unwrap_or_default()));
    add("cutoff", &npy::floats(&[], [header.kernel.cutoff()]));
    if let Some(texture) = &model.texture {
        for (name, array) in arrays(texture) {
            add(&format!("texture_{name}"), &array);
        }
        let sides = [texture.header.width, texture.header.height].map(u32::to_le_bytes);
        add("texture_size", &npy::write("<i4", &[2], sides.as_flattened()));
    }
    archive.finish()
}

/// The arrays of Gaussians, and their base colour.
fn arrays(spots: &Spots) -> [(&'static str, Vec<u8>); 5] {
    let Spots { header, gaussians } = spots;
    let (count, channels) = (gaussians.len(), header.color.channels());
    let covariance = |gaussian: &Gaussian| {
        let [xx, xy, yy] = gaussian.covariance();
        [xx, xy, xy, yy]
    };
    let base: Vec<u8> =
        header.base_color[..channels].iter().flat_map(|value| value.to_le_bytes()).collect();
    let all = || gaussians.iter();
    [
        ("center", npy::floats(&[count, 2], all().flat_map(|gaussian| gaussian.center))),
        ("covariance", npy::floats(&[count, 2, 2], all().flat_map(covariance))),
        ("cholesky", npy::floats(&[count, 3], all().flat_map(|gaussian| gaussian.cholesky))),
        (
            "color",
            npy::floats(
                &[count, channels],
                all().flat_map(|gaussian| gaussian.color.into_iter().take(channels)),
            ),
        ),
        ("base_color", npy::write("<u2", &[channels], &base)),
    ]
}

/// What the arrays are called that are read.
const NAMES: [&str; 10] = [
    "center",
    "covariance",
    "cholesky",
    "color",
    "base_color",
    "width",
    "height",
    "depth",
    "kernel",
    "cutoff",
];
/// What tells that there is a texture.
const TEXTURE: &str = "texture_center";

/// The arrays of an archive by their names.
struct Arrays(BTreeMap<String, Array>);

/// Numbers of an array.
struct Numbers {
    shape: Vec<usize>,
    values: Vec<f64>,
}

impl Arrays {
    fn numbers(&self, name: &str) -> Result<Option<Numbers>> {
        let Some(array) = self.0.get(name) else { return Ok(None) };
        let values = array.numbers().with_context(|| name.to_owned())?;
        Ok(Some(Numbers { shape: array.shape.clone(), values }))
    }

    /// An array of this shape.
    fn shaped(&self, name: &str, shape: &[usize]) -> Result<Option<Vec<f64>>> {
        let Some(Numbers { shape: found, values }) = self.numbers(name)? else { return Ok(None) };
        if found != shape {
            bail!("{name} has shape {found:?}; it must be {shape:?}");
        }
        Ok(Some(values))
    }

    /// A whole number.
    fn whole<T: TryFrom<u64>>(&self, name: &str) -> Result<Option<T>> {
        let Some(numbers) = self.shaped(name, &[])? else { return Ok(None) };
        let number = numbers[0];
        whole(number).map(Some).with_context(|| format!("{name} {number} is out of range"))
    }
}

/// A number that has no fraction and is in the range of the type.
fn whole<T: TryFrom<u64>>(number: f64) -> Option<T> {
    let is_whole = number >= 0.0 && number.fract() == 0.0 && number < 1e15;
    is_whole.then(|| T::try_from(number as u64).ok()).flatten()
}

/// Reads an archive, of which what is read has at most so many bytes.
pub(crate) fn read(bytes: &[u8], most: u64) -> Result<Imported> {
    let mut arrays = Arrays(BTreeMap::new());
    let array_of = |file: &str| file.strip_suffix(".npy").unwrap_or(file).to_owned();
    let mut has_texture = false;
    // Whatever else is there may be of any kind.
    let is_read = |file: &str| {
        let name = array_of(file);
        has_texture |= name == TEXTURE;
        NAMES.contains(&&*name)
    };
    for (file, contents) in zip::read(bytes, most, is_read)? {
        let name = array_of(&file);
        let array = Array::parse(&contents).with_context(|| name.clone())?;
        arrays.0.insert(name, array);
    }
    let required = |name: &str| {
        let missing = || {
            format!(
                "it has no array {name}; of a structured array, save each of its fields as an array"
            )
        };
        arrays.numbers(name)?.with_context(missing)
    };
    let (center, color) = (required("center")?, required("color")?);
    let &[count, 2] = &center.shape[..] else {
        bail!("center has shape {:?}; it must be [n, 2]", center.shape);
    };
    let channels = match color.shape[..] {
        [found] if found == count => 1,
        [found, channels @ 1..=4] if found == count => channels,
        _ => bail!("color has shape {:?}; it must be [{count}, 1 to 4]", color.shape),
    };
    let covariance = arrays.shaped("covariance", &[count, 2, 2])?;
    let cholesky = arrays.shaped("cholesky", &[count, 3])?;
    let mut gaussians = Vec::new();
    for index in 0..count {
        let covariance = covariance.as_ref().map(|all| &all[4 * index..][..4]);
        if covariance.is_some_and(|c| (c[1] - c[2]).abs() > 1e-5 * (c[0] + c[3]).abs()) {
            bail!("covariance of Gaussian {index}: it is not symmetric");
        }
        let covariance = covariance.map(|c| [c[0], c[1], c[3]]);
        let factor = cholesky.as_ref().map(|all| [0, 1, 2].map(|entry| all[3 * index + entry]));
        let cholesky = factor_of(covariance, factor);
        gaussians.push(Gaussian {
            center: [0, 1].map(|axis| center.values[2 * index + axis] as f32),
            cholesky: cholesky.map_err(|rule| anyhow::anyhow!("Gaussian {index}: {rule}"))?,
            color: amplitudes(color.values[channels * index..][..channels].iter().copied()),
        });
    }
    let base_color = arrays.numbers("base_color")?.map(|base| {
        let value = |&number: &f64| {
            whole(number).with_context(|| format!("base_color {number}; it must be 0 to 65535"))
        };
        let values = base.values.iter().map(value).collect::<Result<Vec<u16>>>()?;
        // One number is for all channels.
        anyhow::Ok(if base.shape.is_empty() { values.repeat(channels) } else { values })
    });
    let kernel = arrays.0.get("kernel").map(|array| array.text().context("kernel"));
    let cutoff = arrays.shaped("cutoff", &[])?.map(|numbers| numbers[0] as f32);
    let fields = Fields {
        width: arrays.whole("width")?,
        height: arrays.whole("height")?,
        depth: arrays.whole("depth")?,
        kernel: kernel.transpose()?,
        cutoff,
        base_color: base_color.transpose()?,
    };
    let mut imported =
        Imported { fields, channels: Some(channels), gaussians, ..Imported::default() };
    if has_texture {
        imported.warnings.push("its texture is left out".into());
    }
    Ok(imported)
}
