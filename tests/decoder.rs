//! The three decoders: the whole file, any reader, and bytes as they arrive. Slicing, prefixes, damage,
//! order of chunks, limits, requests.

mod common;

use std::io::{self, Read};

use common::{
    CHOLESKY, EXPONENTIAL, Entry, File, GRAY_ALPHA, Ghdr, QUARTIC, RGB, RGBA, Random, bits, cases,
    chunk, decode, decode_pieces, decode_valid, gaus, layered, of_chunks, oracle, qntz,
};
use image_gip::{
    ChunkType, ColorModel, DecodeError, Decoder, Gaussian, Kernel, LimitKind, Limits, Orientation,
    Quantizer, Region, RenderOptions, RequestError, SampleDepth, Samples, StreamDecoder,
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
    let base = [20_000, 30_000, 40_000, 0];
    let header = Ghdr { color: RGB, width: 24, height: 17, base, ..Ghdr::default() };
    File::new(header, entries.clone(), layers)
        .with(b"iCCP", b"profile")
        .with(b"eXIf", b"II*\0")
        .with(b"xMPd", b"<x/>")
        .with(b"tEXt", b"Title\0A test")
        .with(b"tEXt", "Autorin\0Zoë".as_bytes())
        .with(b"prVt", &[1, 2, 3])
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
        let mut base = base;
        base[usize::from(color) + 1..].fill(0);
        let depth = if sixteen { 16 } else { 8 };
        let (kernel, cutoff) = kernel;
        let (width, height) = size;
        let header =
            Ghdr { color, depth, width, height, kernel, parameterization, cutoff, base, ..Ghdr::default() };
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
        let header = Ghdr { color: RGBA, ..Ghdr::default() };
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
        let mut start = 8;
        let current = chunks.iter().find(|chunk| {
            start += chunk.len();
            start > length
        });
        let in_chunk = current.filter(|chunk| length >= start - chunk.len() + 8);
        let named = match error {
            DecodeError::UnexpectedEnd { chunk } => chunk.map(|chunk| chunk.0.to_vec()),
            _ => None,
        };
        assert_eq!(named, in_chunk.map(|chunk| chunk[4..8].to_vec()), "{length} bytes");
        let gaussians = decoder.gaussians();
        assert_eq!(bits(gaussians), bits(&all.gaussians()[..gaussians.len()]));
        let Some(picture) = decoder.picture() else {
            assert!(length < 8 + 48, "the header has arrived");
            continue;
        };
        let mut found = vec![0.0; 24 * 17 * 3];
        picture.render_planes(&RenderOptions::new(), &mut found).expect("a sound request");
        let request = oracle::Request { prefix: gaussians.len(), ..oracle::Request::whole(&file) };
        assert_eq!(found, oracle::render(&file, &request).concat(), "{length} bytes");
    }
    // All but CRC and end: every Gaussian is there.
    let (decoder, _) = decode(&bytes[..bytes.len() - 16]);
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
                assert_eq!(chunk, ChunkType::GAUS);
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
    assert_eq!((text.count, text.bytes), (2, 24 + 12 + 12));
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
        let at = chunks.iter().position(|chunk| &chunk[4..8] == b"GAUS").expect("layers");
        8 + chunks[..at].iter().map(Vec::len).sum::<usize>() + 8
    };
    let plain = first_layer(&turned);
    assert_eq!(told(&turned.bytes()), Some((plain, Orientation::NoTransforms)));
    let turned = turned.with(b"eXIf", ROTATE_90);
    assert_eq!(decode_valid(&turned.bytes()).metadata().orientation(), Orientation::Rotate90);
    // With the end of the Exif data.
    assert_eq!(told(&turned.bytes()), Some((first_layer(&turned) - 8, Orientation::Rotate90)));

    let empty = File::new(Ghdr::default(), vec![Entry::FLOAT; 6], vec![]).bytes();
    assert_eq!(told(&empty), Some((empty.len(), Orientation::NoTransforms)));
}

