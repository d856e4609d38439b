//! The test vectors of files that break a rule.

use super::Vector;
use super::common::{
    EXPONENTIAL, Entry, File, Header, SIGNATURE, checked, chunk, crc32, of_chunks, offsets, packed,
    quantizers,
};
use super::sound::{MASTERING, TURNED};

/// A file of four Gaussians in floats, whose parts are changed. Its chunks are H, three layers and E.
struct Sound {
    entries: Vec<Entry>,
    /// The bytes of a Gaussian.
    gaussian: Vec<u8>,
    /// Its codes.
    codes: [u32; 6],
    file: File,
    bytes: Vec<u8>,
    chunks: Vec<Vec<u8>>,
    /// Where the chunks begin.
    offsets: Vec<usize>,
}

impl Sound {
    fn new() -> Self {
        let entries = vec![Entry::FLOAT; 6];
        let codes = [8.0_f32, 8.0, 2.0, 0.5, 2.0, 0.5].map(f32::to_bits);
        let layers = vec![codes.to_vec(), codes.repeat(2), codes.to_vec()];
        let file = File::new(Header::default(), entries.clone(), layers);
        let (bytes, chunks) = (file.bytes(), file.chunks());
        let (gaussian, offsets) = (packed(&entries, &codes), offsets(&chunks));
        Self { entries, gaussian, codes, file, bytes, chunks, offsets }
    }

    /// With the bytes of a chunk changed.
    fn changed(&self, at: usize, change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
        self.with_chunks(|chunks| change(&mut chunks[at]))
    }

    /// With a wrong CRC of a chunk.
    fn with_wrong_crc(&self, at: usize) -> Vec<u8> {
        self.changed(at, |chunk| *chunk.last_mut().expect("a CRC") ^= 1)
    }

    /// With other chunks.
    fn with_chunks(&self, change: impl FnOnce(&mut Vec<Vec<u8>>)) -> Vec<u8> {
        let mut chunks = self.chunks.clone();
        change(&mut chunks);
        of_chunks(&chunks)
    }

    fn replaced(&self, at: usize, kind: &[u8], payload: &[u8]) -> Vec<u8> {
        self.with_chunks(|chunks| chunks[at] = chunk(kind, payload))
    }

    fn inserted(&self, at: usize, kind: &[u8], payload: &[u8]) -> Vec<u8> {
        self.with_chunks(|chunks| chunks.insert(at, chunk(kind, payload)))
    }

    /// With a private chunk before the layers that has these bytes as its length, and a CRC that is right.
    fn with_length(&self, length: &[u8]) -> Vec<u8> {
        self.with_chunks(|chunks| chunks.insert(1, checked(&[b"prVt", length, b"abc"].concat())))
    }

    /// The header's fields before its quantizers, changed.
    fn fields(&self, change: impl FnOnce(&mut Header)) -> Vec<u8> {
        let mut header = self.file.header;
        change(&mut header);
        header.fields()
    }

    /// With these fields, and the quantizers.
    fn with_fields(&self, fields: &[u8]) -> Vec<u8> {
        self.replaced(0, b"H", &[fields, &quantizers(&self.entries)].concat())
    }

    fn with_header(&self, change: impl FnOnce(&mut Header)) -> Vec<u8> {
        self.with_fields(&self.fields(change))
    }

    fn with_entry(&self, entry: Entry) -> Vec<u8> {
        let mut entries = self.entries.clone();
        entries[2] = entry;
        self.replaced(0, b"H", &[&self.fields(|_| ())[..], &quantizers(&entries)].concat())
    }

    /// With these bytes before the two Gaussians of the second layer.
    fn with_number(&self, number: &[u8]) -> Vec<u8> {
        self.replaced(2, b"L", &[number, &self.gaussian.repeat(2)].concat())
    }

    /// With another code in the layer of two Gaussians.
    fn with_code(&self, at: usize, code: u32) -> Vec<u8> {
        let mut codes = self.codes.repeat(2);
        codes[at] = code;
        self.replaced(2, b"L", &[&[2][..], &packed(&self.entries, &codes)].concat())
    }
}

