//! A byte builder for `.gip` files, written from `spec/gip.md` alone: it shares no code with the
//! crate, so that a file which both agree on is what the specification says.

#![allow(dead_code, reason = "every test binary uses a part of this")]

pub(crate) mod entropy;
mod exp;
pub(crate) mod layered;
pub(crate) mod memory;
pub(crate) mod numbers;
pub(crate) mod oracle;
pub(crate) mod rans;
pub(crate) mod scenes;
pub(crate) mod steps;
pub(crate) mod synthesis;
pub(crate) mod texture;

use entropy::Code;
use image_gip::{DecodeError, Gaussian, Limits, RenderOptions, SampleDepth, StreamDecoder};
pub(crate) use numbers::{number, read_number};

/// Section 4.1.
pub(crate) const SIGNATURE: [u8; 8] = [0xC7, 0x47, 0x49, 0x50, 0x0D, 0x0A, 0x01, 0x0A];

/// CRC-32 as in PNG, bit by bit.
pub(crate) fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| {
            if crc & 1 == 1 { 0xEDB8_8320 ^ (crc >> 1) } else { crc >> 1 }
        })
    })
}

/// These bytes and their CRC.
pub(crate) fn checked(bytes: &[u8]) -> Vec<u8> {
    [bytes, &crc32(bytes).to_le_bytes()].concat()
}

/// One chunk: type, length, payload, CRC (section 4.2).
pub(crate) fn chunk(kind: &[u8], payload: &[u8]) -> Vec<u8> {
    checked(&[kind, &number(payload.len() as u32), payload].concat())
}

/// The letters of a chunk's type.
pub(crate) fn kind(chunk: &[u8]) -> &[u8] {
    let letters = if chunk[0].is_ascii_lowercase() { 4 } else { 1 };
    &chunk[..letters]
}

/// The payload of a chunk.
pub(crate) fn payload(chunk: &[u8]) -> &[u8] {
    let (length, rest) = read_number(&chunk[kind(chunk).len()..]).expect("a length");
    &rest[..length as usize]
}

/// Where chunks begin and where the last one ends, after the signature.
pub(crate) fn offsets(chunks: &[Vec<u8>]) -> Vec<usize> {
    let mut at = SIGNATURE.len();
    let ends = chunks.iter().map(|chunk| {
        at += chunk.len();
        at
    });
    [SIGNATURE.len()].into_iter().chain(ends).collect()
}

/// The fields of the header before the quantizers or steps, whatever the values (section 5.1).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Header {
    /// 0 or 1.
    pub(crate) coding: u8,
    pub(crate) color: u8,
    /// 8 or 16.
    pub(crate) depth: u8,
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) gaussians: u32,
    pub(crate) layers: u32,
    pub(crate) kernel: u8,
    /// The parameterization of the packed coding; whether the entropy coding has steps of geometry.
    pub(crate) form: u8,
    /// Bit 7 of the format.
    pub(crate) reserved: u8,
    /// Of kernel 0.
    pub(crate) cutoff: f32,
    /// In 1/65535, and a multiple of 257 if samples have 8 bits.
    pub(crate) base: [u16; 4],
}

impl Default for Header {
    /// Gray, 8 bits, 16x16, no Gaussians, quartic kernel, Cholesky parameterization, black.
    fn default() -> Self {
        Self {
            coding: PACKED,
            color: GRAY,
            depth: 8,
            width: 16,
            height: 16,
            gaussians: 0,
            layers: 0,
            kernel: QUARTIC,
            form: CHOLESKY,
            reserved: 0,
            cutoff: 4.0,
            base: [0; 4],
        }
    }
}

pub(crate) const PACKED: u8 = 0;
pub(crate) const ENTROPY: u8 = 1;
pub(crate) const GRAY: u8 = 0;
pub(crate) const GRAY_ALPHA: u8 = 1;
pub(crate) const RGB: u8 = 2;
pub(crate) const RGBA: u8 = 3;
pub(crate) const EXPONENTIAL: u8 = 0;
pub(crate) const QUARTIC: u8 = 1;
pub(crate) const COVARIANCE: u8 = 0;
pub(crate) const CHOLESKY: u8 = 1;
pub(crate) const ROTATION_SCALE: u8 = 2;

impl Header {
    pub(crate) fn format(&self) -> u8 {
        let depth = u8::from(self.depth == 16);
        let fields = [self.color, depth, self.coding, self.kernel, self.form, self.reserved];
        fields.into_iter().zip([0, 2, 3, 4, 5, 7]).map(|(field, bit)| field << bit).sum()
    }

