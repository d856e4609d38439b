//! Files with any Gaussians: the packed coding with 32-bit floats (spec, sections 4 to 7.2).

use image_gip::ColorModel;

/// A picture of Gaussians that no encoder would write.
#[derive(Clone, Debug)]
pub(crate) struct Scene {
    pub(crate) size: (u32, u32),
    pub(crate) color: ColorModel,
    /// The cut-off of the exponential kernel; `None` for the quartic one.
    pub(crate) cutoff: Option<f32>,
    /// For each Gaussian x, y, l11, l21, l22 and the amplitudes, of which the colour model's are used.
    pub(crate) gaussians: Vec<[f32; 9]>,
}

/// A texture for a picture of 96 x 64 pixels, in all octaves and directions (spec, section 5.7).
#[rustfmt::skip]
const TEXTURE: [u8; 43] = [
    0xcd, 0x7c, 0x05, 0x16, 0xcf, 0x39, 0x02, 0x89, 0xde, 0x2e, 0xfa,
    0xff, 0x32, 0xb0, 0xf9, 0x62, 0x89, 0x3d, 0x66, 0x5a, 0xc3, 0xfc,
    0x6f, 0x28, 0x46, 0x95, 0xd1, 0x5f, 0x64, 0xd4, 0x82, 0x0c, 0x80,
    0xc6, 0xb1, 0xa7, 0x7b, 0xb2, 0xd5, 0x80, 0xde, 0xc5, 0x60,
];

/// The size of the pictures that [`with_texture`] takes.
pub(crate) const TEXTURED_SIZE: (u32, u32) = (96, 64);

/// A file with a texture as well, right before its end.
pub(crate) fn with_texture(mut file: Vec<u8>) -> Vec<u8> {
    let end = file.len() - chunk(b"E", &[]).len();
    file.splice(end..end, chunk(b"tXTR", &TEXTURE));
    file
}

impl Scene {
    /// The file, on a base of gray with half of the alpha.
    pub(crate) fn file(&self) -> Vec<u8> {
        let channels = self.color.channels();
        let count = self.gaussians.len() as u32;
        // The colour model, 8 bits, packed coding, the kernel, parameterization 1: Cholesky.
        let kernel = u8::from(self.cutoff.is_none());
        let mut header = vec![(channels - 1) as u8 | kernel << 4 | 1 << 5];
        header.extend([self.size.0, self.size.1, count].map(number).concat());
        if count > 0 {
            header.extend(number(1));
        }
        header.extend([0x7f].repeat(channels));
        header.extend(self.cutoff.iter().flat_map(|cutoff| cutoff.to_le_bytes()));

        if count > 0 {
            // Every component: kind 0 (float), 32 bits.
            header.extend([0, 32].repeat(5 + channels));
        }
        let mut file = vec![0xc7, b'G', b'I', b'P', b'\r', b'\n', 1, b'\n'];
        file.extend(chunk(b"H", &header));
        if count > 0 {
            let values = self.gaussians.iter().flat_map(|values| &values[..5 + channels]);
            let layer: Vec<u8> = values.flat_map(|value| value.to_le_bytes()).collect();
            file.extend(chunk(b"L", &layer));
        }
        file.extend(chunk(b"E", &[]));
        file
    }

    /// Gaussians of all shapes over the picture and somewhat beyond.
    pub(crate) fn random(
        seed: u64,
        count: usize,
        size: (u32, u32),
        (least, most): (f32, f32),
    ) -> Vec<[f32; 9]> {
        let mut random = fastrand::Rng::with_seed(seed);
        let mut range = |low: f32, high: f32| low + (high - low) * random.f32();
        let gaussian = |_| {
            let mut values = [0.0; 9];
            values[0] = range(-0.2, 1.2) * size.0 as f32;
            values[1] = range(-0.2, 1.2) * size.1 as f32;
            values[2] = range(least.ln(), most.ln()).exp();
            values[4] = range(least.ln(), most.ln()).exp();
            values[3] = range(-2.0, 2.0) * values[4];
            values[5..].fill_with(|| range(-0.5, 0.5));
            values
        };
        (0..count).map(gaussian).collect()
    }
}

fn chunk(kind: &[u8], payload: &[u8]) -> Vec<u8> {
    let checked = [kind, &number(payload.len() as u32), payload].concat();
    [checked.as_slice(), &crc32fast::hash(&checked).to_le_bytes()].concat()
}

/// A number as a file has it: seven bits in each byte, the lowest first (spec, section 2).
fn number(mut value: u32) -> Vec<u8> {
    let mut bytes = vec![];
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
    bytes
}
