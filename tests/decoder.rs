//! The three decoders: the whole file, any reader, and bytes as they arrive. Slicing, prefixes, damage,
//! order of chunks, limits, requests.

mod common;

use std::io::{self, Read};

use common::{
    CHOLESKY, ENTROPY, EXPONENTIAL, Entry, File, GRAY_ALPHA, Header, QUARTIC, RGB, RGBA, Random,
    SIGNATURE, bits, cases, checked, chunk, crc32, decode, decode_pieces, decode_valid, kind,
    layered, number, of_chunks, offsets, oracle, packed, quantizers, steps, without_last_word,
};
use image_gip::{
    ChunkType, Cicp, ColorModel, ContentLight, DecodeError, Decoder, Gaussian, Kernel, LimitKind,
    Limits, MasteringDisplay, Metadata, Orientation, Quantizer, Region, RenderOptions,
    RequestError, SampleDepth, Samples, StreamDecoder,
};
use proptest::prelude::*;

/// Three layers of packed Gaussians, all kinds of metadata and an unknown ancillary chunk.
fn sample() -> File {
    let entries = vec![
        Entry::linear(7, 0.25, -2.0),
        Entry::linear(6, 0.25, 0.0),
        Entry::log(5, 0.1, -0.7),
        Entry::linear(4, 0.25, -2.0),
        Entry::log(5, 0.1, -0.7),
        Entry::linear(3, 0.125, -0.5),
        Entry::FLOAT,
        Entry::linear(1, 0.5, -0.25),
    ];
    let mut random = Random(11);
    let mut layer = |count: usize| -> Vec<u32> {
        let mut code = |entry: &Entry| match entry.kind {
            0 => random.range(-0.4, 0.4).to_bits(),
            _ => (random.next() & ((1 << entry.bits) - 1)) as u32,
        };
        (0..count).flat_map(|_| entries.iter().map(&mut code).collect::<Vec<_>>()).collect()
    };
    let layers = vec![layer(3), layer(1), layer(4)];
    let base = [78 * 257, 117 * 257, 156 * 257, 0];
    let header = Header { color: RGB, width: 24, height: 17, base, ..Header::default() };
    File::new(header, entries.clone(), layers)
        .with(b"iCCP", b"profile")
        .with(b"eXIF", b"II*\0")
        .with(b"xMPD", b"<x/>")
        .with(b"tEXt", b"Title\0A test")
        .with(b"tEXt", "Autorin\0Zoë".as_bytes())
        .with(b"prVt", &[1, 2, 3])
}

/// The letters of a type.
fn letters(chunk: ChunkType) -> String {
    chunk.to_string().split(' ').next().unwrap_or_default().into()
}

/// What a decoder has to say for itself: the error in words, and everything it holds.
fn outcome(decoder: &StreamDecoder, result: &Result<(), DecodeError>) -> String {
    format!(
        "{:?} {:?} {:?} {:?} {:?} {:?}",
        result.as_ref().map_err(ToString::to_string),
        bits(decoder.gaussians()),
        decoder.header(),
        decoder.quantizers(),
        decoder.metadata(),
        decoder.chunks(),
    )
}

fn pieces<'a>(bytes: &'a [u8], cuts: &[usize]) -> Vec<&'a [u8]> {
    let mut cuts: Vec<usize> = cuts.iter().map(|&cut| cut % (bytes.len() + 1)).collect();
    cuts.extend([0, bytes.len()]);
    cuts.sort_unstable();
    cuts.windows(2).map(|pair| &bytes[pair[0]..pair[1]]).collect()
}

proptest! {
    #![proptest_config(cases(256))]
    #[test]
    fn slicing_changes_nothing(
        cuts in prop::collection::vec(any::<usize>(), 0..20),
        damage in prop::option::of((any::<usize>(), 1_u8..)),
        length in any::<usize>(),
    ) {
        let mut bytes = sample().bytes();
        if let Some((at, change)) = damage {
            let at = at % bytes.len();
            bytes[at] ^= change;
            bytes.truncate(length % (2 * bytes.len()));
        }
        let (decoder, result) = decode(&bytes);
        let (sliced, sliced_result) = decode_pieces(pieces(&bytes, &cuts), Limits::default());
        prop_assert_eq!(outcome(&sliced, &sliced_result), outcome(&decoder, &result));
    }

    #[test]
    fn headers_round_trip(
        color in 0_u8..4,
        sixteen in any::<bool>(),
        size in (1_u32..=1 << 16, 1_u32..=4096),
        kernel in prop_oneof![Just((QUARTIC, 4.0)), (Just(EXPONENTIAL), 1e-30_f32..=64.0)],
        parameterization in 0_u8..3,
        base in any::<[u16; 4]>(),
    ) {
        let depth = if sixteen { 16 } else { 8 };
        let mut base = if sixteen { base } else { base.map(|base| base / 257 * 257) };
        base[usize::from(color) + 1..].fill(0);
        let (kernel, cutoff) = kernel;
        let (width, height) = size;
        let header =
            Header { color, depth, width, height, kernel, form: parameterization, cutoff, base, ..Header::default() };
        let decoder = decode_valid(&File::of_floats(header, &[]).bytes());
        let found = decoder.header().expect("a complete file");
        prop_assert_eq!((found.version, found.width, found.height), (1, width, height));
        prop_assert_eq!(found.color.channels(), header.channels());
        prop_assert_eq!(found.depth.bits(), depth);
        prop_assert_eq!((found.gaussians, found.layers), (0, 0));
        prop_assert_eq!(found.kernel.cutoff(), cutoff);
        prop_assert_eq!(matches!(found.kernel, Kernel::Quartic), kernel == QUARTIC);
        prop_assert_eq!(found.parameterization as u8, parameterization);
        prop_assert_eq!(found.base_color, base);
    }

    #[test]
    fn any_quantizers_give_the_values_of_the_specification(
        kinds in prop::collection::vec((0_u8..3, 1_u8..=16, 1e-3_f32..8.0, -9.0_f32..9.0), 9),
        seed in any::<u64>(),
    ) {
        let entry = |&(kind, bits, scale, offset): &(u8, u8, f32, f32)| match kind {
            0 => Entry::FLOAT,
            1 => Entry::linear(bits, scale, offset),
            _ => Entry::log(bits, scale / 1e4, offset),
        };
        let entries: Vec<Entry> = kinds.iter().map(entry).collect();
        let mut random = Random(seed);
        let code = |index: usize| match entries[index % 9] {
            Entry { kind: 0, .. } => random.range(-100.0, 100.0).to_bits(),
            Entry { bits, .. } => (random.next() & ((1 << bits) - 1)) as u32,
        };
        let codes: Vec<u32> = (0..9 * 7).map(code).collect();
        let header = Header { color: RGBA, ..Header::default() };
        let file = File::new(header, entries.clone(), vec![codes.clone()]);
        let decoder = decode_valid(&file.bytes());
        let expected: Vec<Gaussian> = codes
            .chunks(9)
            .map(|codes| {
                let values: Vec<f32> =
                    entries.iter().zip(codes).map(|(e, &code)| oracle::value(e, code)).collect();
                Gaussian {
                    center: [values[0], values[1]],
                    cholesky: oracle::cholesky(CHOLESKY, [values[2], values[3], values[4]]),
                    color: [values[5], values[6], values[7], values[8]],
                }
            })
            .collect();
        prop_assert_eq!(bits(decoder.gaussians()), bits(&expected));
        for (found, entry) in decoder.quantizers().iter().zip(&entries) {
            prop_assert_eq!(found.bits(), entry.bits);
            match found {
                Quantizer::Float => prop_assert_eq!(entry.kind, 0),
                Quantizer::Linear(steps) => {
                    prop_assert_eq!((1, steps.scale, steps.offset), (entry.kind, entry.scale, entry.offset));
                }
                Quantizer::Log(steps) => {
                    prop_assert_eq!((2, steps.scale, steps.offset), (entry.kind, entry.scale, entry.offset));
                }
                _ => prop_assert!(false, "a kind that version 1 does not have"),
            }
        }
    }
}