    /// The fields before the quantizers or steps.
    pub(crate) fn fields(&self) -> Vec<u8> {
        let mut bytes = vec![self.format()];
        for field in [self.width, self.height, self.gaussians] {
            bytes.extend(number(field));
        }
        if self.gaussians > 0 {
            bytes.extend(number(self.layers));
        }
        for base in &self.base[..self.channels()] {
            match self.depth {
                8 => {
                    assert_eq!(base % 257, 0, "a base colour of 8 bits");
                    bytes.push((base / 257) as u8);
                }
                _ => bytes.extend(base.to_le_bytes()),
            }
        }
        if self.kernel == EXPONENTIAL {
            bytes.extend(self.cutoff.to_le_bytes());
        }
        bytes
    }

    /// The chunk, with these quantizers or steps, which a picture without Gaussians does not have.
    pub(crate) fn chunk(&self, dequantizer: &[u8]) -> Vec<u8> {
        let dequantizer = if self.gaussians == 0 { &[] } else { dequantizer };
        chunk(b"H", &[&self.fields(), dequantizer].concat())
    }

    /// Section 8.
    pub(crate) fn parameterization(&self) -> u8 {
        if self.coding == ENTROPY { CHOLESKY } else { self.form }
    }

    pub(crate) fn channels(&self) -> usize {
        usize::from(self.color) + 1
    }

    pub(crate) fn sides(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    pub(crate) fn components(&self) -> usize {
        5 + self.channels()
    }
}

/// One quantizer (section 6), whatever the values.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    pub(crate) kind: u8,
    pub(crate) bits: u8,
    pub(crate) scale: f32,
    pub(crate) offset: f32,
}

impl Entry {
    pub(crate) const FLOAT: Self = Self { kind: 0, bits: 32, scale: 1.0, offset: 0.0 };

    pub(crate) const fn linear(bits: u8, scale: f32, offset: f32) -> Self {
        Self { kind: 1, bits, scale, offset }
    }

    pub(crate) const fn log(bits: u8, scale: f32, offset: f32) -> Self {
        Self { kind: 2, bits, scale, offset }
    }

    fn bytes(&self) -> Vec<u8> {
        let mut bytes = vec![self.kind, self.bits];
        if self.kind != 0 {
            bytes.extend([self.scale, self.offset].map(f32::to_le_bytes).concat());
        }
        bytes
    }
}

/// The quantizers in the header.
pub(crate) fn quantizers(entries: &[Entry]) -> Vec<u8> {
    entries.iter().flat_map(Entry::bytes).collect()
}

/// The Gaussians of a packed layer (section 7.2): one code per component, Gaussian after Gaussian.
pub(crate) fn packed(entries: &[Entry], codes: &[u32]) -> Vec<u8> {
    let mut bits = Vec::new();
    for (index, &code) in codes.iter().enumerate() {
        let width = entries[index % entries.len()].bits;
        bits.extend((0..width).map(|bit| code >> bit & 1));
    }
    let bytes = bits.chunks(8).map(|byte| {
        byte.iter().enumerate().fold(0, |sum, (place, &bit)| sum | (bit as u8) << place)
    });
    bytes.collect()
}

/// A whole file.
#[derive(Clone, Debug)]
pub(crate) struct File {
    pub(crate) header: Header,
    pub(crate) entries: Vec<Entry>,
    /// Chunks between the header and the first layer: type and payload.
    pub(crate) extra: Vec<(Vec<u8>, Vec<u8>)>,
    /// Codes of each layer.
    pub(crate) layers: Vec<Vec<u32>>,
    /// What an entropy-coded file has in place of entries and layers.
    pub(crate) entropy_coded: Option<EntropyCoded>,
}

/// The content of an entropy-coded file.
#[derive(Clone, Debug)]
pub(crate) struct EntropyCoded {
    pub(crate) steps: Vec<f32>,
    pub(crate) layers: Vec<Vec<Code>>,
}

impl EntropyCoded {
    /// The number of Gaussians in each layer, and the bytes in which they are coded.
    fn layers(&self, header: &Header) -> Vec<(u32, Vec<u8>)> {
        let layer = |layer: &Vec<Code>| {
            let ops = entropy::write(header.sides(), &self.steps, &mut layer.clone());
            (layer.len() as u32, rans::encode(&ops))
        };
        self.layers.iter().map(layer).collect()
    }