#[test]
fn known_ancillary_chunks_after_the_first_layer_are_skipped() {
    let file = sample();
    let mut chunks = file.chunks();
    chunks.insert(chunks.len() - 2, chunk(b"iCCP", b"too late"));
    chunks.insert(chunks.len() - 1, chunk(b"tEXt", b"not even text"));
    let decoder = decode_valid(&of_chunks(&chunks));
    assert_eq!(decoder.metadata(), decode_valid(&file.bytes()).metadata());
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
    let cut = &bytes[..bytes.len() - 30];
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
    let error = Decoder::new(&bytes[..100]).expect_err("the file is too short");
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
    *first = chunk(b"GAUS", &first[8..first.len() - 6]);
    *chunks[layered::BEFORE + 1].last_mut().expect("a CRC") ^= 1;
    of_chunks(&chunks)
}

/// Files of both codings, with metadata and without, with bounds, without Gaussians.
fn files() -> Vec<(&'static str, Vec<u8>)> {
    let header = Ghdr { depth: 16, base: [9, 0, 0, 0], ..Ghdr::default() };
    let mut described = layered::chunks();
    described.insert(1, chunk(b"iCCP", &[7; 20_000]));
    described.insert(2, chunk(b"tEXt", b"Title\0Layers"));
    described.insert(described.len() - 1, chunk(b"prVt", &[8; 100]));
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
        let cuts = (0..80).chain([bytes.len() / 2]).chain(bytes.len() - 40..bytes.len());
        for length in cuts.filter(|&length| length < bytes.len()) {
            let error = image_gip::decode(&bytes[..length]).expect_err("a part of a file");
            assert!(error.is_unexpected_end(), "{name}, {length} bytes: {error}");
        }
    }
    let bytes = damaged_twice();
    let expected = decode(&bytes).1.expect_err("damaged").to_string();
    assert!(expected.contains("GAUS") && !expected.contains("CRC"), "{expected}");
    assert_eq!(image_gip::decode(&bytes).expect_err("damaged").to_string(), expected);
    // That the file ends early comes behind it, too.
    let short = layered::damaged(&[0]);
    let error = image_gip::decode(&short[..short.len() - 5]).expect_err("damaged");
    assert_eq!(error.to_string(), expected);
    let large = Ghdr { width: 1 << 17, ..Ghdr::default() };
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

/// What to do to a sound field, and what the error then says.
type Change<'a, T> = (&'a dyn Fn(&mut T), &'a str);

/// The error of a file of these chunks, which must have one.
#[track_caller]
fn refused(chunks: &[Vec<u8>]) -> String {
    decode(&of_chunks(chunks)).1.expect_err("a file that breaks a rule").to_string()
}