#[test]
fn one_byte_at_a_time_is_as_good_as_all_at_once() {
    let bytes = sample().bytes();
    let (decoder, result) = decode(&bytes);
    let (sliced, sliced_result) = decode_pieces(bytes.chunks(1), Limits::default());
    assert!(result.is_ok());
    assert_eq!(outcome(&sliced, &sliced_result), outcome(&decoder, &result));
}

#[test]
fn every_truncation_is_an_unexpected_end_and_shows_the_prefix() {
    let file = sample();
    let bytes = file.bytes();
    let all = decode_valid(&bytes);
    let chunks = file.chunks();
    for length in 0..bytes.len() {
        let (decoder, result) = decode(&bytes[..length]);
        let error = result.expect_err("a part of a file");
        assert!(error.is_unexpected_end(), "{length} bytes: {error}");
        // A chunk is named when its type is complete.
        let mut starts = chunks.iter().zip(offsets(&chunks)).rev();
        let current = starts.find(|(chunk, start)| length >= start + kind(chunk).len());
        let in_chunk = current.filter(|(chunk, start)| length < start + chunk.len());
        let named = match error {
            DecodeError::UnexpectedEnd { chunk } => chunk.map(letters),
            _ => None,
        };
        let expected = in_chunk.map(|(chunk, _)| String::from_utf8_lossy(kind(chunk)).into_owned());
        assert_eq!(named, expected, "{length} bytes");
        let gaussians = decoder.gaussians();
        assert_eq!(bits(gaussians), bits(&all.gaussians()[..gaussians.len()]));
        let Some(picture) = decoder.picture() else {
            assert!(length < offsets(&chunks)[1], "the header has arrived");
            continue;
        };
        let mut found = vec![0.0; 24 * 17 * 3];
        picture.render_planes(&RenderOptions::new(), &mut found).expect("a sound request");
        let request = oracle::Request { prefix: gaussians.len(), ..oracle::Request::whole(&file) };
        assert_eq!(found, oracle::render(&file, &request).concat(), "{length} bytes");
    }
    // All but CRC and end: every Gaussian is there.
    let (decoder, _) = decode(&bytes[..bytes.len() - 10]);
    assert_eq!(decoder.gaussians().len(), 8);
}

#[test]
fn a_flipped_bit_never_panics_and_is_always_noticed() {
    let bytes = sample().bytes();
    for at in 0..bytes.len() {
        for change in [1, 0x20, 0x80, 0xFF] {
            let mut damaged = bytes.clone();
            damaged[at] ^= change;
            let (decoder, result) = decode(&damaged);
            let error = result.expect_err("CRCs and signature cover every byte");
            assert!(!error.to_string().is_empty());
            if let Some(picture) = decoder.picture() {
                let mut out = vec![0; 24 * 17 * 3];
                picture.render_u8(&RenderOptions::new(), &mut out).expect("a sound request");
            }
        }
    }
}

#[test]
fn a_damaged_layer_keeps_the_layers_before_it() {
    let file = sample();
    let chunks = file.chunks();
    let all = decode_valid(&file.bytes());
    let first_layer = chunks.len() - 4;
    for (layer, kept) in [(0, 0), (1, 3), (2, 4)] {
        let mut damaged = chunks.clone();
        let chunk = &mut damaged[first_layer + layer];
        let crc = chunk.len() - 1;
        chunk[crc] ^= 1;
        let (mut decoder, result) = decode(&of_chunks(&damaged));
        match result.expect_err("a wrong CRC") {
            DecodeError::Malformed { chunk, reason } => {
                assert_eq!(chunk, ChunkType::LAYER);
                assert!(reason.to_string().contains("CRC"), "{reason}");
            }
            error => panic!("{error}"),
        }
        assert_eq!(bits(decoder.gaussians()), bits(&all.gaussians()[..kept]));
        assert!(matches!(decoder.feed(&[0]), Err(DecodeError::AlreadyFailed)));
        assert!(matches!(decoder.finish(), Err(DecodeError::AlreadyFailed)));
        assert!(decoder.picture().is_some());
    }
}

#[test]
fn bytes_after_the_end_are_not_used() {
    let bytes = sample().bytes();
    let mut longer = bytes.clone();
    longer.extend(b"something else");
    let mut decoder = StreamDecoder::new();
    assert_eq!(decoder.feed(&longer).expect("a valid file"), bytes.len());
    assert!(decoder.is_complete());
    assert_eq!(decoder.feed(b"more").expect("ignored"), 0);
    decoder.finish().expect("a complete file");
}

#[test]
fn metadata_arrives_as_it_was_stored() {
    let decoder = decode_valid(&sample().bytes());
    let metadata = decoder.metadata();
    assert_eq!(metadata.icc_profile.as_deref(), Some(&b"profile"[..]));
    assert_eq!(metadata.exif.as_deref(), Some(&b"II*\0"[..]));
    assert_eq!(metadata.xmp.as_deref(), Some(&b"<x/>"[..]));
    let texts: Vec<_> =
        metadata.texts.iter().map(|t| (t.keyword.as_str(), t.text.as_str())).collect();
    assert_eq!(texts, [("Title", "A test"), ("Autorin", "Zoë")]);
    let text = decoder.chunks().iter().find(|c| c.kind == ChunkType::TEXT).expect("two of them");
    assert_eq!((text.count, text.bytes), (2, 2 * (4 + 1 + 12 + 4)));
    let bytes: u64 = decoder.chunks().iter().map(|chunk| chunk.bytes).sum();
    assert_eq!(bytes + 8, sample().bytes().len() as u64);
}

/// Exif data with one entry, the orientation "rotate by 90 degrees".
const ROTATE_90: &[u8] = b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";

/// How many bytes tell the orientation, and what they tell; `None` if all of them do not.
fn told(bytes: &[u8]) -> Option<(usize, Orientation)> {
    let mut decoder = StreamDecoder::new();
    (1..=bytes.len()).zip(bytes).find_map(|(count, &byte)| {
        decoder.feed(&[byte]).expect("a valid file");
        decoder.orientation().map(|orientation| (count, orientation))
    })
}

#[test]
fn the_orientation_is_told_as_soon_as_it_is_known() {
    let turned = File { extra: Vec::new(), ..sample() }.with(b"tEXt", b"Title\0A test");
    let first_layer = |file: &File| {
        let chunks = file.chunks();
        let at = chunks.iter().position(|chunk| kind(chunk) == b"L").expect("layers");
        offsets(&chunks)[at]
    };
    let plain = first_layer(&turned);
    // With the letter that says that a layer begins.
    assert_eq!(told(&turned.bytes()), Some((plain + 1, Orientation::NoTransforms)));
    let turned = turned.with(b"eXIF", ROTATE_90);
    assert_eq!(decode_valid(&turned.bytes()).metadata().orientation(), Orientation::Rotate90);
    // With the end of the Exif data.
    assert_eq!(told(&turned.bytes()), Some((first_layer(&turned), Orientation::Rotate90)));

    let empty = File::new(Header::default(), vec![Entry::FLOAT; 6], vec![]).bytes();
    assert_eq!(told(&empty), Some((empty.len(), Orientation::NoTransforms)));
}

