//! A byte builder for `.gip` files, written from `spec/gip.md` alone: it shares no code with the
//! crate, so that a file which both agree on is what the specification says.

#![allow(dead_code, reason = "every test binary uses a part of this")]

pub(crate) mod entropy;
mod exp;
pub(crate) mod layered;
pub(crate) mod memory;
pub(crate) mod oracle;
pub(crate) mod rans;
pub(crate) mod scenes;
pub(crate) mod synthesis;
pub(crate) mod texture;

use entropy::Code;
use image_gip::{DecodeError, Gaussian, Limits, StreamDecoder};

/// Section 4.1.
pub(crate) const SIGNATURE: [u8; 8] = [0xC7, 0x47, 0x49, 0x50, 0x0D, 0x0A, 0x1A, 0x0A];

/// CRC-32 as in PNG, bit by bit.
pub(crate) fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| {
            if crc & 1 == 1 { 0xEDB8_8320 ^ (crc >> 1) } else { crc >> 1 }
        })
    })
}

/// One chunk: length, type, payload, CRC (section 4.2).
pub(crate) fn chunk(kind: &[u8; 4], payload: &[u8]) -> Vec<u8> {
    let checked = [kind, payload].concat();
    let length = (payload.len() as u32).to_le_bytes();
    [&length, checked.as_slice(), &crc32(&checked).to_le_bytes()].concat()
}

/// The payload of `GHDR`, field by field (section 5.1), whatever the values.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ghdr {
    pub(crate) version: u8,
    pub(crate) coding: u8,
    pub(crate) color: u8,
    pub(crate) depth: u8,
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) gaussians: u32,
    pub(crate) layers: u16,
    pub(crate) kernel: u8,
    pub(crate) parameterization: u8,
    pub(crate) cutoff: f32,
    pub(crate) transform: u8,
    pub(crate) reserved: [u8; 3],
    pub(crate) base: [u16; 4],
}

impl Default for Ghdr {
    /// Gray, 8 bits, 16x16, no Gaussians, quartic kernel, Cholesky parameterization, black.
    fn default() -> Self {
        Self {
            version: 1,
            coding: 0,
            color: GRAY,
            depth: 8,
            width: 16,
            height: 16,
            gaussians: 0,
            layers: 0,
            kernel: QUARTIC,
            parameterization: CHOLESKY,
            cutoff: 4.0,
            transform: 0,
            reserved: [0; 3],
            base: [0; 4],
        }
    }
}

pub(crate) const GRAY: u8 = 0;
pub(crate) const GRAY_ALPHA: u8 = 1;
pub(crate) const RGB: u8 = 2;
pub(crate) const RGBA: u8 = 3;
pub(crate) const EXPONENTIAL: u8 = 0;
pub(crate) const QUARTIC: u8 = 1;
pub(crate) const COVARIANCE: u8 = 0;
pub(crate) const CHOLESKY: u8 = 1;
pub(crate) const ROTATION_SCALE: u8 = 2;

impl Ghdr {
    pub(crate) fn payload(&self) -> Vec<u8> {
        let mut bytes = vec![self.version, self.coding, self.color, self.depth];
        bytes.extend(self.width.to_le_bytes());
        bytes.extend(self.height.to_le_bytes());
        bytes.extend(self.gaussians.to_le_bytes());
        bytes.extend(self.layers.to_le_bytes());
        bytes.extend([self.kernel, self.parameterization]);
        bytes.extend(self.cutoff.to_le_bytes());
        bytes.push(self.transform);
        bytes.extend(self.reserved);
        bytes.extend(self.base.iter().flat_map(|value| value.to_le_bytes()));
        bytes
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

/// One entry of `QNTZ` (section 6), whatever the values.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    pub(crate) kind: u8,
    pub(crate) bits: u8,
    pub(crate) reserved: [u8; 2],
    pub(crate) scale: f32,
    pub(crate) offset: f32,
}

impl Entry {
    pub(crate) const FLOAT: Self =
        Self { kind: 0, bits: 32, reserved: [0; 2], scale: 1.0, offset: 0.0 };

    pub(crate) const fn linear(bits: u8, scale: f32, offset: f32) -> Self {
        Self { kind: 1, bits, reserved: [0; 2], scale, offset }
    }

    pub(crate) const fn log(bits: u8, scale: f32, offset: f32) -> Self {
        Self { kind: 2, bits, reserved: [0; 2], scale, offset }
    }

