//! A second renderer, written from `spec/gip.md` alone: every Gaussian at every pixel, in `f32`
//! in the specification's order, without tiles, footprints or vectors.

use super::exp::exp;
use super::synthesis::Synthesis;
use super::{CHOLESKY, COVARIANCE, EXPONENTIAL, Entry, File};

/// What to render (section 9.1).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Request {
    pub(crate) size: (u32, u32),
    /// x, y, width, height.
    pub(crate) region: (u32, u32, u32, u32),
    pub(crate) prefix: usize,
    pub(crate) texture: bool,
}

impl Request {
    pub(crate) fn whole(file: &File) -> Self {
        Self::at(file.header.width, file.header.height)
    }

    pub(crate) fn at(width: u32, height: u32) -> Self {
        Self {
            size: (width, height),
            region: (0, 0, width, height),
            prefix: usize::MAX,
            texture: true,
        }
    }

    pub(crate) fn without_texture(self) -> Self {
        Self { texture: false, ..self }
    }
}

/// Section 3.2.
fn sin_cos(x: f32) -> (f32, f32) {
    let bits = f32::from_bits;
    let n = (x * bits(0x3F22_F983)).round_ties_even();
    let r = (x - n * bits(0x3FC9_0000)) - n * bits(0x39FD_AA22);
    let r2 = r * r;
    let sin = (bits(0xB94C_A1F9) * r2 + bits(0x3C08_839E)) * r2 + bits(0xBE2A_AAA3);
    let sin = (sin * r2) * r + r;
    let cos = (bits(0x37CC_F5CE) * r2 + bits(0xBAB6_061A)) * r2 + bits(0x3D2A_AAA5);
    let cos = ((cos * r2) * r2 - 0.5 * r2) + 1.0;
    match n.rem_euclid(4.0) as u32 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// Section 6.
pub(crate) fn value(entry: &Entry, code: u32) -> f32 {
    match entry.kind {
        0 => f32::from_bits(code),
        1 => code as f32 * entry.scale + entry.offset,
        _ => exp(code as f32 * entry.scale + entry.offset),
    }
}

/// Sections 8.2 to 8.4.
pub(crate) fn cholesky(parameterization: u8, [a, b, c]: [f32; 3]) -> [f32; 3] {
    match parameterization {
        COVARIANCE => {
            let l11 = a.sqrt();
            let l21 = b / l11;
            [l11, l21, (c - l21 * l21).sqrt()]
        }
        CHOLESKY => [a, b, c],
        _ if c.abs() <= 1024.0 => {
            let (sin, cos) = sin_cos(c);
            let (a2, b2) = (a * a, b * b);
            let l11 = ((cos * cos) * a2 + (sin * sin) * b2).sqrt();
            [l11, ((cos * sin) * (a2 - b2)) / l11, (a * b) / l11]
        }
        _ => [f32::NAN; 3],
    }
}

/// Section 8.5.
fn is_drawable(center: [f32; 2], [l11, l21, l22]: [f32; 3], color: &[f32]) -> bool {
    let diagonal = 2_f32.powi(-12)..=2_f32.powi(24);
    let extent = -2_f32.powi(24)..=2_f32.powi(24);
    center.iter().all(|c| extent.contains(c))
        && diagonal.contains(&l11)
        && extent.contains(&l21)
        && diagonal.contains(&l22)
        && color.iter().all(|c| (-65536.0..=65536.0).contains(c))
}

/// Section 9.2: the side of the grid.
pub(crate) fn grid(stored: u32, output: u32) -> u32 {
    if output >= stored {
        return output;
    }
    let halvings =
        (0..).find(|halvings| ((u64::from(output) + 1) << (3 + halvings)) >= stored.into());
    stored.div_ceil(1 << halvings.expect("it is below 2^20"))
}

/// Section 9.5: the pixels of the grid that are in one of the output, and by how much.
pub(crate) fn parts(pixel: u32, grid: u32, output: u32) -> Vec<(u32, f32)> {
    let (start, end) = (u64::from(pixel) * u64::from(grid), u64::from(pixel + 1) * u64::from(grid));
    let side = u64::from(output);
    let touched = start / side..end.div_ceil(side);
    touched
        .map(|at| (at as u32, (end.min((at + 1) * side) - start.max(at * side)) as f32))
        .collect()
}

/// Sections 9.1 to 9.5: one plane per channel.
pub(crate) fn render(file: &File, request: &Request) -> Vec<Vec<f32>> {
    let header = &file.header;
    let stored = (header.width, header.height);
    let size = (grid(stored.0, request.size.0), grid(stored.1, request.size.1));
    let texture = Synthesis::new(file, request.size).filter(|_| request.texture);
    let sums = |region| {
        let texture = texture.as_ref().map(|texture| texture.render(header.sides(), size, region));
        sums(file, &Request { size, region, ..*request }, texture.as_deref())
    };
    if size == request.size {
        return sums(request.region);
    }
    let (left, top, width, height) = request.region;
    let columns: Vec<_> = (left..left + width).map(|x| parts(x, size.0, request.size.0)).collect();
    let rows: Vec<_> = (top..top + height).map(|y| parts(y, size.1, request.size.1)).collect();
    let first = |parts: &[Vec<(u32, f32)>]| parts[0][0].0;
    let count = |parts: &[Vec<(u32, f32)>]| {
        parts.last().and_then(|parts| parts.last()).expect("a pixel").0 + 1 - first(parts)
    };
    let region = (first(&columns), first(&rows), count(&columns), count(&rows));
    let mut planes = sums(region);
    for sum in planes.iter_mut().flatten() {
        *sum = sum.clamp(0.0, 1.0);
    }
    let channels = planes.len();
    let has_alpha = channels.is_multiple_of(2);
    let least = 1.0 / 65536.0;
    if has_alpha {
        let (alpha, colors) = planes.split_last_mut().expect("an even number of channels");
        for (color, alpha) in colors.iter_mut().flat_map(|plane| plane.iter_mut().zip(&*alpha)) {
            *color *= alpha + least;
        }
    }
    let mut means: Vec<Vec<f32>> = vec![Vec::new(); channels];
    for rows in &rows {
        for columns in &columns {
            for (plane, means) in planes.iter().zip(&mut means) {
                let mut mean = 0.0;
                for &(column, of_column) in columns {
                    let mut sum = 0.0;
                    for &(row, of_row) in rows {
                        let at = (row - region.1) * region.2 + (column - region.0);
                        sum += of_row * plane[at as usize];
                    }
                    mean += of_column * (sum / size.1 as f32);
                }
                means.push(mean / size.0 as f32);
            }
        }
    }
    if has_alpha {
        let (alpha, colors) = means.split_last_mut().expect("an even number of channels");
        for (color, alpha) in colors.iter_mut().flat_map(|plane| plane.iter_mut().zip(&*alpha)) {
            *color /= alpha + least;
        }
    }
    means
}

/// Sections 9.2 to 9.4, where the size of the request is that of the grid, with this texture.
pub(crate) fn sums(file: &File, request: &Request, texture: Option<&[f32]>) -> Vec<Vec<f32>> {
    let header = &file.header;
    let scale =
        [request.size.0 as f32 / header.width as f32, request.size.1 as f32 / header.height as f32];
    let d = if header.kernel == EXPONENTIAL { 12.0 } else { 6.0 };
    let filter = scale.map(|s| if s < 1.0 { (1.0 - s * s) / d } else { 0.0 });
    let (left, top, width, height) = request.region;
    let mut planes: Vec<Vec<f32>> = (0..header.channels())
        .map(|c| vec![f32::from(header.base[c]) / 65535.0; width as usize * height as usize])
        .collect();
    let colors = header.channels() - usize::from(header.channels().is_multiple_of(2));
    for plane in &mut planes[..colors] {
        plane
            .iter_mut()
            .zip(texture.unwrap_or_default())
            .for_each(|(sum, texture)| *sum += texture);
    }
    for values in file.components().into_iter().take(request.prefix) {
        let center = [values[0], values[1]];
        let stored = cholesky(header.parameterization(), [values[2], values[3], values[4]]);
        if !is_drawable(center, stored, &values[5..]) {
            continue;
        }
        let mut color = values[5..].to_vec();
        let [mut l11, mut l21, mut l22] =
            [stored[0] * scale[0], stored[1] * scale[1], stored[2] * scale[1]];
        if filter != [0.0, 0.0] {
            let wide11 = (l11 * l11 + filter[0]).sqrt();
            let rest = l21 / wide11;
            let wide21 = (l11 * l21) / wide11;
            let wide22 = ((l22 * l22 + filter[1]) + (rest * rest) * filter[0]).sqrt();
            let amplitude = (l11 / wide11) * (l22 / wide22);
            color.iter_mut().for_each(|c| *c *= amplitude);
            [l11, l21, l22] = [wide11, wide21, wide22];
        }
        let (i11, i22) = (1.0 / l11, 1.0 / l22);
        let w = -((l21 * i11) * i22);
        let scale_of_kernel = if header.kernel == EXPONENTIAL { 1.0 } else { 0.5 };
        let [i11, w, i22] = [i11, w, i22].map(|factor| factor * scale_of_kernel);
        let (x, y) = (center[0] * scale[0], center[1] * scale[1]);
        for row in 0..height {
            for column in 0..width {
                let dx = ((left + column) as f32 + 0.5) - x;
                let dy = ((top + row) as f32 + 0.5) - y;
                let u = i11 * dx;
                let v = w * dx + i22 * dy;
                let weight = if header.kernel == EXPONENTIAL {
                    let q = u * u + v * v;
                    if q <= header.cutoff { exp(q * -0.5) } else { 0.0 }
                } else {
                    let t = (1.0 - u * u) - v * v;
                    if t > 0.0 { t * t } else { 0.0 }
                };
                for (plane, color) in planes.iter_mut().zip(&color) {
                    plane[(row * width + column) as usize] += color * weight;
                }
            }
        }
    }
    planes
}

/// Section 9.5: interleaved samples of the given depth.
pub(crate) fn samples(planes: &[Vec<f32>], depth: u8) -> Vec<u16> {
    let full = if depth == 8 { 255.0 } else { 65535.0 };
    let sample = |value: f32| (value.clamp(0.0, 1.0) * full + 0.5).floor() as u16;
    (0..planes[0].len()).flat_map(|pixel| planes.iter().map(move |p| sample(p[pixel]))).collect()
}