#[test]
fn colours_arrive_as_they_were_stored() {
    let file = include_bytes!("../spec/vectors/cicp.gip");
    let decoder = decode_valid(file);
    let metadata = decoder.metadata();
    assert_eq!(metadata.cicp, Some(Cicp::BT2100_PQ));
    let display = MasteringDisplay {
        red: [35_400, 14_600],
        green: [8_500, 39_850],
        blue: [6_550, 2_300],
        white: [15_635, 16_450],
        max_luminance: 10_000_000,
        min_luminance: 50,
    };
    assert_eq!(metadata.mastering_display, Some(display));
    let light = ContentLight { max_content: 10_000_000, max_frame_average: 2_500_000 };
    assert_eq!(metadata.content_light, Some(light));

    let decoder = decode_valid(include_bytes!("../spec/vectors/cicp-unknown.gip"));
    assert_eq!(decoder.metadata().cicp, Some(Cicp::new(255, 0)));
    assert!(decoder.metadata().icc_profile.is_some());
}

#[test]
fn metadata_may_stand_between_and_after_the_layers() {
    let file = sample();
    let all = decode_valid(&file.bytes());
    let (profile, others) = file.extra.split_first().expect("an ICC profile at the beginning");
    let bare = File { extra: vec![profile.clone()], ..file.clone() }.chunks();
    let others: Vec<Vec<u8>> = others.iter().map(|(kind, payload)| chunk(kind, payload)).collect();
    // Header, profile, three layers, end: behind each of them but the header and the end.
    for at in 2..6 {
        let mut chunks = bare.clone();
        drop(chunks.splice(at..at, others.clone()));
        let bytes = of_chunks(&chunks);
        for decoder in [decode_valid(&bytes), decode_pieces(bytes.chunks(1), Limits::default()).0] {
            assert!(decoder.is_complete(), "{at}");
            assert_eq!(decoder.metadata(), all.metadata(), "{at}");
            assert_eq!(bits(decoder.gaussians()), bits(all.gaussians()), "{at}");
            assert_eq!(decoder.orientation(), Some(Orientation::NoTransforms), "{at}");
        }
        // The decoder of a reader, and the short way.
        let mut decoder = Decoder::new(&bytes[..]).expect("it begins well");
        decoder.read_to_end().expect("it is sound");
        assert_eq!(decoder.metadata(), all.metadata(), "{at}");
        assert_eq!(image_gip::decode(&bytes).expect("it is sound").metadata, *all.metadata());
    }
    // One here, one there.
    let mut chunks = bare.clone();
    for (at, other) in [(2, 2), (4, 3), (6, 1), (7, 0)] {
        chunks.insert(at, others[other].clone());
    }
    assert_eq!(decode_valid(&of_chunks(&chunks)).metadata(), all.metadata());
}

#[test]
fn a_chunk_of_metadata_that_breaks_a_rule_is_skipped_wherever_it_stands() {
    let file = sample();
    let (chunks, sound) = (file.chunks(), decode_valid(&file.bytes()));
    let long = [&[b'x'; 80][..], &[0]].concat();
    for (kind, payload, expected) in [
        (b"iCCP", &b"again"[..], "iCCP is skipped: appears twice"),
        (b"xMPD", b"again", "xMPD is skipped: appears twice"),
        (b"tEXt", b"not even text", "tEXt is skipped: no NUL after the keyword"),
        (b"tEXt", &long[..80], "tEXt is skipped: no NUL after the keyword"),
        (b"tEXt", &long, "tEXt is skipped: the keyword is not 1 to 79 bytes long"),
        (b"tEXt", b"\0x", "tEXt is skipped: the keyword is not 1 to 79 bytes long"),
        (b"tEXt", b"x\0\xFF", "tEXt is skipped: is not UTF-8"),
        (b"tEXt", b"x\0y\0", "tEXt is skipped: a NUL in the text"),
        (b"cLLI", b"short", "cLLI is skipped: "),
    ] {
        for behind in 1..=4 {
            let mut chunks = chunks.clone();
            chunks.insert(chunks.len() - behind, chunk(kind, payload));
            let decoder = decode_valid(&of_chunks(&chunks));
            let [skipped] = decoder.skipped() else { panic!("{:?}", decoder.skipped()) };
            assert!(skipped.to_string().contains(expected), "{skipped}");
            assert_eq!(decoder.metadata(), sound.metadata());
            assert_eq!(bits(decoder.gaussians()), bits(sound.gaussians()));
        }
    }
    // However many there are, a few are listed.
    let mut many = chunks.clone();
    let broken = chunk(b"tEXt", b"");
    many.splice(1..1, (0..1000).map(|_| broken.clone()));
    assert_eq!(decode_valid(&of_chunks(&many)).skipped().len(), 16);
}

#[test]
fn colors_are_said_before_the_first_layer() {
    let bare = File { extra: Vec::new(), ..sample() }.chunks();
    let (codes, display, light) = ([12, 13, 0, 1], [1; 24], [2; 8]);
    for (kind, payload) in
        [(b"iCCP", &b"profile"[..]), (b"cICP", &codes), (b"mDCV", &display), (b"cLLI", &light)]
    {
        for at in 1..5 {
            let mut chunks = bare.clone();
            chunks.insert(at, chunk(kind, payload));
            let decoder = decode_valid(&of_chunks(&chunks));
            let is_known = decoder.metadata() != &Metadata::default();
            assert_eq!(is_known, at == 1);
            assert_eq!(decoder.skipped().is_empty(), at == 1);
        }
    }
}

#[test]
fn exif_may_not_turn_a_picture_that_has_been_shown() {
    let bare = File { extra: Vec::new(), ..sample() }.chunks();
    let upright = [&ROTATE_90[..19], &[1], &ROTATE_90[20..]].concat();
    assert_eq!(ROTATE_90[19], 6);
    for at in 1..5 {
        let with = |exif: &[u8]| {
            let mut chunks = bare.clone();
            chunks.insert(at, chunk(b"eXIF", exif));
            of_chunks(&chunks)
        };
        for exif in [&upright[..], b"", b"II*\0", b"no Exif"] {
            let decoder = decode_valid(&with(exif));
            assert_eq!(decoder.metadata().exif.as_deref(), Some(exif));
            assert_eq!(decoder.orientation(), Some(Orientation::NoTransforms));
        }
        let bytes = with(ROTATE_90);
        let decoder = decode_valid(&bytes);
        if at == 1 {
            // Nothing has been shown.
            assert_eq!(decoder.orientation(), Some(Orientation::Rotate90));
            assert_eq!(decoder.skipped(), []);
            continue;
        }
        let [skipped] = decoder.skipped() else { panic!("{:?}", decoder.skipped()) };
        let message = "chunk eXIF is skipped: stands after the first layer";
        assert_eq!(skipped.to_string(), message);
        // The picture stays as it was shown.
        assert_eq!(decoder.orientation(), Some(Orientation::NoTransforms));
        assert_eq!(decoder.metadata().exif, None);
        let mut decoder = Decoder::new(&bytes[..]).expect("it begins well");
        decoder.read_to_end().expect("the same");
        assert_eq!(decoder.stream().skipped().len(), 1);
        assert_eq!(decoder.metadata().orientation(), Orientation::NoTransforms);
    }
}

/// A reader that gives one byte at a time, interrupts every other call, and fails at the end of
/// its bytes if told to.
struct Awkward<'a> {
    bytes: &'a [u8],
    calls: usize,
    fails: bool,
}

impl Read for Awkward<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.calls += 1;
        if self.calls.is_multiple_of(2) {
            return Err(io::ErrorKind::Interrupted.into());
        }
        match self.bytes.split_first() {
            Some((&byte, rest)) => {
                self.bytes = rest;
                buffer[0] = byte;
                Ok(1)
            }
            None if self.fails => Err(io::Error::other("the line was cut")),
            None => Ok(0),
        }
    }
}

