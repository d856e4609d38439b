//! The test vectors of files that break a rule.

use super::Vector;
use super::common::{
    EXPONENTIAL, Entry, File, Header, SIGNATURE, checked, chunk, crc32, of_chunks, offsets, packed,
    quantizers,
};

/// A file of four Gaussians in floats, whose parts are changed. Its chunks are H, three layers and E.
pub(super) struct Sound {
    entries: Vec<Entry>,
    /// The bytes of a Gaussian.
    gaussian: Vec<u8>,
    /// Its codes.
    codes: [u32; 6],
    pub(super) file: File,
    bytes: Vec<u8>,
    chunks: Vec<Vec<u8>>,
    /// Where the chunks begin.
    offsets: Vec<usize>,
}

impl Sound {
    pub(super) fn new() -> Self {
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
    pub(super) fn with_chunks(&self, change: impl FnOnce(&mut Vec<Vec<u8>>)) -> Vec<u8> {
        let mut chunks = self.chunks.clone();
        change(&mut chunks);
        of_chunks(&chunks)
    }

    fn replaced(&self, at: usize, kind: &[u8], payload: &[u8]) -> Vec<u8> {
        self.with_chunks(|chunks| chunks[at] = chunk(kind, payload))
    }

    pub(super) fn inserted(&self, at: usize, kind: &[u8], payload: &[u8]) -> Vec<u8> {
        self.with_chunks(|chunks| chunks.insert(at, chunk(kind, payload)))
    }

    /// With a private chunk before the layers that has these bytes as its length, and a CRC that is right.
    fn with_length(&self, length: &[u8]) -> Vec<u8> {
        self.with_chunks(|chunks| chunks.insert(1, checked(&[b"prVt", length, b"abc"].concat())))
    }

    /// With these bytes in place of all chunks from one on.
    fn cut_after(&self, at: usize, bytes: &[&[u8]]) -> Vec<u8> {
        [&of_chunks(&self.chunks[..at])[..], &bytes.concat()].concat()
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
        first_errors(&sound),
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
        Vector::invalid("xpadding", "a padding bit that is not zero", padded(None)),
    ]
}

/// The order of chunks (section 4.4).
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
        Vector::invalid("xorder-end-payload", "an E before the layers that ends in its payload", {
            sound.cut_after(1, &[b"E", &[3], b"ab"])
        }),
        Vector::invalid(
            "xorder-critical",
            "an unknown critical chunk before H",
            sound.inserted(0, b"Q", b""),
        ),
        Vector::invalid(
            "xorder-type",
            "a chunk before H whose type is not of letters alone",
            sound.inserted(0, b"a1bc", b""),
        ),
    ]
}

