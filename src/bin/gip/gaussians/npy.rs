//! Arrays of NumPy: the format NPY.

use anyhow::{Context, Result, bail};

const MAGIC: &[u8] = b"\x93NUMPY";
/// What the length of magic and header is a multiple of.
const ALIGNMENT: usize = 64;

/// The bytes of an array of this type, as NumPy names it, and shape.
pub(crate) fn write(kind: &str, shape: &[usize], data: &[u8]) -> Vec<u8> {
    let sides: String = shape.iter().map(|side| format!("{side}, ")).collect();
    // A tuple of one element needs its comma, and others may have one.
    let shape = format!("({})", sides.trim_end());
    let mut header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    let before = MAGIC.len() + 4;
    let padding =
        (before + header.len() + 1).next_multiple_of(ALIGNMENT) - (before + header.len() + 1);
    header.push_str(&" ".repeat(padding));
    header.push('\n');
    let mut bytes = [MAGIC, &[1, 0]].concat();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

/// An array of `f32`.
pub(crate) fn floats(shape: &[usize], values: impl IntoIterator<Item = f32>) -> Vec<u8> {
    let data: Vec<u8> = values.into_iter().flat_map(f32::to_le_bytes).collect();
    write("<f4", shape, &data)
}

/// A text: an array of no dimension.
pub(crate) fn text(text: &str) -> Vec<u8> {
    let data: Vec<u8> = text.chars().flat_map(|letter| u32::from(letter).to_le_bytes()).collect();
    write(&format!("<U{}", data.len() / 4), &[], &data)
}

/// An array that was read.
#[derive(Debug)]
pub(crate) struct Array {
    pub(crate) shape: Vec<usize>,
    kind: String,
    fortran: bool,
    data: Vec<u8>,
}

impl Array {
    pub(crate) fn parse(bytes: &[u8]) -> Result<Self> {
        let rest = bytes.strip_prefix(MAGIC).context("not an array of NumPy")?;
        let (version, rest) = rest.split_first_chunk::<2>().context("it is truncated")?;
        let (length, rest) = match version[0] {
            1 => {
                let (length, rest) = rest.split_first_chunk().context("it is truncated")?;
                (u16::from_le_bytes(*length).into(), rest)
            }
            2 | 3 => {
                let (length, rest) = rest.split_first_chunk().context("it is truncated")?;
                (u32::from_le_bytes(*length) as usize, rest)
            }
            version => bail!("version {version} of NPY is not read"),
        };
        let header = rest.get(..length).context("it is truncated")?;
        let header = str::from_utf8(header).context("its header is no text")?;
        let after = |key: &str| {
            let (_, value) = header
                .split_once(&format!("'{key}':"))
                .with_context(|| format!("its header has no {key}"))?;
            Ok::<_, anyhow::Error>(value.trim_start())
        };
        let kind = after("descr")?.strip_prefix('\'').and_then(|value| value.split_once('\''));
        let kind = kind
            .map(|(kind, _)| kind.to_owned())
            .context("it is a structured array; it must have one type")?;
        let fortran = after("fortran_order")?.starts_with("True");
        let shape = after("shape")?.strip_prefix('(').and_then(|value| value.split_once(')'));
        let (sides, _) = shape.context("its header has no shape")?;
        let sides = sides.split(',').map(str::trim).filter(|side| !side.is_empty());
        let shape: Vec<usize> =
            sides.map(|side| side.parse().context("its shape is wrong")).collect::<Result<_>>()?;
        Ok(Self { shape, kind, fortran, data: rest[length..].to_vec() })
    }

    /// The elements, each of so many bytes.
    fn elements(&self, bytes: usize) -> Result<impl Iterator<Item = &[u8]>> {
        let count = self.shape.iter().try_fold(bytes, |all, &side| all.checked_mul(side));
        if count != Some(self.data.len()) {
            let (kind, shape, found) = (&self.kind, &self.shape, self.data.len());
            bail!("an array of type {kind} and shape {shape:?} cannot have {found} bytes");
        }
        Ok(self.data.chunks_exact(bytes))
    }

    /// The numbers, row by row.
    pub(crate) fn numbers(&self) -> Result<Vec<f64>> {
        macro_rules! read {
            ($type:ty, $number:expr) => {{
                let big = self.kind.starts_with('>');
                let number = |bytes: &[u8]| {
                    let bytes = bytes.try_into().expect("as many as it takes");
                    $number(if big {
                        <$type>::from_be_bytes(bytes)
                    } else {
                        <$type>::from_le_bytes(bytes)
                    })
                };
                self.elements(size_of::<$type>())?.map(number).collect::<Vec<f64>>()
            }};
        }
        let numbers = match self.kind.trim_start_matches(['<', '>', '|', '=']) {
            "f2" => read!(u16, half),
            "f4" => read!(f32, f64::from),
            "f8" => read!(f64, f64::from),
            "i1" => read!(i8, f64::from),
            "i2" => read!(i16, f64::from),
            "i4" => read!(i32, f64::from),
            "i8" => read!(i64, |number| number as f64),
            "u1" => read!(u8, f64::from),
            "u2" => read!(u16, f64::from),
            "u4" => read!(u32, f64::from),
            "u8" => read!(u64, |number| number as f64),
            kind => {
                bail!("its type {kind} is not read: it must be f2, f4, f8, or of whole numbers")
            }
        };
        Ok(if self.fortran { self.by_rows(&numbers) } else { numbers })
    }

    /// Numbers column by column, row by row.
    fn by_rows(&self, numbers: &[f64]) -> Vec<f64> {
        let mut strides = vec![1; self.shape.len()];
        for axis in 1..self.shape.len() {
            strides[axis] = strides[axis - 1] * self.shape[axis - 1];
        }
        let place = |mut index: usize| {
            let mut place = 0;
            for (side, stride) in self.shape.iter().zip(&strides).rev() {
                place += index % side * stride;
                index /= side;
            }
            place
        };
        (0..numbers.len()).map(|index| numbers[place(index)]).collect()
    }

    /// The text of an array of no dimension.
    pub(crate) fn text(&self) -> Result<String> {
        let wrong = "it must be a text";
        let kind = self.kind.trim_start_matches(['<', '>', '|', '=']);
        let (letter, length) = kind.split_at_checked(1).context(wrong)?;
        let length: usize = length.parse().context(wrong)?;
        if !self.shape.is_empty() || !(1..=64).contains(&length) {
            bail!(wrong);
        }
        let letters: Vec<char> = match letter {
            "S" => self.elements(length)?.flatten().map(|&byte| byte.into()).collect(),
            "U" => {
                let big = self.kind.starts_with('>');
                let code = |bytes: &[u8]| {
                    let bytes = bytes.try_into().expect("four");
                    if big { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }
                };
                let data = self.elements(4 * length)?.flat_map(|text| text.chunks_exact(4));
                data.map(|bytes| char::from_u32(code(bytes)).context(wrong))
                    .collect::<Result<_>>()?
            }
            _ => bail!(wrong),
        };
        Ok(letters.into_iter().collect::<String>().trim_end_matches('\0').to_owned())
    }
}

/// The number that the bits of a float of 16 bits stand for.
fn half(bits: u16) -> f64 {
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023));
    let size = match (exponent, fraction) {
        (0, _) => fraction * (-24_f64).exp2(),
        (31, 0.0) => f64::INFINITY,
        (31, _) => f64::NAN,
        _ => (1024.0 + fraction) * f64::from(exponent - 25).exp2(),
    };
    if bits >> 15 == 0 { size } else { -size }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves() {
        for (bits, number) in [
            (0x0000, 0.0),
            (0x0001, 5.960_464_477_539_063e-8),
            (0x03FF, 6.097_555_160_522_461e-5),
            (0x0400, 6.103_515_625e-5),
            (0x3555, 0.333_251_953_125),
            (0x3C00, 1.0),
            (0xC000, -2.0),
            (0x7BFF, 65504.0),
            (0xFC00, f64::NEG_INFINITY),
        ] {
            assert_eq!(half(bits), number, "{bits:x}");
        }
        assert!(half(0x7C01).is_nan());
    }
}