#[test]
fn awkward_readers_make_no_difference() {
    let file = sample();
    let bytes = file.bytes();
    let mut expected = vec![0; 24 * 17 * 3];
    Decoder::new(bytes.as_slice())
        .and_then(|mut decoder| decoder.decode_into(&mut expected))
        .expect("a valid file");
    let samples = oracle::samples(&oracle::render(&file, &oracle::Request::whole(&file)), 8);
    assert!(expected.iter().map(|&sample| u16::from(sample)).eq(samples));

    let awkward = |bytes, fails| Awkward { bytes, calls: 0, fails };
    let mut decoder = Decoder::new(awkward(&bytes, true)).expect("a valid header");
    assert!(decoder.stream().gaussians().is_empty(), "nothing is read before it is needed");
    assert_eq!(decoder.metadata().texts.len(), 2);
    let mut found = vec![0; decoder.output_len().expect("fits")];
    decoder.decode_into(&mut found).expect("the file ends before the failure");
    assert_eq!(found, expected);

    let mut sixteen = vec![0; found.len()];
    decoder.decode_into_u16(&mut sixteen).expect("once more");
    let whole = oracle::render(&file, &oracle::Request::whole(&file));
    assert_eq!(sixteen, oracle::samples(&whole, 16));

    // A failing reader is an error of its own, after which the picture so far is there: two layers, and
    // of the third, which lacks 14 of its 32 bytes, two Gaussians of 63 bits.
    let cut = &bytes[..bytes.len() - (6 + 4 + 14)];
    let mut decoder = Decoder::new(awkward(cut, true)).expect("a valid header");
    let error = decoder.read_to_end().expect_err("the reader fails");
    assert!(matches!(&error, DecodeError::Io(io) if io.to_string().contains("cut")), "{error}");
    assert_eq!(decoder.picture().expect("every layer is sound").gaussians().len(), 3 + 1 + 2);
    // So is a file that ends early.
    let mut decoder = Decoder::new(awkward(cut, false)).expect("a valid header");
    let error = decoder.read_to_end().expect_err("the file is too short");
    assert!(error.is_unexpected_end(), "{error}");
    assert_eq!(decoder.picture().expect("every layer is sound").gaussians().len(), 3 + 1 + 2);
    // A file that ends before its first layer has no picture to open.
    let first_layer = offsets(&file.chunks())[1 + file.extra.len()];
    let error = Decoder::new(&bytes[..first_layer]).expect_err("the file is too short");
    assert!(error.is_unexpected_end(), "{error}");
}

#[test]
fn layers_are_read_until_there_are_enough_gaussians() {
    let file = sample();
    let bytes = file.bytes();
    let whole = decode_valid(&bytes);
    // Three, one and four, a few bytes at a time.
    for (wanted, arrived) in [(0, 0), (1, 1), (3, 3), (4, 4), (5, 5), (8, 8), (9, 8)] {
        let mut decoder = Decoder::new(Awkward { bytes: &bytes, calls: 0, fails: false })
            .expect("it begins well");
        decoder.read_at_least(wanted).expect("it is sound");
        let found = bits(decoder.picture().expect("every layer is sound").gaussians());
        assert_eq!(found, bits(&whole.gaussians()[..arrived]), "{wanted}");
    }
    let header = whole.header().expect("read");
    let sizes = [(1, 1), (8, 2), (8, 4), (1 << 20, 1 << 20)];
    assert_eq!(sizes.map(|(width, height)| header.gaussians_for(width, height)), [1, 1, 8, 8]);
}

#[test]
fn layers_are_counted_as_they_arrive() {
    let packed = sample().bytes();
    assert_eq!(decode_valid(&packed).layers(), [3, 1, 4]);
    let coded = of_chunks(&layered::chunks());
    assert_eq!(decode_valid(&coded).layers(), [layered::IN_A_LAYER as u32; layered::LAYERS]);
    for bytes in [packed, coded] {
        let mut decoder = StreamDecoder::new();
        for byte in bytes.chunks(1) {
            let before = decoder.layers().len();
            decoder.feed(byte).expect("it is sound");
            let layers = decoder.layers();
            // Gaussians of an incomplete layer of the packed coding are there already.
            let counted = layers.iter().sum::<u32>() as usize;
            assert!(layers.len() <= before + 1 && counted <= decoder.gaussians().len());
        }
        assert_eq!(decoder.layers().iter().sum::<u32>() as usize, decoder.gaussians().len());
    }
}

/// A file of two entropy-coded layers that both are damaged: the first lacks its last word, the second
/// has a wrong CRC.
fn damaged_twice() -> Vec<u8> {
    let mut chunks = layered::chunks();
    let first = &mut chunks[layered::BEFORE];
    *first = without_last_word(first);
    *chunks[layered::BEFORE + 1].last_mut().expect("a CRC") ^= 1;
    of_chunks(&chunks)
}

/// Files of both codings, with metadata and without, with bounds, without Gaussians.
fn files() -> Vec<(&'static str, Vec<u8>)> {
    let header = Header { depth: 16, base: [9, 0, 0, 0], ..Header::default() };
    let mut described = layered::chunks();
    described.insert(1, chunk(b"iCCP", &[7; 20_000]));
    described.insert(layered::BEFORE + 2, chunk(b"tEXt", b"Title\0Layers"));
    described.insert(described.len() - 1, chunk(b"prVt", &[8; 100]));
    described.insert(described.len() - 1, chunk(b"xMPD", &[7; 300]));
    vec![
        ("packed", sample().bytes()),
        ("empty", File::of_floats(header, &[]).bytes()),
        ("floats", File::of_floats(header, &[vec![5.0, 6.0, 3.0, 1.0, 2.0, 0.7]]).bytes()),
        ("entropy-coded", of_chunks(&layered::chunks())),
        ("entropy-coded, with metadata", of_chunks(&described)),
    ]
}

#[test]
fn one_call_gives_the_picture_at_its_own_depth() {
    for (name, bytes) in files() {
        let stream = decode_valid(&bytes);
        let (picture, options) = (stream.picture().expect("whole"), RenderOptions::new());
        let found = image_gip::decode(&bytes).expect(name);
        assert_eq!(Some(&found.header), stream.header(), "{name}");
        assert_eq!(&found.metadata, stream.metadata(), "{name}");
        let length = picture.output_len(&options).expect("it fits");
        let expected = if picture.header().depth == SampleDepth::Eight {
            let mut samples = vec![0; length];
            picture.render_u8(&options, &mut samples).expect("within limits");
            Samples::Eight(samples)
        } else {
            let mut samples = vec![0; length];
            picture.render_u16(&options, &mut samples).expect("within limits");
            Samples::Sixteen(samples)
        };
        assert_eq!(found.samples, expected, "{name}");
        // What comes behind the file is not a part of it.
        let longer = [&bytes[..], b"something else"].concat();
        assert_eq!(image_gip::decode(&longer).expect(name), found);
    }
}

#[test]
fn one_call_refuses_what_is_not_a_whole_sound_file() {
    for (name, bytes) in files() {
        let cuts =
            (0..80).chain([bytes.len() / 2]).chain(bytes.len().saturating_sub(40)..bytes.len());
        for length in cuts.filter(|&length| length < bytes.len()) {
            let error = image_gip::decode(&bytes[..length]).expect_err("a part of a file");
            assert!(error.is_unexpected_end(), "{name}, {length} bytes: {error}");
        }
    }
    let bytes = damaged_twice();
    let expected = decode(&bytes).1.expect_err("damaged").to_string();
    assert!(expected.contains("L (layer)") && !expected.contains("CRC"), "{expected}");
    assert_eq!(image_gip::decode(&bytes).expect_err("damaged").to_string(), expected);
    // That the file ends early comes behind it, too.
    let short = layered::damaged(&[0]);
    let error = image_gip::decode(&short[..short.len() - 5]).expect_err("damaged");
    assert_eq!(error.to_string(), expected);
    let large = Header { width: 1 << 17, ..Header::default() };
    let error = image_gip::decode(&File::of_floats(large, &[]).bytes()).expect_err("too wide");
    assert!(matches!(error, DecodeError::Limit { kind: LimitKind::Width, .. }), "{error}");
}