pub(super) fn invalid() -> Vec<Vector> {
    let sound = Sound::new();
    [
        ends(&sound),
        signatures(&sound),
        chunks(&sound),
        headers(&sound),
        quantizer_entries(&sound),
        layers(&sound),
        order(&sound),
    ]
    .concat()
}

/// Files that end too early (sections 4 and 11).
fn ends(sound: &Sound) -> Vec<Vector> {
    let before = |end: usize| sound.bytes[..end].to_vec();
    vec![
        Vector::invalid("xempty", "no byte at all", Vec::new()),
        Vector::invalid("xtruncated-header", "ends within the header", before(15)),
        Vector::invalid(
            "xtruncated-layer",
            "ends within the second layer: the Gaussians that arrived are shown",
            // Type, length, number, one Gaussian of 24 bytes and a part of the next.
            before(sound.offsets[2] + 3 + 24 + 5),
        ),
        Vector::invalid(
            "xtruncated-number",
            "ends within the number of Gaussians in the second layer",
            [&sound.bytes[..sound.offsets[2]], b"L", &[50, 0x82]].concat(),
        ),
        Vector::invalid(
            "xtruncated-length",
            "ends within the length of a chunk, whose type is known",
            [&sound.bytes[..sound.offsets[1]], b"prVt", &[0x82]].concat(),
        ),
        Vector::invalid(
            "xtruncated-type",
            "ends within the type of a chunk",
            [&sound.bytes[..sound.offsets[1]], b"prV"].concat(),
        ),
        Vector::invalid("xtruncated-end", "no E", before(sound.offsets[4])),
    ]
}

/// The signature, and the version in it (section 4.1).
fn signatures(sound: &Sound) -> Vec<Vector> {
    let with_signature = |signature: &[u8]| [signature, &sound.bytes[SIGNATURE.len()..]].concat();
    let with_version = |version: u8| {
        let mut signature = SIGNATURE;
        signature[6] = version;
        with_signature(&signature)
    };
    vec![
        Vector::invalid(
            "xsignature",
            "line endings that a transfer in text mode has made line feeds",
            with_signature(b"\xC7GIP\n\x01\n"),
        ),
        Vector::invalid(
            "xsignature-crlf",
            "line endings that a transfer in text mode has made carriage returns and line feeds",
            with_signature(b"\xC7GIP\r\n\x01\r\n"),
        ),
        Vector::invalid(
            "xsignature-letter",
            "another letter in the signature",
            with_signature(b"\xC7GIF\r\n\x01\n"),
        ),
        Vector::invalid("xversion", "version 2", with_version(2)),
        Vector::invalid("xversion-zero", "version 0", with_version(0)),
    ]
}