#[test]
fn errors_name_the_chunk_and_the_rule() {
    let entries = vec![Entry::FLOAT; 7];
    let header = |change: &dyn Fn(&mut Ghdr)| {
        let mut header = Ghdr { color: GRAY_ALPHA, gaussians: 1, layers: 1, ..Ghdr::default() };
        change(&mut header);
        chunk(b"GHDR", &header.payload())
    };
    let sound = header(&|_| {});
    let quantizers = chunk(b"QNTZ", &qntz(&entries));
    let codes = [4.0, 4.0, 1.0, 0.0, 1.0, 0.5, 0.5].map(f32::to_bits);
    let layer = chunk(b"GAUS", &gaus(&entries, &codes));
    let end = chunk(b"GEND", &[]);
    let after = |first: Vec<u8>| [first, quantizers.clone(), layer.clone(), end.clone()];
    decode(&of_chunks(&after(sound.clone()))).1.expect("sound until it is changed");

    let changes: [Change<'_, Ghdr>; 20] = [
        (&|h| h.version = 2, "GHDR: unsupported: version 2"),
        (&|h| h.coding = 2, "GHDR: unsupported: coding 2"),
        (&|h| h.color = 4, "GHDR: unsupported: colour model 4"),
        (&|h| h.depth = 10, "GHDR: unsupported: sample depth 10"),
        (&|h| h.kernel = 2, "GHDR: unsupported: kernel 2"),
        (&|h| h.parameterization = 3, "GHDR: unsupported: parameterization 3"),
        (&|h| h.transform = 1, "GHDR: unsupported: colour transform 1"),
        (&|h| h.width = 0, "GHDR: the width is zero"),
        (&|h| h.height = 0, "GHDR: the height is zero"),
        (&|h| h.width = (1 << 20) + 1, "GHDR: the width is over 2^20"),
        (&|h| h.height = u32::MAX, "GHDR: the height is over 2^20"),
        (&|h| h.layers = 0, "GHDR: Gaussians, but no layer"),
        (&|h| h.layers = 2, "GHDR: more layers than Gaussians"),
        (&|h| h.gaussians = 0, "GHDR: more layers than Gaussians"),
        (&|h| h.cutoff = 8.5, "GHDR: a cut-off of the quartic kernel that is not 4"),
        (&|h| (h.kernel, h.cutoff) = (0, 0.0), "GHDR: a cut-off that is not in (0, 64]"),
        (&|h| (h.kernel, h.cutoff) = (0, 64.5), "GHDR: a cut-off that is not in (0, 64]"),
        (&|h| (h.kernel, h.cutoff) = (0, f32::NAN), "GHDR: a cut-off that is not in (0, 64]"),
        (&|h| h.reserved[1] = 1, "GHDR: a reserved byte is not zero"),
        (&|h| h.base[2] = 1, "GHDR: base colour in an absent channel"),
    ];
    for (change, expected) in changes {
        let error = refused(&after(header(change)));
        assert!(error.contains(expected), "{error:?} instead of {expected:?}");
    }

    let entry = |change: &dyn Fn(&mut Entry)| {
        let mut entries = entries.clone();
        entries[3] = Entry::linear(8, 1.0, 0.0);
        change(&mut entries[3]);
        chunk(b"QNTZ", &qntz(&entries))
    };
    let changes: [Change<'_, Entry>; 14] = [
        (&|e| e.kind = 3, "QNTZ: unsupported: kind 3"),
        (&|e| e.reserved[0] = 1, "QNTZ: a reserved byte is not zero"),
        (&|e| e.bits = 0, "QNTZ: a bit depth that is not 1 to 16"),
        (&|e| e.bits = 17, "QNTZ: a bit depth that is not 1 to 16"),
        (&|e| e.scale = 0.0, "QNTZ: a scale that is not positive"),
        (&|e| e.scale = -1.0, "QNTZ: a scale that is not positive"),
        (&|e| e.scale = f32::NAN, "QNTZ: a scale that is not positive"),
        (&|e| e.scale = f32::INFINITY, "QNTZ: a scale that is not positive"),
        (&|e| e.scale = 4_294_967_296.0_f32.next_up(), "QNTZ: a scale that is not positive"),
        (&|e| e.offset = f32::NAN, "QNTZ: an offset that is not within"),
        (&|e| e.offset = -f32::INFINITY, "QNTZ: an offset that is not within"),
        (&|e| e.offset = -5e9, "QNTZ: an offset that is not within"),
        (&|e| e.kind = 0, "QNTZ: a float that is not 32 bits deep"),
        (
            &|e| *e = Entry { offset: 1.0, ..Entry::FLOAT },
            "QNTZ: a float whose scale and offset are not 1 and 0",
        ),
    ];
    for (change, expected) in changes {
        let error = refused(&[sound.clone(), entry(change), layer.clone(), end.clone()]);
        assert!(error.contains(expected), "{error:?} instead of {expected:?}");
    }

    let (s, q, l, e) = (&sound, &quantizers, &layer, &end);
    let other = |kind: &[u8; 4], payload: &[u8]| chunk(kind, payload);
    let mut short = gaus(&entries, &codes);
    short.pop();
    let mut none = gaus(&entries, &codes);
    none[0] = 0;
    let mut two = gaus(&entries, &codes);
    two[0] = 2;
    let nan = codes.map(|code| if code == 0 { f32::NAN.to_bits() } else { code });
    let infinite = codes.map(|code| if code == 0 { f32::INFINITY.to_bits() } else { code });
    let odd = vec![Entry::linear(1, 1.0, 0.0); 7];
    let odd_codes = chunk(b"QNTZ", &qntz(&odd));
    let mut padded = gaus(&odd, &[1; 7]);
    padded[4] |= 0x80;
    let sequences: Vec<(Vec<Vec<u8>>, &str)> = vec![
        (vec![q.clone()], "QNTZ: stands before the header"),
        (vec![other(b"abCd", &[])], "abCd: stands before the header"),
        (vec![s.clone(), s.clone()], "GHDR: appears twice"),
        (vec![s.clone(), q.clone(), q.clone()], "QNTZ: appears twice"),
        (vec![s.clone(), l.clone()], "GAUS: stands before QNTZ"),
        (vec![s.clone(), q.clone(), l.clone(), l.clone()], "GAUS: more layers than"),
        (vec![s.clone(), q.clone(), e.clone()], "GEND: fewer layers or Gaussians"),
        (vec![s.clone(), e.clone()], "GEND: fewer layers or Gaussians"),
        (vec![s.clone(), q.clone(), l.clone(), other(b"GEND", &[0])], "GEND: is not empty"),
        (vec![s.clone(), other(b"ABCD", &[])], "ABCD: unsupported: critical chunk"),
        (vec![s.clone(), other(b"ab1d", &[])], "ab1d: the type is not four letters"),
        (vec![s.clone(), other(b"a\xFF\0d", &[])], "the type is not four letters"),
        (vec![other(b"GHDR", &[1; 35])], "GHDR: the length is not 36 bytes"),
        (vec![other(b"GHDR", &[1; 37])], "GHDR: the length is not 36 bytes"),
        (vec![other(b"GHDR", &[])], "GHDR: the length is not 36 bytes"),
        (vec![other(b"GHDR", &[2; 108])], "GHDR: unsupported: version 2"),
        (vec![other(b"GHDR", &[1; 109])], "GHDR: is too long"),
        (vec![s.clone(), other(b"QNTZ", &[0; 83])], "QNTZ: the length is not 12 bytes"),
        (vec![s.clone(), other(b"QNTZ", &[0; 96])], "QNTZ: the length is not 12 bytes"),
        (vec![s.clone(), q.clone(), other(b"GAUS", &[])], "GAUS: too short"),
        (vec![s.clone(), q.clone(), other(b"GAUS", &[1, 0, 0])], "GAUS: too short"),
        (vec![s.clone(), q.clone(), other(b"GAUS", &short)], "GAUS: the length does not match"),
        (vec![s.clone(), q.clone(), other(b"GAUS", &none)], "GAUS: no Gaussians"),
        (vec![s.clone(), q.clone(), other(b"GAUS", &two)], "GAUS: more Gaussians than"),
        (
            vec![s.clone(), q.clone(), other(b"GAUS", &gaus(&entries, &nan))],
            "GAUS: an attribute that is not finite",
        ),
        (
            vec![s.clone(), q.clone(), other(b"GAUS", &gaus(&entries, &infinite))],
            "GAUS: an attribute that is not finite",
        ),
        (vec![s.clone(), odd_codes, other(b"GAUS", &padded)], "GAUS: a padding bit is not zero"),
        (vec![s.clone(), other(b"iCCP", &[]), other(b"iCCP", &[])], "iCCP: appears twice"),
        (vec![s.clone(), other(b"tEXt", b"x")], "tEXt: no NUL after the keyword"),
        (vec![s.clone(), other(b"tEXt", b"\0x")], "tEXt: the keyword is not 1 to 79"),
        (vec![s.clone(), other(b"tEXt", &[b'x'; 80])], "tEXt: no NUL"),
        (
            vec![s.clone(), other(b"tEXt", &[&[b'x'; 80][..], &[0]].concat())],
            "tEXt: the keyword is not 1 to 79",
        ),
        (vec![s.clone(), other(b"tEXt", b"x\0\xFF")], "tEXt: is not UTF-8"),
        (vec![s.clone(), other(b"tEXt", b"x\0y\0")], "tEXt: a NUL in the text"),
    ];
    for (chunks, expected) in sequences {
        let error = refused(&chunks);
        assert!(error.contains(expected), "{error:?} instead of {expected:?}");
    }
    let mut long = sound;
    long[3] = 0x80;
    assert!(refused(&[long]).contains("GHDR: the length is over 2^31 - 1"));
    let foreign = decode(b"\x89PNG\r\n\x1A\n").1.expect_err("another format");
    assert!(matches!(foreign, DecodeError::Signature));
}