/// A reader that gives as much as is asked for, or up to so many bytes, and counts them.
struct Counting<'a> {
    bytes: &'a [u8],
    most: usize,
    given: usize,
}

impl Read for Counting<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let length = buffer.len().min(self.most).min(self.bytes.len() - self.given);
        buffer[..length].copy_from_slice(&self.bytes[self.given..][..length]);
        self.given += length;
        Ok(length)
    }
}

#[test]
fn the_reader_stands_right_behind_the_file() {
    for (name, bytes) in files() {
        // The same file once more, which a reader finds only if it begins where the first ends.
        let twice = [&bytes[..], &bytes, b"end"].concat();
        for most in [1, 7, usize::MAX] {
            let reader = Counting { bytes: &twice, most, given: 0 };
            let mut first = Decoder::new(reader).expect(name);
            let mut samples = vec![0; first.output_len().expect("it fits")];
            first.decode_into(&mut samples).expect(name);
            let reader = first.into_reader();
            assert_eq!(reader.given, bytes.len(), "{name}, {most} at a time");

            let mut second = Decoder::new(reader).expect(name);
            second.read_to_end().expect(name);
            // Neither of these has anything left to read.
            second.read_to_end().expect(name);
            let mut again = vec![1; samples.len()];
            second.decode_into(&mut again).expect(name);
            assert_eq!(again, samples, "{name}, {most} at a time");
            let mut reader = second.into_reader();
            assert_eq!(reader.given, 2 * bytes.len(), "{name}, {most} at a time");
            let mut rest = Vec::new();
            reader.read_to_end(&mut rest).expect("it is in memory");
            assert_eq!(rest, b"end");
        }
    }
    // So it does where a region leaves out layers.
    let bytes = [&of_chunks(&layered::chunks())[..], b"end"].concat();
    let mut decoder = Decoder::new(Counting { bytes: &bytes, most: usize::MAX, given: 0 })
        .expect("it begins well");
    let region = Region { x: 0, y: 0, width: 9, height: 9 };
    decoder.set_options(RenderOptions::new().with_region(region));
    decoder.decode_into(&mut [0; 9 * 9 * 3]).expect("it is sound");
    assert_eq!(decoder.into_reader().given, bytes.len() - 3);
}

#[test]
fn planes_from_a_reader_are_those_of_the_picture() {
    let region = Region { x: 10, y: 5, width: 12, height: 9 };
    let views = [
        RenderOptions::new(),
        RenderOptions::new().with_size(31, 20),
        RenderOptions::new().with_region(region),
        RenderOptions::new().with_size(900, 600).with_region(region).with_color(ColorModel::Rgba),
        RenderOptions::new().with_prefix(2).with_color(ColorModel::Rgba),
    ];
    for bytes in [sample().bytes(), of_chunks(&layered::chunks())] {
        let stream = decode_valid(&bytes);
        let picture = stream.picture().expect("whole");
        for options in &views {
            let mut expected = vec![0.0; picture.output_len(options).expect("it fits")];
            picture.render_planes(options, &mut expected).expect("within limits");
            let mut decoder = Decoder::new(&bytes[..]).expect("it begins well");
            decoder.set_options(options.clone());
            let mut found = vec![f32::NAN; decoder.output_len().expect("it fits")];
            decoder.decode_into_planes(&mut found).expect("it is sound");
            assert!(found.iter().map(|v| v.to_bits()).eq(expected.iter().map(|v| v.to_bits())));
        }
    }
}

#[test]
fn the_length_of_the_output_is_checked_against_picture_and_limits() {
    let bytes = sample().bytes();
    let mut limits = Limits::default();
    (limits.max_width, limits.max_height, limits.max_pixels) = (100, 90, 5000);
    let mut decoder = Decoder::new_with_limits(&bytes[..], limits).expect("it begins well");
    let mut length = |options: RenderOptions| {
        decoder.set_options(options);
        decoder.output_len()
    };
    let sized = |width, height| RenderOptions::new().with_size(width, height);
    let part = |x, y, width, height| Region { x, y, width, height };
    assert_eq!(length(RenderOptions::new()).expect("24 x 17 x 3"), 1224);
    assert_eq!(length(sized(100, 50)).expect("just enough"), 15_000);
    assert_eq!(length(sized(10, 10).with_color(ColorModel::Rgba)).expect("it fits"), 400);
    // Where only a region is written, its size counts.
    let close_up = sized(1 << 20, 1 << 20).with_region(part(9, 9, 7, 2));
    assert_eq!(length(close_up).expect("it fits"), 42);
    for (options, expected) in [
        (sized(101, 1), (LimitKind::Width, 101, 100)),
        (sized(1, 91), (LimitKind::Height, 91, 90)),
        (sized(72, 70), (LimitKind::Pixels, 5040, 5000)),
    ] {
        match length(options).expect_err("too large") {
            DecodeError::Limit { kind, wanted, allowed } => {
                assert_eq!((kind, wanted, allowed), expected);
            }
            error => panic!("{error}"),
        }
    }
    let (region, width, height) = (part(20, 0, 5, 1), 24, 17);
    for (options, expected) in [
        (sized(0, 9), RequestError::OutputSize { width: 0, height: 9 }),
        (RenderOptions::new().with_region(region), RequestError::Region { region, width, height }),
        (
            RenderOptions::new().with_color(ColorModel::Gray),
            RequestError::ColorModel { from: ColorModel::Rgb, to: ColorModel::Gray },
        ),
    ] {
        match length(options).expect_err("not of this picture") {
            DecodeError::Request(error) => assert_eq!(error, expected),
            error => panic!("{error}"),
        }
    }

    // What is allocated by it fits, and nothing else does.
    decoder.set_options(RenderOptions::new());
    match decoder.decode_into(&mut [0; 1225]).expect_err("one too many") {
        DecodeError::Request(error) => {
            assert_eq!(error, RequestError::BufferLength { found: 1225, wanted: 1224 });
        }
        error => panic!("{error}"),
    }
    decoder.decode_into(&mut [0; 1224]).expect("a wrong length can be mended");
}

#[test]
fn limits_hold_from_the_start_or_from_where_they_are_set() {
    let bytes = sample().bytes();
    let narrow = |width| {
        let mut limits = Limits::default();
        limits.max_width = width;
        limits
    };
    let is_width = |result: Result<(), DecodeError>| {
        let error = result.expect_err("24 pixels are too wide");
        let DecodeError::Limit { kind: LimitKind::Width, wanted, allowed } = error else {
            panic!("{error}");
        };
        assert_eq!((wanted, allowed), (24, 23));
    };
    let mut decoder = StreamDecoder::new().with_limits(narrow(23));
    is_width(decoder.feed(&bytes).map(|_| ()));
    assert!(decoder.header().is_none());
    let mut decoder = StreamDecoder::new().with_limits(narrow(24));
    decoder.feed(&bytes).expect("just wide enough");

    // Set later, they refuse what has been declared already, and hold from there on.
    is_width(decoder.set_limits(narrow(23)));
    let picture = decoder.picture().expect("it stays");
    is_width(picture.output_len(&RenderOptions::new()).map(|_| ()));
    is_width(picture.render_u8(&RenderOptions::new(), &mut [0; 1224]));
    decoder.set_limits(narrow(24)).expect("just wide enough");
    let picture = decoder.picture().expect("it stays");
    picture.render_u8(&RenderOptions::new(), &mut [0; 1224]).expect("just wide enough");

    is_width(Decoder::new_with_limits(&bytes[..], narrow(23)).map(|_| ()));
    let mut decoder = Decoder::new(&bytes[..]).expect("it begins well");
    is_width(decoder.set_limits(narrow(23)));
    is_width(decoder.decode_into(&mut [0; 1224]));
}