    fn components(&self, header: &Header) -> Vec<Vec<f32>> {
        let values = |(count, bytes): (u32, Vec<u8>)| {
            let layer = entropy::read(header.sides(), &self.steps, count, &bytes);
            layer.expect("what was just written").values
        };
        self.layers(header).into_iter().flat_map(values).collect()
    }
}

impl File {
    /// A file whose attributes are floats: one row of components per Gaussian, in one layer.
    pub(crate) fn of_floats(header: Header, gaussians: &[Vec<f32>]) -> Self {
        let codes: Vec<u32> = gaussians.iter().flatten().map(|value| value.to_bits()).collect();
        let layers = if codes.is_empty() { vec![] } else { vec![codes] };
        Self::new(header, vec![Entry::FLOAT; header.components()], layers)
    }

    /// A file with these layers; the header's counts are set to match.
    pub(crate) fn new(mut header: Header, entries: Vec<Entry>, layers: Vec<Vec<u32>>) -> Self {
        header.layers = layers.len() as u32;
        let codes: usize = layers.iter().map(Vec::len).sum();
        header.gaussians = (codes / entries.len()) as u32;
        Self { header, entries, extra: Vec::new(), layers, entropy_coded: None }
    }

    /// An entropy-coded file with these layers; the header's coding, form and counts are set to match.
    pub(crate) fn of_entropy_coded(
        header: Header,
        steps: Vec<f32>,
        layers: Vec<Vec<Code>>,
    ) -> Self {
        let count: usize = layers.iter().map(Vec::len).sum();
        let header = Header {
            coding: ENTROPY,
            form: u8::from(!steps::has_usual_geometry(&steps)),
            gaussians: count as u32,
            layers: layers.len() as u32,
            ..header
        };
        let entropy_coded = Some(EntropyCoded { steps, layers });
        Self { header, entries: Vec::new(), extra: Vec::new(), layers: Vec::new(), entropy_coded }
    }

    pub(crate) fn with(mut self, kind: &[u8], payload: &[u8]) -> Self {
        self.extra.push((kind.to_vec(), payload.to_vec()));
        self
    }

    /// What `bNDS` says of an entropy-coded file with the quartic kernel (section 5.6).
    pub(crate) fn bounds(&self) -> Vec<u8> {
        let decoder = decode_valid(&self.bytes());
        let mut rest = decoder.gaussians();
        let mut all = Vec::new();
        for layer in &self.entropy_coded.as_ref().expect("entropy-coded").layers {
            let (gaussians, later) = rest.split_at(layer.len());
            rest = later;
            let mut bounds = [255, 255, 0, 0];
            for Gaussian { center, cholesky: [l11, l21, l22], .. } in gaussians {
                let reach = [2.0 * l11, 2.0 * (l21 * l21 + l22 * l22).sqrt()];
                for axis in 0..2 {
                    let side = self.header.sides()[axis] as f32;
                    let cell = |at: f32| (at / side * 256.0).floor().clamp(0.0, 255.0) as u8;
                    let rounding = (center[axis].abs() + reach[axis]) / 262_144.0;
                    let reach = reach[axis] + rounding;
                    bounds[axis] = bounds[axis].min(cell(center[axis] - reach));
                    bounds[axis + 2] = bounds[axis + 2].max(cell(center[axis] + reach));
                }
            }
            all.extend(bounds);
        }
        all
    }

    /// What the header says of quantizers or steps.
    pub(crate) fn dequantizer(&self) -> Vec<u8> {
        match &self.entropy_coded {
            None => quantizers(&self.entries),
            Some(entropy_coded) => steps::bytes(&entropy_coded.steps),
        }
    }

    /// The number of Gaussians in each layer, and the bytes in which they are coded.
    fn coded_layers(&self) -> Vec<(u32, Vec<u8>)> {
        if let Some(entropy_coded) = &self.entropy_coded {
            return entropy_coded.layers(&self.header);
        }
        let layer = |codes: &Vec<u32>| {
            ((codes.len() / self.entries.len()) as u32, packed(&self.entries, codes))
        };
        self.layers.iter().map(layer).collect()
    }

    /// The chunks in order.
    pub(crate) fn chunks(&self) -> Vec<Vec<u8>> {
        let mut chunks = vec![self.header.chunk(&self.dequantizer())];
        chunks.extend(self.extra.iter().map(|(kind, payload)| chunk(kind, payload)));
        chunks.extend(layers(&self.coded_layers()));
        chunks.push(chunk(b"E", &[]));
        chunks
    }