/// Which error comes first, where there are two or the file is cut off (section 11).
fn first_errors(sound: &Sound) -> Vec<Vector> {
    let wrong_crc = |kind: &[u8], payload: &[u8]| {
        let mut chunk = chunk(kind, payload);
        *chunk.last_mut().expect("a CRC") ^= 1;
        chunk
    };
    let with = |at: usize, chunk: Vec<u8>| sound.with_chunks(|chunks| chunks.insert(at, chunk));
    let layer = [&[2][..], &sound.gaussian.repeat(2)].concat();
    vec![
        Vector::invalid(
            "xfirst-critical-crc",
            "an unknown critical chunk with a wrong CRC",
            with(2, wrong_crc(b"Q", b"?")),
        ),
        Vector::invalid(
            "xfirst-critical-cut",
            "an unknown critical chunk, cut off in its payload",
            sound.cut_after(2, &[b"Q", &[3], b"ab"]),
        ),
        Vector::invalid("xfirst-header-twice", "a second H, cut off in its payload", {
            sound.cut_after(2, &[b"H", &[9], b"ab"])
        }),
        Vector::invalid("xfirst-header-long", "an H of 256 bytes, cut off in its payload", {
            sound.cut_after(0, &[b"H", &[0x80, 2], b"ab"])
        }),
        Vector::invalid(
            "xfirst-header-format",
            "an H of one byte, whose bit 7 is set",
            sound.replaced(0, b"H", &[0x80]),
        ),
        Vector::invalid(
            "xfirst-header-crc",
            "an H with bit 7 set and a wrong CRC",
            sound.with_chunks(|chunks| chunks[0] = wrong_crc(b"H", &[0x80])),
        ),
        Vector::invalid(
            "xfirst-header-side",
            "a width over 2^20, and a height of 0",
            sound.with_header(|header| (header.width, header.height) = ((1 << 20) + 1, 0)),
        ),
        Vector::invalid(
            "xfirst-header-quantizer",
            "an H that ends after the kind of a quantizer, which is not known",
            sound.replaced(0, b"H", &[&sound.fields(|_| ())[..], &[3]].concat()),
        ),
        Vector::invalid("xfirst-layer-many", "a layer too many, cut off in its payload", {
            sound.cut_after(4, &[b"L", &[9], b"ab"])
        }),
        Vector::invalid(
            "xfirst-layer-number",
            "a layer with a number too large, cut off after it",
            sound.cut_after(2, &[b"L", &[49], &[3]]),
        ),
        Vector::invalid(
            "xfirst-layer-length",
            "a layer whose length does not fit its number, cut off in its first Gaussian",
            sound.cut_after(2, &[b"L", &[50], &[2], &sound.gaussian[..7]]),
        ),
        Vector::invalid(
            "xfirst-length-fifth",
            "a length whose fifth byte is over 0x0F, cut off after it",
            sound.cut_after(1, &[b"tEXt", &[0x80; 5]]),
        ),
        Vector::invalid(
            "xfirst-critical-length",
            "an unknown critical chunk with a length of 2^31",
            sound.cut_after(2, &[b"Q", &[0x80, 0x80, 0x80, 0x80, 8]]),
        ),
        Vector::invalid(
            "xfirst-header-layers",
            "more than 65535 layers, and more layers than Gaussians",
            sound.with_header(|header| header.layers = 70_000),
        ),
        Vector::invalid(
            "xfirst-layer-nan-early",
            "a layer with a NaN as its first value, cut off after it",
            sound.cut_after(2, &[b"L", &[49], &[2], &0x7FC0_0000_u32.to_le_bytes()]),
        ),
        Vector::invalid(
            "xfirst-layer-number-cut",
            "a layer whose payload ends in its number, cut off in its CRC",
            sound.cut_after(2, &[b"L", &[1], &[0x80], &[0]]),
        ),
        Vector::invalid(
            "xfirst-last-length",
            "a last layer whose length does not fit its Gaussians, cut off after it",
            sound.cut_after(3, &[b"L", &[25]]),
        ),
        Vector::invalid(
            "xfirst-layer-nan",
            "a layer with a NaN in its first Gaussian, cut off in the second",
            {
                let mut nan = layer[..1 + 24 + 5].to_vec();
                nan[1 + 4..1 + 8].copy_from_slice(&0x7FC0_0000_u32.to_le_bytes());
                sound.cut_after(2, &[b"L", &[49], &nan])
            },
        ),
        Vector::invalid(
            "xfirst-layer-padding",
            "a layer with a padding bit that is not zero, cut off in its CRC",
            padded(Some(2)),
        ),
        Vector::invalid("xfirst-type", "a type with a digit, cut off before its last byte", {
            sound.cut_after(2, &[b"a1b"])
        }),
        Vector::invalid("xfirst-text-crc", "a broken text with a wrong CRC", {
            with(1, wrong_crc(b"tEXt", b"Title: none"))
        }),
        Vector::invalid("xfirst-icc-cut", "a second ICC profile, cut off in its payload", {
            let (header, profile) = (&sound.chunks[0], chunk(b"iCCP", b"p"));
            [&SIGNATURE[..], header, &profile, b"iCCP", &[3], b"ab"].concat()
        }),
        Vector::invalid(
            "xfirst-before-layers",
            "an unknown critical chunk between H and the first layer, after a text",
            sound.with_chunks(|chunks| {
                let text = chunk(b"tEXt", b"Title\0none");
                drop(chunks.splice(1..1, [text, chunk(b"Q", b"")]));
            }),
        ),
    ]
}

/// A file whose only layer has a padding bit that is not zero, without its last bytes if they are cut off.
fn padded(cut: Option<usize>) -> Vec<u8> {
    let entries = vec![Entry::linear(3, 1.0, 1.0); 6];
    let mut bytes = packed(&entries, &[1; 6]);
    bytes[2] |= 0x80;
    let header = Header { gaussians: 1, layers: 1, ..Header::default() };
    let layer = chunk(b"L", &bytes);
    let header = header.chunk(&quantizers(&entries));
    match cut {
        Some(missing) => [&SIGNATURE[..], &header, &layer[..layer.len() - missing]].concat(),
        None => of_chunks(&[header, layer, chunk(b"E", &[])]),
    }
}