/// What the header says of steps, and whether it may.
fn with_steps(steps: &[u8], form: u8) -> Result<Vec<f32>, String> {
    let header =
        Header { coding: ENTROPY, color: RGB, form, gaussians: 1, layers: 1, ..Header::default() };
    let mut decoder = StreamDecoder::new();
    let header = of_chunks(&[chunk(b"H", &[&header.fields(), steps].concat())]);
    decoder.feed(&header).map_err(|error| error.to_string())?;
    let steps = decoder.quantization_steps().expect("the header has arrived");
    let geometry = [steps.position, steps.size, steps.ratio, steps.slant];
    Ok([&geometry[..], &steps.color].concat())
}

#[test]
fn steps_have_the_values_of_their_codes() {
    let usual = steps::usual_geometry();
    let of_axes = |first: u16, ratios: [u8; 2]| [&first.to_le_bytes()[..], &ratios].concat();
    for (first, [second, third], expected) in [
        (0xA000, [128, 128], [1.0, 1.0, 1.0]),
        (0xA000, [0, 255], [1.0, 1.0 / 256.0, 248.0]),
        (0x9800, [136, 112], [0.5, 0.75, 0.25]),
        // 2^-20 and 2^10, the bounds.
        (0, [128, 255], [2_f32.powi(-20), 2_f32.powi(-20), 248.0 * 2_f32.powi(-20)]),
        (0xF000, [128, 0], [1024.0, 1024.0, 4.0]),
        (
            0x0801,
            [112, 255],
            [
                (1.0 + 1.0 / 2048.0) * 2_f32.powi(-19),
                (1.0 + 1.0 / 2048.0) * 2_f32.powi(-20),
                (1.0 + 1.0 / 2048.0) * 2_f32.powi(-19) * 248.0,
            ],
        ),
    ] {
        let found = with_steps(&of_axes(first, [second, third]), 0).expect("it is sound");
        assert_eq!(found, [&usual[..], &expected].concat());
    }
    // Those of geometry, if the format says so.
    let geometry = [0, 0xF000, 0xA000, 0x9C00].map(u16::to_le_bytes).concat();
    let steps = [of_axes(0xA000, [128; 2]), geometry].concat();
    let expected = [2_f32.powi(-20), 1024.0, 1.0, 0.75, 1.0, 1.0, 1.0];
    assert_eq!(with_steps(&steps, 1).expect("it is sound"), expected);
    assert!(with_steps(&steps, 0).expect_err("they are too many").contains("longer than"));
    assert!(with_steps(&steps[..11], 1).expect_err("too few").contains("shorter than"));
    assert!(with_steps(&steps[..4], 1).expect_err("too few").contains("shorter than"));

    for first in [0xF001, u16::MAX] {
        let error = with_steps(&of_axes(first, [128; 2]), 0).expect_err("it is too large");
        assert!(error.contains("H (header): unsupported: step 6"), "{error}");
        for at in 0..4 {
            let mut steps = steps.clone();
            steps[4 + 2 * at..][..2].copy_from_slice(&first.to_le_bytes());
            let error = with_steps(&steps, 1).expect_err("it is too large");
            assert!(error.contains("H (header): unsupported: step 6"), "{error}");
        }
    }
    // One that is told by its ratio.
    for (first, ratio) in [(0, 127), (0xF000, 129), (1, 127), (0xEFFF, 129), (0x0800, 111)] {
        for ratios in [[ratio, 128], [128, ratio]] {
            let error = with_steps(&of_axes(first, ratios), 0).expect_err("it is out of range");
            assert!(error.contains("H (header): a step that is not within"), "{error}");
        }
    }
}

#[test]
fn every_layer_but_the_last_says_how_many_gaussians_it_has() {
    let entries = vec![Entry::linear(3, 0.5, 1.0); 6];
    let mut random = Random(4);
    let mut layer = |count: usize| (0..6 * count).map(|_| random.next() as u32 & 7).collect();
    // Numbers of one byte and of more, and the last layer of any size.
    for counts in [vec![1], vec![1, 1], vec![127, 128, 1, 2], vec![1, 16_383, 16_384, 300]] {
        let layers: Vec<Vec<u32>> = counts.iter().map(|&count| layer(count)).collect();
        let file = File::new(Header::default(), entries.clone(), layers);
        let bytes = file.bytes();
        let decoder = decode_valid(&bytes);
        assert!(decoder.layers().iter().map(|&count| count as usize).eq(counts));
        let expected = file.components();
        assert_eq!(decoder.gaussians().len(), expected.len());
        for (found, values) in decoder.gaussians().iter().zip(&expected) {
            assert_eq!((found.center, found.color[0]), ([values[0], values[1]], values[5]));
        }
        let (sliced, result) = decode_pieces(bytes.chunks(1), Limits::default());
        assert_eq!(outcome(&sliced, &result), outcome(&decoder, &Ok(())));
    }
}

#[test]
fn a_length_takes_as_many_bytes_as_it_needs() {
    let sound = sample();
    for (length, bytes) in [(0, 1), (127, 1), (128, 2), (16_383, 2), (16_384, 3), (2_097_152, 4)] {
        assert_eq!(number(length).len(), bytes);
        let file = sound.clone().with(b"abCd", &vec![9; length as usize]);
        let decoder = decode_valid(&file.bytes());
        let found = decoder.chunks().iter().find(|chunk| letters(chunk.kind) == "abCd");
        let expected = (4 + bytes + length as usize + 4) as u64;
        assert_eq!(found.expect("it has arrived").bytes, expected);
    }
    // One byte more than it needs, or more than there can be, whatever else the chunk has.
    for (length, expected) in [
        (&[0x83, 0][..], "a number with more bytes than it needs"),
        (&[0x83, 0x80, 0x80, 0x80, 0], "a number with more bytes than it needs"),
        (&[0xFF, 0xFF, 0xFF, 0xFF, 0x10], "a number of more than 32 bits"),
        (&[0x83, 0x80, 0x80, 0x80, 0x80, 0], "a number of more than 32 bits"),
        (&[0x80, 0x80, 0x80, 0x80, 0x08], "the length is over 2^31 - 1"),
        (&[0xFF, 0xFF, 0xFF, 0xFF, 0x0F], "the length is over 2^31 - 1"),
    ] {
        for kind in [&b"abCd"[..], b"L"] {
            let wrong = checked(&[kind, length, &[1, 2, 3]].concat());
            let bytes = of_chunks(&[sound.chunks()[0].clone(), wrong]);
            let error = decode(&bytes).1.expect_err("no length").to_string();
            assert!(error.contains(expected), "{error}");
            // It is told with the byte that is wrong, the fifth at the latest.
            let end = sound.chunks()[0].len() + 8 + kind.len() + length.len().min(5);
            assert!(decode(&bytes[..end - 1]).1.expect_err("incomplete").is_unexpected_end());
            assert_eq!(decode(&bytes[..end]).1.expect_err("no length").to_string(), error);
        }
    }
    // The longest that there can be.
    let longest = [&b"prVt"[..], &[0xFF, 0xFF, 0xFF, 0xFF, 0x07]].concat();
    let bytes = of_chunks(&[sound.chunks()[0].clone(), longest]);
    assert!(decode(&bytes).1.expect_err("it is missing").is_unexpected_end());
}

