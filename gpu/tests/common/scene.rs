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

/// Bytes of the signature and of `GHDR`.
const HEADER_END: usize = 56;

/// A texture for a picture of 96 x 64 pixels, in all octaves and directions (spec, section 5.7).
#[rustfmt::skip]
const TEXTURE: [u8; 48] = [
    0xcd, 0xcc, 0x4c, 0x3d, 0x05, 0x00, 0x00, 0x00, 0x16, 0xcf, 0x39, 0x02,
    0x89, 0xde, 0x2e, 0xfa, 0xff, 0x32, 0xb0, 0xf9, 0x62, 0x89, 0x3d, 0x66,
    0x5a, 0xc3, 0xfc, 0x6f, 0x28, 0x46, 0x95, 0xd1, 0x5f, 0x64, 0xd4, 0x82,
    0x0c, 0x80, 0xc6, 0xb1, 0xa7, 0x7b, 0xb2, 0xd5, 0x80, 0xde, 0xc5, 0x60,
];

/// The size of the pictures that [`with_texture`] takes.
pub(crate) const TEXTURED_SIZE: (u32, u32) = (96, 64);

/// A file with a texture as well.
pub(crate) fn with_texture(mut file: Vec<u8>) -> Vec<u8> {
    file.splice(HEADER_END..HEADER_END, chunk(b"tXTR", &TEXTURE));
    file
}

impl Scene {
    /// The file, on a base of gray with half of the alpha.
    pub(crate) fn file(&self) -> Vec<u8> {
        let channels = self.color.channels();
        let count = self.gaussians.len() as u32;
        let mut header = vec![1, 0, channels as u8 - 1, 8];
        header.extend(self.size.0.to_le_bytes());
        header.extend(self.size.1.to_le_bytes());
        header.extend(count.to_le_bytes());
        header.extend(u16::from(count > 0).to_le_bytes());
        header.extend([u8::from(self.cutoff.is_none()), 1]);
        header.extend(self.cutoff.unwrap_or(4.0).to_le_bytes());
        header.extend([0; 4]);
        let base = |channel| if channel < channels { 0x7fff_u16 } else { 0 };
        header.extend((0..4).flat_map(|channel| base(channel).to_le_bytes()));

        let mut quantizer = vec![0, 32, 0, 0];
        quantizer.extend(1.0_f32.to_le_bytes());
        quantizer.extend(0.0_f32.to_le_bytes());

        let mut layer = count.to_le_bytes().to_vec();
        let values = self.gaussians.iter().flat_map(|values| &values[..5 + channels]);
        layer.extend(values.flat_map(|value| value.to_le_bytes()));

        let mut file = vec![0xc7, b'G', b'I', b'P', b'\r', b'\n', 0x1a, b'\n'];
        file.extend(chunk(b"GHDR", &header));
        file.extend(chunk(b"QNTZ", &quantizer.repeat(5 + channels)));
        if count > 0 {
            file.extend(chunk(b"GAUS", &layer));
        }
        file.extend(chunk(b"GEND", &[]));
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

fn chunk(kind: &[u8; 4], payload: &[u8]) -> Vec<u8> {
    let checked = [kind, payload].concat();
    let length = (payload.len() as u32).to_le_bytes();
    [&length, checked.as_slice(), &crc32fast::hash(&checked).to_le_bytes()].concat()
}