    /// The components of every Gaussian (section 8.1).
    pub(crate) fn components(&self) -> Vec<Vec<f32>> {
        if let Some(entropy_coded) = &self.entropy_coded {
            return entropy_coded.components(&self.header);
        }
        let values = |codes: &[u32]| {
            self.entries.iter().zip(codes).map(|(e, &code)| oracle::value(e, code)).collect()
        };
        self.layers.concat().chunks(self.entries.len()).map(values).collect()
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        of_chunks(&self.chunks())
    }
}

/// The layers of a file, from their numbers of Gaussians and the bytes in which those are coded. All but the last
/// begin with their number (section 5.4).
pub(crate) fn layers(coded: &[(u32, Vec<u8>)]) -> Vec<Vec<u8>> {
    let later = (0..coded.len()).rev();
    let layer = |((count, bytes), later): (&(u32, Vec<u8>), usize)| {
        let count = if later > 0 { number(*count) } else { Vec::new() };
        chunk(b"L", &[&count[..], bytes].concat())
    };
    coded.iter().zip(later).map(layer).collect()
}

/// A layer of the entropy coding without its last word: it is framed well, and malformed inside.
pub(crate) fn without_last_word(layer: &[u8]) -> Vec<u8> {
    let payload = payload(layer);
    chunk(kind(layer), &payload[..payload.len() - 2])
}

/// Signature and chunks.
pub(crate) fn of_chunks(chunks: &[Vec<u8>]) -> Vec<u8> {
    [&SIGNATURE, chunks.concat().as_slice()].concat()
}

/// The CRC-32 of the interleaved samples at the file's depth, 16-bit ones big-endian.
pub(crate) fn render(decoder: &StreamDecoder, options: &RenderOptions) -> u32 {
    let picture = decoder.picture().expect("the header has arrived");
    let mut bytes = vec![0; picture.output_len(options).expect("fits")];
    match picture.header().depth {
        SampleDepth::Eight => picture.render_u8(options, &mut bytes).expect("a sound request"),
        _ => {
            let mut samples = vec![0; bytes.len()];
            picture.render_u16(options, &mut samples).expect("a sound request");
            bytes = samples.iter().flat_map(|sample| sample.to_be_bytes()).collect();
        }
    }
    crc32(&bytes)
}

/// Feeds `bytes` in the given pieces and says that nothing more comes.
pub(crate) fn decode_pieces<'a>(
    pieces: impl IntoIterator<Item = &'a [u8]>,
    limits: Limits,
) -> (StreamDecoder, Result<(), DecodeError>) {
    let mut decoder = StreamDecoder::new().with_limits(limits);
    for piece in pieces {
        if let Err(error) = decoder.feed(piece) {
            return (decoder, Err(error));
        }
    }
    let result = decoder.finish();
    (decoder, result)
}

/// Feeds `bytes` at once.
pub(crate) fn decode(bytes: &[u8]) -> (StreamDecoder, Result<(), DecodeError>) {
    decode_pieces([bytes], Limits::default())
}

/// Decodes a file that must be valid.
pub(crate) fn decode_valid(bytes: &[u8]) -> StreamDecoder {
    let (decoder, result) = decode(bytes);
    result.expect("a valid file");
    decoder
}

/// All bits of all Gaussians: equality that tells zeros apart and knows NaN.
pub(crate) fn bits(gaussians: &[Gaussian]) -> Vec<[u32; 9]> {
    let bits = |g: &Gaussian| {
        let mut all = [0; 9];
        let values = g.center.iter().chain(&g.cholesky).chain(&g.color);
        all.iter_mut().zip(values).for_each(|(bits, value)| *bits = value.to_bits());
        all
    };
    gaussians.iter().map(bits).collect()
}

/// A small deterministic generator (SplitMix64) for inputs that need no shrinking.
#[derive(Clone, Debug)]
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in [low, high).
    pub(crate) fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * ((self.next() >> 40) as f32 / (1 << 24) as f32)
    }

    /// Uniform in its logarithm.
    pub(crate) fn decades(&mut self, low: f32, high: f32) -> f32 {
        self.range(low.ln(), high.ln()).exp()
    }
}

/// A fixed number of cases from a fixed seed, and no files left behind.
pub(crate) fn cases(cases: u32) -> proptest::test_runner::Config {
    proptest::test_runner::Config {
        cases,
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(0x676970),
        ..Default::default()
    }
}
