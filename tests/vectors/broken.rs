//! The test vectors of files that break a rule.

use super::Vector;
use super::common::{EXPONENTIAL, Entry, File, Ghdr, QUARTIC, chunk, gaus, of_chunks, qntz};

/// A file of four Gaussians in floats, whose parts are changed. Its chunks are GHDR, QNTZ, three layers and
/// GEND; the first layer is number 2.
struct Sound {
    entries: Vec<Entry>,
    /// The codes of a Gaussian.
    codes: [u32; 6],
    file: File,
    bytes: Vec<u8>,
    chunks: Vec<Vec<u8>>,
}

impl Sound {
    fn new() -> Self {
        let entries = vec![Entry::FLOAT; 6];
        let codes = [8.0_f32, 8.0, 2.0, 0.5, 2.0, 0.5].map(f32::to_bits);
        let layers = vec![codes.to_vec(), codes.repeat(2), codes.to_vec()];
        let file = File::new(Ghdr::default(), entries.clone(), layers);
        let (bytes, chunks) = (file.bytes(), file.chunks());
        Self { entries, codes, file, bytes, chunks }
    }

    /// With the bytes of a chunk changed.
    fn changed(&self, at: usize, change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
        let mut bytes = self.bytes.clone();
        let start = 8 + self.chunks[..at].iter().map(Vec::len).sum::<usize>();
        let mut chunk = bytes.split_off(start);
        let rest = chunk.split_off(self.chunks[at].len());
        change(&mut chunk);
        [bytes, chunk, rest].concat()
    }

    /// With other chunks.
    fn with_chunks(&self, change: impl FnOnce(&mut Vec<Vec<u8>>)) -> Vec<u8> {
        let mut chunks = self.chunks.clone();
        change(&mut chunks);
        of_chunks(&chunks)
    }

    fn replaced(&self, at: usize, kind: &[u8; 4], payload: &[u8]) -> Vec<u8> {
        self.with_chunks(|chunks| chunks[at] = chunk(kind, payload))
    }

    fn inserted(&self, at: usize, kind: &[u8; 4], payload: &[u8]) -> Vec<u8> {
        self.with_chunks(|chunks| chunks.insert(at, chunk(kind, payload)))
    }

    fn with_header(&self, change: impl FnOnce(&mut Ghdr)) -> Vec<u8> {
        let mut header = self.file.header;
        change(&mut header);
        self.replaced(0, b"GHDR", &header.payload())
    }

    fn with_entry(&self, entry: Entry) -> Vec<u8> {
        let mut entries = self.entries.clone();
        entries[2] = entry;
        self.replaced(1, b"QNTZ", &qntz(&entries))
    }

    /// With another code in the layer of two Gaussians.
    fn with_code(&self, at: usize, code: u32) -> Vec<u8> {
        let mut codes = self.codes.repeat(2);
        codes[at] = code;
        self.replaced(3, b"GAUS", &gaus(&self.entries, &codes))
    }
}

pub(super) fn invalid() -> Vec<Vector> {
    let sound = Sound::new();
    [
        ends(&sound),
        chunks(&sound),
        headers(&sound),
        quantizers(&sound),
        layers(&sound),
        order(&sound),
    ]
    .concat()
}

/// The signature, and files that end too early (sections 4 and 11).
fn ends(sound: &Sound) -> Vec<Vector> {
    vec![
        Vector::invalid("xempty", "no byte at all", Vec::new()),
        Vector::invalid("xsignature", "line endings that a transfer in text mode has converted", {
            let mut bytes = sound.bytes.clone();
            bytes.remove(4);
            bytes
        }),
        Vector::invalid("xtruncated-header", "ends within the header", sound.bytes[..40].to_vec()),
        Vector::invalid(
            "xtruncated-layer",
            "ends within the second layer: the Gaussians that arrived are shown",
            sound.bytes[..8 + 48 + 84 + 40 + 8 + 4 + 24 + 5].to_vec(),
        ),
        Vector::invalid(
            "xtruncated-end",
            "no GEND",
            sound.with_chunks(|chunks| drop(chunks.remove(5))),
        ),
    ]
}