    fn payload(&self) -> Vec<u8> {
        let mut bytes = vec![self.kind, self.bits];
        bytes.extend(self.reserved);
        bytes.extend(self.scale.to_le_bytes());
        bytes.extend(self.offset.to_le_bytes());
        bytes
    }
}

/// The payload of `QNTZ`.
pub(crate) fn qntz(entries: &[Entry]) -> Vec<u8> {
    entries.iter().flat_map(Entry::payload).collect()
}

/// The payload of `GAUS` (section 7.2): one code per component, Gaussian after Gaussian.
pub(crate) fn gaus(entries: &[Entry], codes: &[u32]) -> Vec<u8> {
    let mut bits = Vec::new();
    for (index, &code) in codes.iter().enumerate() {
        let width = entries[index % entries.len()].bits;
        bits.extend((0..width).map(|bit| code >> bit & 1));
    }
    let count = (codes.len() / entries.len()) as u32;
    let packed = bits.chunks(8).map(|byte| {
        byte.iter().enumerate().fold(0, |sum, (place, &bit)| sum | (bit as u8) << place)
    });
    count.to_le_bytes().into_iter().chain(packed).collect()
}

/// A whole file.
#[derive(Clone, Debug)]
pub(crate) struct File {
    pub(crate) header: Ghdr,
    pub(crate) entries: Vec<Entry>,
    /// Chunks between `QNTZ` and the first layer: type and payload.
    pub(crate) extra: Vec<([u8; 4], Vec<u8>)>,
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

/// The payload of `QNTZ` of the entropy coding.
pub(crate) fn steps(steps: &[f32]) -> Vec<u8> {
    steps.iter().flat_map(|step| step.to_le_bytes()).collect()
}

impl EntropyCoded {
    /// The payloads of `GAUS`.
    fn payloads(&self, header: &Ghdr) -> Vec<Vec<u8>> {
        let payload = |layer: &Vec<Code>| {
            let ops = entropy::write(header.sides(), &self.steps, &mut layer.clone());
            let count = (layer.len() as u32).to_le_bytes();
            [&count[..], &rans::encode(&ops)].concat()
        };
        self.layers.iter().map(payload).collect()
    }

    fn components(&self, header: &Ghdr) -> Vec<Vec<f32>> {
        let values = |payload: Vec<u8>| {
            let layer = entropy::read(header.sides(), &self.steps, &payload);
            layer.expect("what was just written").values
        };
        self.payloads(header).into_iter().flat_map(values).collect()
    }
}

impl File {
    /// A file whose attributes are floats: one row of components per Gaussian, in one layer.
    pub(crate) fn of_floats(header: Ghdr, gaussians: &[Vec<f32>]) -> Self {
        let codes: Vec<u32> = gaussians.iter().flatten().map(|value| value.to_bits()).collect();
        let layers = if codes.is_empty() { vec![] } else { vec![codes] };
        Self::new(header, vec![Entry::FLOAT; header.components()], layers)
    }

    /// A file with these layers; the header's counts are set to match.
    pub(crate) fn new(mut header: Ghdr, entries: Vec<Entry>, layers: Vec<Vec<u32>>) -> Self {
        header.layers = layers.len() as u16;
        let codes: usize = layers.iter().map(Vec::len).sum();
        header.gaussians = (codes / entries.len()) as u32;
        Self { header, entries, extra: Vec::new(), layers, entropy_coded: None }
    }

    /// An entropy-coded file with these layers; the header's coding and counts are set to match.
    pub(crate) fn of_entropy_coded(header: Ghdr, steps: Vec<f32>, layers: Vec<Vec<Code>>) -> Self {
        let count: usize = layers.iter().map(Vec::len).sum();
        let header = Ghdr {
            coding: 1,
            parameterization: CHOLESKY,
            gaussians: count as u32,
            layers: layers.len() as u16,
            ..header
        };
        let entropy_coded = Some(EntropyCoded { steps, layers });
        Self { header, entries: Vec::new(), extra: Vec::new(), layers: Vec::new(), entropy_coded }
    }

    pub(crate) fn with(mut self, kind: &[u8; 4], payload: &[u8]) -> Self {
        self.extra.push((*kind, payload.to_vec()));
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
                    bounds[axis] = bounds[axis].min(cell(center[axis] - reach[axis]));
                    bounds[axis + 2] = bounds[axis + 2].max(cell(center[axis] + reach[axis]));
                }
            }
            all.extend(bounds);
        }
        all
    }

    /// The chunks in order.
    pub(crate) fn chunks(&self) -> Vec<Vec<u8>> {
        let (quantizers, layers) = match &self.entropy_coded {
            None => {
                let layers = self.layers.iter().map(|codes| gaus(&self.entries, codes));
                (qntz(&self.entries), layers.collect())
            }
            Some(entropy_coded) => {
                (steps(&entropy_coded.steps), entropy_coded.payloads(&self.header))
            }
        };
        let mut chunks = vec![chunk(b"GHDR", &self.header.payload()), chunk(b"QNTZ", &quantizers)];
        chunks.extend(self.extra.iter().map(|(kind, payload)| chunk(kind, payload)));
        chunks.extend(layers.iter().map(|payload| chunk(b"GAUS", payload)));
        chunks.push(chunk(b"GEND", &[]));
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

/// Signature and chunks.
pub(crate) fn of_chunks(chunks: &[Vec<u8>]) -> Vec<u8> {
    [&SIGNATURE, chunks.concat().as_slice()].concat()
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
