//! The test vectors of metadata that must be read closely (section 5.5), or that breaks a rule and is skipped (section
//! 4.3).

use super::broken::Sound;
use super::common::{GRAY, chunk};
use super::sound::{MASTERING, TURNED, random_file};
use super::{Vector, header};

/// Little-endian TIFF that says to have so many entries at this byte, and has these from byte 10 on.
fn directory(at: u8, count: u8, entries: &[[u8; 12]]) -> Vec<u8> {
    [b"II*\0", &[at, 0, 0, 0, count, 0][..], &entries.concat()].concat()
}

/// An entry with the tag of the orientation.
fn entry(kind: u8, count: u8, value: u8) -> [u8; 12] {
    [0x12, 1, kind, 0, count, 0, 0, 0, value, 0, 0, 0]
}

/// What looks like an orientation after a layer and is none.
pub(super) fn valid() -> Vec<Vector> {
    let late_exif = |name, shows, exif: &[u8]| {
        let file = random_file(84, header(GRAY, 16, 16), 6);
        let mut chunks = file.chunks();
        chunks.insert(2, chunk(b"eXIF", exif));
        Vector::valid_chunks(name, shows, file, &chunks)
    };
    let turned = entry(3, 1, 6);
    vec![
        late_exif("exif-prefixed", "Exif after a layer that begins as in JPEG: no orientation", &{
            [b"Exif\0\0", TURNED].concat()
        }),
        late_exif(
            "exif-second",
            "Exif after a layer, with two orientations: the first one, which counts, is upright",
            &directory(8, 2, &[entry(3, 1, 1), turned]),
        ),
        late_exif(
            "exif-type",
            "Exif after a layer, with an orientation of another type",
            &directory(8, 1, &[entry(4, 1, 6)]),
        ),
        late_exif(
            "exif-count",
            "Exif after a layer, with two numbers as its orientation",
            &directory(8, 1, &[entry(3, 2, 6)]),
        ),
        late_exif(
            "exif-value",
            "Exif after a layer, with the orientation 9, which is none",
            &directory(8, 1, &[entry(3, 1, 9)]),
        ),
        late_exif(
            "exif-cut",
            "Exif after a layer, whose entry lacks its last byte",
            &directory(8, 1, &[turned])[..21],
        ),
        late_exif(
            "exif-outside",
            "Exif after a layer, whose directory is not within it",
            &directory(200, 1, &[turned]),
        ),
    ]
}

pub(super) fn skipping() -> Vec<Vector> {
    let sound = Sound::new();
    let skipping = |name, shows, bytes| Vector::skipping(name, shows, sound.file.clone(), bytes);
    let inserted = |name, shows, at, kind: &[u8], payload: &[u8]| {
        skipping(name, shows, sound.inserted(at, kind, payload))
    };
    let twice = |name, shows, kind: &[u8], payload: &[u8]| {
        let chunk = chunk(kind, payload);
        let bytes = sound.with_chunks(|c| drop(c.splice(1..1, [chunk.clone(), chunk])));
        skipping(name, shows, bytes)
    };
    let late_exif = |name, shows, exif: &[u8]| inserted(name, shows, 2, b"eXIF", exif);
    vec![
        twice("skip-twice-icc", "two ICC profiles", b"iCCP", b"p"),
        twice("skip-twice-cicp", "two cICP", b"cICP", &[12, 13, 0, 1]),
        twice("skip-twice-mdcv", "two mDCV", b"mDCV", MASTERING),
        twice("skip-twice-clli", "two cLLI", b"cLLI", &[0; 8]),
        twice("skip-twice-exif", "two eXIF", b"eXIF", TURNED),
        skipping("skip-twice-xmp-late", "XMP before the layers and after them", {
            let xmp = chunk(b"xMPD", b"<x/>");
            sound.with_chunks(|chunks| {
                chunks.insert(4, xmp.clone());
                chunks.insert(1, xmp);
            })
        }),
        skipping("skip-broken-twice", "two broken cICP, a sound one and one too many", {
            let chunks = [&[12, 13, 0][..], &[12, 13, 1, 1], &[12, 13, 0, 1], &[1, 13, 0, 1]];
            let chunks = chunks.map(|payload| chunk(b"cICP", payload));
            sound.with_chunks(|all| drop(all.splice(1..1, chunks)))
        }),
        inserted("skip-icc-late", "an ICC profile after the first layer", 2, b"iCCP", b"p"),
        inserted("skip-cicp-late", "a cICP after the last layer", 4, b"cICP", &[12, 13, 0, 1]),
        inserted("skip-mdcv-late", "an mDCV after the first layer", 2, b"mDCV", MASTERING),
        inserted("skip-clli-late", "a cLLI after the first layer", 2, b"cLLI", &[0; 8]),
        inserted("skip-cicp-short", "a cICP without the full range flag", 1, b"cICP", &[12, 13, 0]),
        inserted("skip-cicp-long", "a cICP of five bytes", 1, b"cICP", &[12, 13, 0, 1, 0]),
        inserted(
            "skip-cicp-matrix",
            "a cICP with the matrix coefficients of BT.709",
            1,
            b"cICP",
            &[1, 1, 1, 1],
        ),
        inserted(
            "skip-cicp-range",
            "a cICP that says that samples are not of full range",
            1,
            b"cICP",
            &[1, 1, 0, 0],
        ),
        inserted("skip-mdcv-short", "an mDCV of 23 bytes", 1, b"mDCV", &MASTERING[1..]),
        inserted("skip-clli-long", "a cLLI of nine bytes", 1, b"cLLI", &[0; 9]),
        inserted(
            "skip-exif-last",
            "Exif that turns the picture, after the last layer",
            4,
            b"eXIF",
            TURNED,
        ),
        late_exif("skip-exif-late", "Exif that turns the picture, after the first layer", TURNED),
        late_exif("skip-exif-big-endian", "the same in the other byte order", {
            b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\xFF\xFF"
        }),
        late_exif(
            "skip-exif-entries",
            "the same, with more entries than there are and no end",
            &directory(8, 9, &[entry(3, 1, 6)]),
        ),
        late_exif("skip-exif-two", "the same, of two orientations: the first counts", &{
            directory(8, 2, &[entry(3, 1, 3), entry(3, 1, 1)])
        }),
        inserted(
            "skip-text",
            "a text without the NUL after its keyword",
            1,
            b"tEXt",
            b"Title: none",
        ),
        inserted("skip-text-keyword", "a text with a keyword of 80 bytes", 1, b"tEXt", &{
            [&[b'k'; 80][..], b"\0text"].concat()
        }),
        inserted("skip-text-utf8", "a text that is not UTF-8", 1, b"tEXt", b"Title\0\xE9"),
        inserted(
            "skip-text-surrogate",
            "a text with a surrogate, which UTF-8 does not have",
            1,
            b"tEXt",
            b"Title\0\xED\xA0\x80",
        ),
        inserted(
            "skip-text-late",
            "a text with a NUL, after the last layer",
            4,
            b"tEXt",
            b"Title\0a\0b",
        ),
    ]
}