/// Chunks (section 4) and their lengths.
fn chunks(sound: &Sound) -> Vec<Vector> {
    let crc_of = |parts: &[&[u8]]| crc32(&parts.concat()).to_le_bytes();
    let (kind, length, payload) = (b"prVt", [3], b"abc");
    let with_crc = |crc: [u8; 4]| {
        sound.with_chunks(|chunks| chunks.insert(1, [kind, &length[..], payload, &crc].concat()))
    };
    let whole_header = [sound.fields(|_| ()), quantizers(&sound.entries)].concat();
    vec![
        Vector::invalid("xcrc-header", "a wrong CRC of the header", sound.with_wrong_crc(0)),
        Vector::invalid(
            "xcrc-layer",
            "a flipped bit in the second layer",
            sound.changed(2, |c| c[20] ^= 4),
        ),
        Vector::invalid(
            "xcrc-end",
            "a wrong CRC of the last chunk: all Gaussians are kept",
            sound.with_wrong_crc(4),
        ),
        Vector::invalid(
            "xcrc-length",
            "a CRC of type and payload, without the length",
            with_crc(crc_of(&[kind, payload])),
        ),
        Vector::invalid(
            "xcrc-type",
            "a CRC without the type",
            with_crc(crc_of(&[&length, payload])),
        ),
        Vector::invalid(
            "xcritical",
            "an unknown critical chunk before the layers",
            sound.inserted(1, b"Q", b"?"),
        ),
        Vector::invalid(
            "xcritical-late",
            "an unknown critical chunk after a layer",
            sound.inserted(2, b"A", b""),
        ),
        Vector::invalid(
            "xtype",
            "a type that is not of letters alone",
            sound.inserted(1, b"ab1d", b"?"),
        ),
        Vector::invalid("xtype-first", "a type of one byte that is no letter", {
            sound.inserted(1, b"1", b"?")
        }),
        Vector::invalid(
            "xlength-needless",
            "a length with a byte that it does not need",
            sound.with_length(&[0x83, 0]),
        ),
        Vector::invalid(
            "xlength-five",
            "a length with three bytes that it does not need",
            sound.with_length(&[0x83, 0x80, 0x80, 0x80, 0]),
        ),
        Vector::invalid("xlength-33", "a length of 33 bits", {
            sound.with_length(&[0x83, 0x80, 0x80, 0x80, 0x10])
        }),
        Vector::invalid("xlength-six", "a length of six bytes", {
            sound.with_length(&[0x83, 0x80, 0x80, 0x80, 0x80, 0])
        }),
        Vector::invalid("xlength-over", "a length of 2^31", {
            sound.with_length(&[0x80, 0x80, 0x80, 0x80, 8])
        }),
        Vector::invalid("xlength-header", "a header that lacks its last byte", {
            sound.replaced(0, b"H", &whole_header[..whole_header.len() - 1])
        }),
        Vector::invalid("xlength-header-more", "a header with one byte more than its fields", {
            sound.replaced(0, b"H", &[&whole_header[..], &[0]].concat())
        }),
        Vector::invalid("xlength-header-256", "a header of 256 bytes", {
            let mut payload = whole_header.clone();
            payload.resize(256, 0);
            sound.replaced(0, b"H", &payload)
        }),
        Vector::invalid("xlength-quantizers", "one quantizer too few", {
            let quantizers = quantizers(&sound.entries[1..]);
            sound.replaced(0, b"H", &[sound.fields(|_| ()), quantizers].concat())
        }),
        Vector::invalid("xlength-layer", "a layer one byte longer than its number says", {
            let payload = [&[2][..], &sound.gaussian.repeat(2), &[0]].concat();
            sound.replaced(2, b"L", &payload)
        }),
        Vector::invalid("xlength-last", "a last layer one byte shorter than its Gaussians", {
            sound.replaced(3, b"L", &sound.gaussian[1..])
        }),
        Vector::invalid("xlength-end", "E with a payload", sound.replaced(4, b"E", &[0])),
    ]
}

/// The header (section 5.1).
fn headers(sound: &Sound) -> Vec<Vector> {
    let nan = f32::from_bits(0x7FC0_0000);
    let with_cutoff =
        |cutoff: f32| sound.with_header(|h| (h.kernel, h.cutoff) = (EXPONENTIAL, cutoff));
    // 16 x 16, four Gaussians in three layers, black.
    let fields = |width: &[u8]| [&[sound.file.header.format()], width, &[16, 4, 3, 0]].concat();
    assert_eq!(fields(&[16]), sound.fields(|_| ()));
    let with_width = |width: &[u8]| sound.with_fields(&fields(width));
    vec![
        Vector::invalid("xformat", "bit 7 of the format", sound.with_header(|h| h.reserved = 1)),
        Vector::invalid(
            "xparameterization",
            "an unknown parameterization",
            sound.with_header(|h| h.form = 3),
        ),
        Vector::invalid("xwidth-zero", "a width of 0", sound.with_header(|h| h.width = 0)),
        Vector::invalid(
            "xheight-over",
            "a height over 2^20",
            sound.with_header(|h| h.height = 1_048_577),
        ),
        Vector::invalid(
            "xwidth-needless",
            "a width with a byte that it does not need",
            with_width(&[0x90, 0]),
        ),
        Vector::invalid(
            "xwidth-33",
            "a width of 33 bits",
            with_width(&[0x90, 0x80, 0x80, 0x80, 0x10]),
        ),
        Vector::invalid(
            "xcount-fewer",
            "one Gaussian fewer than declared",
            sound.with_header(|h| h.gaussians = 5),
        ),
        Vector::invalid(
            "xcount-more",
            "as many Gaussians in the first two layers as declared for three",
            sound.with_header(|h| h.gaussians = 3),
        ),
        Vector::invalid(
            "xlayers-fewer",
            "one layer fewer than declared",
            sound.with_chunks(|chunks| drop(chunks.remove(3))),
        ),
        Vector::invalid(
            "xlayers-more",
            "one layer more than declared",
            sound.inserted(4, b"L", &sound.gaussian),
        ),
        Vector::invalid(
            "xlayers-zero",
            "Gaussians without a layer",
            sound.with_header(|h| h.layers = 0),
        ),
        Vector::invalid(
            "xlayers-many",
            "more layers than Gaussians",
            sound.with_header(|h| h.layers = 5),
        ),
        Vector::invalid("xlayers-over", "65536 layers", {
            sound.with_header(|h| (h.gaussians, h.layers) = (1 << 17, 1 << 16))
        }),
        Vector::invalid("xlayers-none", "a layer, where the header declares no Gaussians", {
            let empty = sound.fields(|h| (h.gaussians, h.layers) = (0, 0));
            sound.replaced(0, b"H", &empty)
        }),
        Vector::invalid(
            "xquantizers-none",
            "quantizers, where the header declares no Gaussians",
            sound.with_header(|h| (h.gaussians, h.layers) = (0, 0)),
        ),
        Vector::invalid("xcutoff-nan", "a cut-off of NaN", with_cutoff(nan)),
        Vector::invalid("xcutoff-zero", "a cut-off of 0", with_cutoff(0.0)),
        Vector::invalid("xcutoff-over", "a cut-off over 64", with_cutoff(64.5)),
    ]
}