/// Chunks (section 4) and their lengths.
fn chunks(sound: &Sound) -> Vec<Vector> {
    let last = |chunk: &mut Vec<u8>| chunk.len() - 1;
    vec![
        Vector::invalid(
            "xcrc-header",
            "a wrong CRC of the header",
            sound.changed(0, |c| {
                let at = last(c);
                c[at] ^= 1;
            }),
        ),
        Vector::invalid(
            "xcrc-layer",
            "a flipped bit in the second layer",
            sound.changed(3, |c| c[20] ^= 4),
        ),
        Vector::invalid("xcrc-end", "a wrong CRC of the last chunk: all Gaussians are kept", {
            sound.changed(5, |c| {
                let at = last(c);
                c[at] ^= 1;
            })
        }),
        Vector::invalid("xcritical", "an unknown critical chunk", sound.inserted(2, b"ABCD", b"?")),
        Vector::invalid(
            "xtype",
            "a type that is not four letters",
            sound.inserted(2, b"ab1d", b"?"),
        ),
        Vector::invalid(
            "xlength-over",
            "a length over 2^31 - 1",
            sound.changed(2, |c| c[3] = 0x80),
        ),
        Vector::invalid("xlength-header", "a header of 35 bytes", {
            let mut payload = sound.file.header.payload();
            payload.pop();
            sound.replaced(0, b"GHDR", &payload)
        }),
        Vector::invalid(
            "xlength-quantizers",
            "one quantizer too few",
            sound.replaced(1, b"QNTZ", &qntz(&sound.entries[1..])),
        ),
        Vector::invalid("xlength-layer", "a layer one byte longer than its count says", {
            let mut payload = gaus(&sound.entries, &sound.codes.repeat(2));
            payload.push(0);
            sound.replaced(3, b"GAUS", &payload)
        }),
        Vector::invalid("xlength-end", "GEND with a payload", sound.replaced(5, b"GEND", &[0])),
    ]
}

/// `GHDR` (section 5.1).
fn headers(sound: &Sound) -> Vec<Vector> {
    vec![
        Vector::invalid("xversion", "version 2", sound.with_header(|h| h.version = 2)),
        Vector::invalid("xcoding", "an unknown coding", sound.with_header(|h| h.coding = 2)),
        Vector::invalid("xcolor", "an unknown colour model", sound.with_header(|h| h.color = 4)),
        Vector::invalid("xdepth", "a sample depth of 12", sound.with_header(|h| h.depth = 12)),
        Vector::invalid("xwidth-zero", "a width of 0", sound.with_header(|h| h.width = 0)),
        Vector::invalid(
            "xheight-over",
            "a height over 2^20",
            sound.with_header(|h| h.height = 1_048_577),
        ),
        Vector::invalid(
            "xcount-fewer",
            "one Gaussian fewer than declared",
            sound.with_header(|h| h.gaussians = 5),
        ),
        Vector::invalid(
            "xcount-more",
            "one Gaussian more than declared",
            sound.with_header(|h| h.gaussians = 3),
        ),
        Vector::invalid(
            "xlayers-fewer",
            "one layer fewer than declared",
            sound.with_header(|h| h.layers = 4),
        ),
        Vector::invalid(
            "xlayers-more",
            "one layer more than declared",
            sound.with_header(|h| h.layers = 2),
        ),
        Vector::invalid(
            "xlayers-zero",
            "Gaussians without a layer",
            sound.with_header(|h| h.layers = 0),
        ),
        Vector::invalid("xkernel", "an unknown kernel", sound.with_header(|h| h.kernel = 2)),
        Vector::invalid(
            "xcutoff-nan",
            "a cut-off of NaN",
            sound.with_header(|h| {
                (h.kernel, h.cutoff) = (EXPONENTIAL, f32::from_bits(0x7FC0_0000));
            }),
        ),
        Vector::invalid(
            "xcutoff-over",
            "a cut-off over 64",
            sound.with_header(|h| {
                (h.kernel, h.cutoff) = (EXPONENTIAL, 64.5);
            }),
        ),
        Vector::invalid(
            "xcutoff-quartic",
            "quartic kernel with a cut-off other than 4",
            sound.with_header(|h| {
                (h.kernel, h.cutoff) = (QUARTIC, 9.0);
            }),
        ),
        Vector::invalid(
            "xparameterization",
            "an unknown parameterization",
            sound.with_header(|h| h.parameterization = 3),
        ),
        Vector::invalid(
            "xtransform",
            "an unknown colour transform",
            sound.with_header(|h| h.transform = 1),
        ),
        Vector::invalid(
            "xreserved",
            "a reserved byte that is not zero",
            sound.with_header(|h| {
                h.reserved[2] = 1;
            }),
        ),
        Vector::invalid(
            "xbase",
            "a base colour in a channel that gray does not have",
            sound.with_header(|h| {
                h.base[1] = 1;
            }),
        ),
    ]
}