#[test]
fn the_crc_is_of_type_length_and_payload() {
    let header = sample().chunks()[0].clone();
    for (kind, payload) in [(&b"prVt"[..], &b"private"[..]), (b"tEXt", b"a\0b"), (b"xMPD", b"")] {
        let length = number(payload.len() as u32);
        let with_crc_of = |parts: &[&[u8]]| {
            let crc = crc32(&parts.concat()).to_le_bytes();
            of_chunks(&[header.clone(), [kind, &length, payload, &crc].concat()])
        };
        let sound = decode(&with_crc_of(&[kind, &length, payload])).1.expect_err("incomplete");
        assert!(sound.is_unexpected_end(), "{sound}");
        let length = &length[..];
        for parts in [&[kind, payload][..], &[length, payload], &[kind, length], &[payload]] {
            if parts.concat() != [kind, length, payload].concat() {
                let error = decode(&with_crc_of(parts)).1.expect_err("another CRC").to_string();
                assert!(error.contains("the CRC does not match"), "{error}");
            }
        }
    }
}

#[test]
fn signature_and_version_are_judged_byte_by_byte() {
    let sound = sample().bytes();
    for at in 0..8 {
        for other in (0..=u8::MAX).filter(|&other| other != SIGNATURE[at]) {
            let mut bytes = sound.clone();
            bytes[at] = other;
            let is_expected = |error: &DecodeError| match error {
                DecodeError::Unsupported { chunk: ChunkType::HEADER, .. } => {
                    at == 6 && error.to_string().contains(&format!("version {other}"))
                }
                DecodeError::Signature => at != 6,
                _ => false,
            };
            // As soon as the byte has arrived, whatever follows.
            for end in [at + 1, 8, bytes.len()] {
                let error = decode(&bytes[..end.max(at + 1)]).1.expect_err("another signature");
                assert!(is_expected(&error), "byte {at} is {other}: {error}");
            }
            let error = Decoder::new(&bytes[..]).expect_err("another signature");
            assert!(is_expected(&error), "byte {at} is {other}: {error}");
        }
    }
    let of_another_version = [&SIGNATURE[..6], b"\x02whatever follows"].concat();
    let error = decode(&of_another_version).1.expect_err("version 2").to_string();
    assert!(error.contains("version 2"), "{error}");
}

/// What to do to a sound field, and what the error then says.
type Change<'a, T> = (&'a dyn Fn(&mut T), &'a str);

/// The error of a file of these chunks, which must have one.
#[track_caller]
fn refused(chunks: &[Vec<u8>]) -> String {
    decode(&of_chunks(chunks)).1.expect_err("a file that breaks a rule").to_string()
}

#[track_caller]
fn check_refused(chunks: &[Vec<u8>], expected: &str) {
    let error = refused(chunks);
    assert!(error.contains(expected), "{error:?} instead of {expected:?}");
}

#[test]
fn errors_name_the_field_of_the_header_and_the_rule() {
    let entries = vec![Entry::FLOAT; 7];
    let sound = Header { color: GRAY_ALPHA, gaussians: 1, layers: 1, ..Header::default() };
    let codes = [4.0, 4.0, 1.0, 0.0, 1.0, 0.5, 0.5].map(f32::to_bits);
    let (layer, end) = (chunk(b"L", &packed(&entries, &codes)), chunk(b"E", &[]));
    let after = |first: Vec<u8>| [first, layer.clone(), end.clone()];
    decode(&of_chunks(&after(sound.chunk(&quantizers(&entries)))))
        .1
        .expect("sound until it is changed");

    let changes: [Change<'_, Header>; 16] = [
        (&|h| h.reserved = 1, "unsupported: format 177"),
        (&|h| h.form = 3, "unsupported: parameterization 3"),
        (&|h| (h.coding, h.form) = (ENTROPY, 2), "unsupported: form of steps 2"),
        (&|h| (h.coding, h.form) = (ENTROPY, 3), "unsupported: form of steps 3"),
        (&|h| h.width = 0, "the width is zero"),
        (&|h| h.height = 0, "the height is zero"),
        (&|h| h.width = (1 << 20) + 1, "unsupported: width 1048577"),
        (&|h| h.height = u32::MAX, "unsupported: height 4294967295"),
        (&|h| h.layers = 0, "Gaussians, but no layer"),
        (&|h| h.layers = 2, "more layers than Gaussians"),
        (&|h| (h.gaussians, h.layers) = (1 << 16, 1 << 16), "unsupported: number of layers 65536"),
        (&|h| (h.kernel, h.cutoff) = (0, 0.0), "a cut-off that is not positive"),
        (&|h| (h.kernel, h.cutoff) = (0, -1.0), "a cut-off that is not positive"),
        (&|h| (h.kernel, h.cutoff) = (0, 64.5), "unsupported: cut-off over 64"),
        (&|h| (h.kernel, h.cutoff) = (0, f32::NAN), "a cut-off that is not positive"),
        (&|h| h.color = RGB, "is shorter than its fields"),
    ];
    for (change, expected) in changes {
        let mut header = sound;
        change(&mut header);
        let expected = format!("chunk H (header): {expected}");
        check_refused(&after(header.chunk(&quantizers(&entries))), &expected);
    }

    let changes: [Change<'_, Entry>; 12] = [
        (&|e| e.kind = 3, "unsupported: quantizer 3"),
        (&|e| e.bits = 0, "a bit depth of 0"),
        (&|e| e.bits = 17, "unsupported: bit depth 17"),
        (&|e| e.scale = 0.0, "a scale that is not positive"),
        (&|e| e.scale = -1.0, "a scale that is not positive"),
        (&|e| e.scale = f32::NAN, "a scale that is not positive"),
        (&|e| e.scale = f32::INFINITY, "a scale that is not positive"),
        (&|e| e.scale = 4_294_967_296.0_f32.next_up(), "a scale that is not positive"),
        (&|e| e.offset = f32::NAN, "an offset that is not within"),
        (&|e| e.offset = -f32::INFINITY, "an offset that is not within"),
        (&|e| e.offset = -5e9, "an offset that is not within"),
        (&|e| e.kind = 0, "unsupported: bit depth 8"),
    ];
    for (change, expected) in changes {
        let mut entries = entries.clone();
        entries[3] = Entry::linear(8, 1.0, 0.0);
        change(&mut entries[3]);
        let expected = format!("chunk H (header): {expected}");
        check_refused(&after(sound.chunk(&quantizers(&entries))), &expected);
    }

    // The fields: 16 x 16, one Gaussian in one layer, black.
    let fields = |width: &[u8], rest: &[u8]| {
        [&[sound.format()], width, &[16, 1, 1, 0, 0], &quantizers(&entries), rest].concat()
    };
    let whole = fields(&[16], &[]);
    assert_eq!(chunk(b"H", &whole), sound.chunk(&quantizers(&entries)));
    for (payload, expected) in [
        (whole[..whole.len() - 1].to_vec(), "is shorter than its fields"),
        (whole[..4].to_vec(), "is shorter than its fields"),
        (Vec::new(), "is shorter than its fields"),
        (fields(&[16], &[0]), "is longer than its fields"),
        (fields(&[16], &[0; 255 - 21]), "is longer than its fields"),
        (fields(&[16], &[0; 256 - 21]), "unsupported: length 256"),
        (fields(&[0x90, 0], &[]), "a number with more bytes than it needs"),
        (fields(&[0x90, 0x80, 0x80, 0x80, 0], &[]), "a number with more bytes than it needs"),
        (fields(&[0x90, 0x80, 0x80, 0x80, 0x10], &[]), "a number of more than 32 bits"),
        (fields(&[0x90, 0x80, 0x80, 0x80, 0x80, 0], &[]), "a number of more than 32 bits"),
        (fields(&[0x90, 0x80, 0x80, 0x80, 0x0F], &[]), "unsupported: width 4026531856"),
    ] {
        let expected = format!("chunk H (header): {expected}");
        check_refused(&after(chunk(b"H", &payload)), &expected);
    }
    // Without Gaussians there are no quantizers, and neither are there layers.
    let empty = Header { gaussians: 0, layers: 0, ..sound };
    decode_valid(&of_chunks(&[chunk(b"H", &empty.fields()), end.clone()]));
    let with_quantizers = chunk(b"H", &[&empty.fields()[..], &quantizers(&entries)].concat());
    check_refused(&after(with_quantizers), "chunk H (header): is longer than its fields");
    check_refused(&after(chunk(b"H", &empty.fields())), "chunk L (layer): more layers than");
}