/// Quantizers (section 6).
fn quantizer_entries(sound: &Sound) -> Vec<Vector> {
    let scale = |scale: f32| sound.with_entry(Entry::linear(8, scale, 0.5));
    vec![
        Vector::invalid("xscale-zero", "a scale of zero", scale(0.0)),
        Vector::invalid("xscale-negative", "a negative scale", scale(-1.0)),
        Vector::invalid("xscale-nan", "a scale of NaN", scale(f32::from_bits(0x7FC0_0000))),
        Vector::invalid("xscale-infinite", "an infinite scale", scale(f32::INFINITY)),
        Vector::invalid("xscale-over", "a scale over 2^32", scale(4_294_967_808.0)),
        Vector::invalid("xoffset-nan", "an offset of NaN", {
            sound.with_entry(Entry::log(8, 1.0, f32::from_bits(0x7FC0_0000)))
        }),
        Vector::invalid("xoffset-under", "an offset under -2^32", {
            sound.with_entry(Entry::linear(8, 1.0, -4_294_967_808.0))
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
        Vector::invalid("xbits-float", "a float of 16 bits", {
            sound.with_entry(Entry { bits: 16, ..Entry::FLOAT })
        }),
        Vector::invalid("xquantizer", "an unknown kind of quantizer", {
            sound.with_entry(Entry { kind: 3, ..Entry::linear(8, 1.0, 0.5) })
        }),
    ]
}

/// Layers (section 5.4) and packed codes (section 7.2).
fn layers(sound: &Sound) -> Vec<Vector> {
    let padded = {
        let entries = vec![Entry::linear(3, 1.0, 1.0); 6];
        let mut bytes = packed(&entries, &[1; 6]);
        bytes[2] |= 0x80;
        let header = Header { gaussians: 1, layers: 1, ..Header::default() };
        of_chunks(&[header.chunk(&quantizers(&entries)), chunk(b"L", &bytes), chunk(b"E", &[])])
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
        Vector::invalid("xlayer-empty", "a layer without Gaussians", {
            sound.replaced(2, b"L", &[0])
        }),
        Vector::invalid("xlayer-none", "a layer that ends before its number of Gaussians", {
            sound.replaced(2, b"L", &[])
        }),
        Vector::invalid("xlayer-all", "a layer that leaves no Gaussian for the next one", {
            sound.replaced(2, b"L", &[&[3][..], &sound.gaussian.repeat(3)].concat())
        }),
        Vector::invalid(
            "xlayer-needless",
            "a layer whose number has a byte that it does not need",
            sound.with_number(&[0x82, 0]),
        ),
        Vector::invalid(
            "xlayer-33",
            "a layer whose number has 33 bits",
            sound.with_number(&[0x82, 0x80, 0x80, 0x80, 0x10]),
        ),
        Vector::invalid("xlayer-last", "a last layer that begins with its number of Gaussians", {
            sound.replaced(3, b"L", &[&[1][..], &sound.gaussian].concat())
        }),
        Vector::invalid("xpadding", "a padding bit that is not zero", padded),
    ]
}

/// The order of chunks (section 4), and metadata (section 5.5).
fn order(sound: &Sound) -> Vec<Vector> {
    vec![
        Vector::invalid("xorder-header", "a chunk before H", sound.inserted(0, b"prVt", b"")),
        Vector::invalid(
            "xorder-layer",
            "a layer before H",
            sound.with_chunks(|chunks| chunks.swap(0, 1)),
        ),
        Vector::invalid(
            "xorder-end",
            "E before the last layer",
            sound.with_chunks(|chunks| chunks.swap(3, 4)),
        ),
        Vector::invalid(
            "xtwice-header",
            "two headers",
            sound.with_chunks(|chunks| chunks.insert(1, chunks[0].clone())),
        ),
        Vector::invalid(
            "xtwice-header-late",
            "a second header, after a layer",
            sound.with_chunks(|chunks| chunks.insert(2, chunks[0].clone())),
        ),
        Vector::invalid("xtwice-icc", "two ICC profiles", {
            let profile = chunk(b"iCCP", b"p");
            sound.with_chunks(|chunks| drop(chunks.splice(1..1, [profile.clone(), profile])))
        }),
        Vector::invalid("xtwice-cicp", "a cICP before the layers and one between them", {
            let points = chunk(b"cICP", &[12, 13, 0, 1]);
            sound.with_chunks(|chunks| {
                chunks.insert(2, points.clone());
                chunks.insert(1, points);
            })
        }),
        Vector::invalid("xtwice-mdcv", "two mDCV", {
            let display = chunk(b"mDCV", MASTERING);
            sound.with_chunks(|chunks| drop(chunks.splice(1..1, [display.clone(), display])))
        }),
        Vector::invalid("xtwice-clli", "two cLLI", {
            let light = chunk(b"cLLI", &[0; 8]);
            sound.with_chunks(|chunks| drop(chunks.splice(1..1, [light.clone(), light])))
        }),
        Vector::invalid("xcicp-short", "a cICP without the full range flag", {
            sound.inserted(1, b"cICP", &[12, 13, 0])
        }),
        Vector::invalid("xcicp-long", "a cICP of five bytes, after a layer", {
            sound.inserted(2, b"cICP", &[12, 13, 0, 1, 0])
        }),
        Vector::invalid("xcicp-matrix", "a cICP with the matrix coefficients of BT.709", {
            sound.inserted(1, b"cICP", &[1, 1, 1, 1])
        }),
        Vector::invalid("xcicp-range", "a cICP that says that samples are not of full range", {
            sound.inserted(1, b"cICP", &[1, 1, 0, 0])
        }),
        Vector::invalid("xmdcv-short", "an mDCV of 23 bytes", {
            sound.inserted(1, b"mDCV", &MASTERING[1..])
        }),
        Vector::invalid("xclli-long", "a cLLI of nine bytes, after the last layer", {
            sound.inserted(4, b"cLLI", &[0; 9])
        }),
        Vector::invalid("xtwice-xmp-late", "XMP before the layers and after them", {
            let xmp = chunk(b"xMPd", b"<x/>");
            sound.with_chunks(|chunks| {
                chunks.insert(4, xmp.clone());
                chunks.insert(1, xmp);
            })
        }),
        Vector::invalid(
            "xexif-late",
            "Exif that turns the picture, after the first layer",
            sound.inserted(2, b"eXIf", TURNED),
        ),
        Vector::invalid(
            "xexif-last",
            "Exif that turns the picture, after the last layer",
            sound.inserted(4, b"eXIf", TURNED),
        ),
        Vector::invalid("xtext", "a text without the NUL after its keyword", {
            sound.inserted(1, b"tEXt", b"Title: none")
        }),
        Vector::invalid("xtext-utf8", "a text that is not UTF-8", {
            sound.inserted(1, b"tEXt", b"Title\0\xE9")
        }),
        Vector::invalid("xtext-late", "a text with a NUL, after the last layer", {
            sound.inserted(4, b"tEXt", b"Title\0a\0b")
        }),
    ]
}