/// `QNTZ` (section 5.3).
fn quantizers(sound: &Sound) -> Vec<Vector> {
    let scale = |scale: f32| sound.with_entry(Entry::linear(8, scale, 0.5));
    vec![
        Vector::invalid("xscale-zero", "a scale of zero", scale(0.0)),
        Vector::invalid("xscale-negative", "a negative scale", scale(-1.0)),
        Vector::invalid("xscale-nan", "a scale of NaN", scale(f32::from_bits(0x7FC0_0000))),
        Vector::invalid("xscale-infinite", "an infinite scale", scale(f32::INFINITY)),
        Vector::invalid("xoffset-nan", "an offset of NaN", {
            sound.with_entry(Entry::log(8, 1.0, f32::from_bits(0x7FC0_0000)))
        }),
        Vector::invalid(
            "xbits-zero",
            "a bit depth of 0",
            sound.with_entry(Entry::linear(0, 1.0, 0.5)),
        ),
        Vector::invalid(
            "xbits-over",
            "a bit depth of 17",
            sound.with_entry(Entry::linear(17, 1.0, 0.5)),
        ),
        Vector::invalid("xquantizer", "an unknown kind of quantizer", {
            sound.with_entry(Entry { kind: 3, ..Entry::linear(8, 1.0, 0.5) })
        }),
        Vector::invalid("xfloat-scale", "a float with a scale that is not 1", {
            sound.with_entry(Entry { scale: 2.0, ..Entry::FLOAT })
        }),
    ]
}

/// `GAUS` (section 5.4) and packed codes (section 7.2).
fn layers(sound: &Sound) -> Vec<Vector> {
    let padded = {
        let entries = vec![Entry::linear(3, 1.0, 1.0); 6];
        let mut payload = gaus(&entries, &[1; 6]);
        payload[6] |= 0x80;
        let header = Ghdr { gaussians: 1, layers: 1, ..Ghdr::default() };
        of_chunks(&[
            chunk(b"GHDR", &header.payload()),
            chunk(b"QNTZ", &qntz(&entries)),
            chunk(b"GAUS", &payload),
            chunk(b"GEND", &[]),
        ])
    };
    vec![
        Vector::invalid(
            "xfloat-nan",
            "a float attribute that is NaN",
            sound.with_code(9, 0x7FC0_0000),
        ),
        Vector::invalid(
            "xfloat-infinite",
            "a float attribute that is infinite",
            sound.with_code(11, 0xFF80_0000),
        ),
        Vector::invalid(
            "xlayer-empty",
            "a layer without Gaussians",
            sound.replaced(3, b"GAUS", &[0; 4]),
        ),
        Vector::invalid("xpadding", "a padding bit that is not zero", padded),
    ]
}

/// The order of chunks (section 4), and metadata (section 5.5).
fn order(sound: &Sound) -> Vec<Vector> {
    vec![
        Vector::invalid(
            "xorder-quantizers",
            "QNTZ after a layer",
            sound.with_chunks(|chunks| chunks.swap(1, 2)),
        ),
        Vector::invalid("xorder-header", "a chunk before GHDR", sound.inserted(0, b"prVt", b"")),
        Vector::invalid(
            "xtwice-header",
            "two headers",
            sound.with_chunks(|chunks| chunks.insert(1, chunks[0].clone())),
        ),
        Vector::invalid(
            "xtwice-quantizers",
            "two QNTZ",
            sound.with_chunks(|chunks| chunks.insert(1, chunks[1].clone())),
        ),
        Vector::invalid("xtwice-icc", "two ICC profiles", {
            let profile = chunk(b"iCCP", b"p");
            sound.with_chunks(|chunks| drop(chunks.splice(1..1, [profile.clone(), profile])))
        }),
        Vector::invalid("xtext", "a text without the NUL after its keyword", {
            sound.inserted(1, b"tEXt", b"Title: none")
        }),
        Vector::invalid("xtext-utf8", "a text that is not UTF-8", {
            sound.inserted(1, b"tEXt", b"Title\0\xE9")
        }),
    ]
}