#[test]
fn errors_name_the_chunk_and_the_rule() {
    let entries = vec![Entry::FLOAT; 7];
    let of = |gaussians: u32, layers: u32, entries: &[Entry]| {
        let header = Header { color: GRAY_ALPHA, gaussians, layers, ..Header::default() };
        header.chunk(&quantizers(entries))
    };
    let codes = [4.0, 4.0, 1.0, 0.0, 1.0, 0.5, 0.5].map(f32::to_bits);
    let gaussian = packed(&entries, &codes);
    let other = |kind: &[u8], payload: &[u8]| chunk(kind, payload);
    let layer = |count: &[u8], bytes: &[u8]| chunk(b"L", &[count, bytes].concat());
    let (s, l, e) = (of(1, 1, &entries), layer(&[], &gaussian), chunk(b"E", &[]));
    let (s, l, e) = (&s, &l, &e);
    let (two, first) = (of(4, 2, &entries), layer(&[1], &gaussian));
    let (two, first) = (&two, &first);
    let threes = layer(&[], &gaussian.repeat(3));
    decode(&of_chunks(&[two.clone(), first.clone(), threes, e.clone()])).1.expect("it is sound");
    let nan = codes.map(|code| if code == 0 { f32::NAN.to_bits() } else { code });
    let infinite = codes.map(|code| if code == 0 { f32::INFINITY.to_bits() } else { code });
    let odd = vec![Entry::linear(1, 1.0, 0.0); 7];
    let mut padded = packed(&odd, &[1; 7]);
    padded[0] |= 0x80;
    let sequences: Vec<(Vec<Vec<u8>>, &str)> = vec![
        (vec![l.clone()], "L (layer): stands before the header"),
        (vec![e.clone()], "E (end): stands before the header"),
        (vec![other(b"A", &[])], "A: stands before the header"),
        (vec![other(b"abCd", &[])], "abCd: stands before the header"),
        (vec![s.clone(), s.clone()], "H (header): appears twice"),
        (vec![s.clone(), l.clone(), s.clone()], "H (header): appears twice"),
        (vec![s.clone(), l.clone(), l.clone()], "L (layer): more layers than"),
        (vec![s.clone(), e.clone()], "E (end): fewer layers than"),
        (vec![two.clone(), first.clone(), e.clone()], "E (end): fewer layers than"),
        (vec![s.clone(), l.clone(), other(b"E", &[0])], "E (end): is not empty"),
        (vec![s.clone(), other(b"A", &[])], "A: unsupported: critical chunk"),
        (vec![s.clone(), l.clone(), other(b"Z", &[])], "Z: unsupported: critical chunk"),
        (vec![s.clone(), other(b"ab1d", &[])], "ab1d: the type is not of letters"),
        (vec![s.clone(), other(b"a\xFF\0d", &[])], "a\\xff\\x00d: the type is not of letters"),
        (vec![s.clone(), other(b"1", &[])], "1: the type is not of letters"),
        (vec![s.clone(), other(b"@", &[])], "@: the type is not of letters"),
        (vec![s.clone(), other(b"[", &[])], "[: the type is not of letters"),
        (vec![s.clone(), other(b"`", &[])], "`: the type is not of letters"),
        (vec![s.clone(), other(b"{", &[])], "{: the type is not of letters"),
        (vec![s.clone(), other(b"\xFF", &[])], "\\xff: the type is not of letters"),
        // The last layer has the rest of the Gaussians.
        (vec![s.clone(), layer(&[], &[])], "L (layer): the length does not match"),
        (vec![s.clone(), layer(&[], &gaussian[1..])], "L (layer): the length does not match"),
        (vec![s.clone(), layer(&[1], &gaussian)], "L (layer): the length does not match"),
        (
            vec![two.clone(), first.clone(), layer(&[], &gaussian.repeat(2))],
            "L (layer): the length does not match",
        ),
        (
            vec![two.clone(), first.clone(), layer(&[], &gaussian.repeat(4))],
            "L (layer): the length does not match",
        ),
        // The others begin with their number.
        (vec![two.clone(), layer(&[], &[])], "L (layer): too short for its number"),
        (vec![two.clone(), layer(&[0x81], &[])], "L (layer): too short for its number"),
        (vec![two.clone(), layer(&[0], &[])], "L (layer): no Gaussians"),
        (vec![two.clone(), layer(&[0], &gaussian)], "L (layer): no Gaussians"),
        (
            vec![two.clone(), layer(&[4], &gaussian.repeat(4))],
            "L (layer): more Gaussians than the header declares",
        ),
        (
            vec![two.clone(), layer(&[0xFF, 0xFF, 0xFF, 0xFF, 0x0F], &gaussian)],
            "L (layer): more Gaussians than the header declares",
        ),
        (
            vec![two.clone(), layer(&[0x81, 0], &gaussian)],
            "L (layer): a number with more bytes than it needs",
        ),
        (
            vec![two.clone(), layer(&[0x81, 0x80, 0x80, 0x80, 0x10], &gaussian)],
            "L (layer): a number of more than 32 bits",
        ),
        (vec![two.clone(), layer(&[2], &gaussian)], "L (layer): the length does not match"),
        (vec![two.clone(), layer(&[1], &gaussian[1..])], "L (layer): the length does not match"),
        (
            vec![two.clone(), layer(&[1], &[&gaussian[..], &[0]].concat())],
            "L (layer): the length does not match",
        ),
        (
            vec![s.clone(), layer(&[], &packed(&entries, &nan))],
            "L (layer): an attribute that is not finite",
        ),
        (
            vec![s.clone(), layer(&[], &packed(&entries, &infinite))],
            "L (layer): an attribute that is not finite",
        ),
        (vec![of(1, 1, &odd), layer(&[], &padded)], "L (layer): a padding bit is not zero"),
    ];
    for (chunks, expected) in sequences {
        check_refused(&chunks, &format!("chunk {expected}"));
    }
    let foreign = decode(b"\x89PNG\r\n\x1A\n").1.expect_err("another format");
    assert!(matches!(foreign, DecodeError::Signature));
}

#[test]
fn chunks_of_unknown_ancillary_types_are_skipped_wherever_they_stand() {
    let file = sample();
    let expected = decode_valid(&file.bytes());
    let count = file.chunks().len();
    // Private and public, safe and unsafe to copy, with the reserved bit.
    for kind in [b"prVt", b"aBCD", b"aBCd", b"abcd", b"aBcD", b"zZZZ"] {
        for at in 1..count {
            let mut chunks = file.chunks();
            chunks.insert(at, chunk(kind, b"whatever"));
            let bytes = of_chunks(&chunks);
            let (decoder, result) = decode_pieces(bytes.chunks(1), Limits::default());
            result.expect("it is skipped");
            assert_eq!(bits(decoder.gaussians()), bits(expected.gaussians()));
            assert_eq!(decoder.metadata(), expected.metadata());
            // Its CRC must be right all the same.
            let end = offsets(&chunks)[at + 1];
            let mut damaged = bytes.clone();
            damaged[end - 6] ^= 1;
            let error = decode(&damaged).1.expect_err("damaged").to_string();
            assert!(error.contains("the CRC does not match"), "{error}");
        }
    }
}
