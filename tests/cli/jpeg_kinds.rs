//! JPEG files of unusual kinds, which are the same picture as a usual one, and what is not read.

use super::jpeg::with_segment;
use super::room::{Room, text};

/// Baseline, with one scan and half as much chroma across and down.
const INTERLEAVED: &[u8] = include_bytes!("jpegs/interleaved.jpg");
/// The same in a scan for each component.
const SCANS: &[u8] = include_bytes!("jpegs/scans.jpg");
/// The same with ten scans, from coarse to fine.
const PROGRESSIVE: &[u8] = include_bytes!("jpegs/progressive.jpg");
/// With twice as many samples of blue chroma as of luma, across and down.
const WIDE_CHROMA: &[u8] = include_bytes!("jpegs/wide_chroma.jpg");
/// With a third of the chroma across.
const THIRDS: &[u8] = include_bytes!("jpegs/thirds.jpg");

/// A marker without the byte 255 before it, and where its segment begins.
const START_OF_SCAN: u8 = 0xDA;
const BASELINE: u8 = 0xC0;
const TABLE: u8 = 0xC4;
const APP2: u8 = 0xE2;
const JFIF: u8 = 0xE0;

fn find(file: &[u8], marker: u8) -> Vec<usize> {
    let pairs = file.windows(2).zip(0..);
    pairs.filter(|(pair, _)| *pair == [0xFF, marker]).map(|(_, at)| at).collect()
}

/// The file with its components called red, green and blue.
fn named_rgb(file: &[u8]) -> Vec<u8> {
    let mut file = file.to_vec();
    let (frame, scan) = (find(&file, BASELINE)[0], find(&file, START_OF_SCAN)[0]);
    for (number, id) in b"RGB".iter().enumerate() {
        file[frame + 10 + 3 * number] = *id;
        file[scan + 5 + 2 * number] = *id;
    }
    file
}

fn without_jfif(file: &[u8]) -> Vec<u8> {
    let at = find(file, JFIF)[0];
    let length = usize::from(u16::from_be_bytes([file[at + 2], file[at + 3]]));
    [&file[..at], &file[at + 2 + length..]].concat()
}

#[test]
fn kinds_that_say_the_same_are_the_same_picture() {
    let room = Room::new();
    room.write("a.jpg", INTERLEAVED);
    let error = |file: &[u8]| {
        room.write("b.jpg", file);
        room.json(&["compare", "a.jpg", "b.jpg", "--json"])["max_abs_error"].as_u64()
    };
    // The decoders round otherwise.
    for (name, file, most) in [
        ("progressive", PROGRESSIVE, 0),
        ("a scan for each component", SCANS, 3),
        ("more chroma than luma", WIDE_CHROMA, 12),
        ("a third of the chroma", THIRDS, 12),
        // JFIF has no other colours than YCbCr, however the components are called.
        ("components called RGB", &named_rgb(INTERLEAVED), 3),
    ] {
        let error = error(file);
        assert!(error.is_some_and(|error| error <= most), "{name}: {error:?}");
    }
    // Without JFIF, the names count.
    let rgb = error(&without_jfif(&named_rgb(INTERLEAVED)));
    assert!(rgb.is_some_and(|error| error > 50), "{rgb:?}");
    assert_eq!(error(&without_jfif(INTERLEAVED)), Some(0));
    // Batches ask for the size first.
    room.write("in/thirds.jpg", THIRDS);
    room.batch(0, &["in", "--out", "out", "--effort", "1", "--gaussians", "1"]);
}

#[test]
fn what_is_not_read_is_told_in_plain_words() {
    let room = Room::new();
    let frame = find(INTERLEAVED, BASELINE)[0];
    let with = |file: &[u8], at: usize, bytes: &[u8]| {
        let mut file = file.to_vec();
        file[at..at + bytes.len()].copy_from_slice(bytes);
        file
    };
    let thirds = find(THIRDS, BASELINE)[0];
    for (file, words) in [
        (with(INTERLEAVED, frame + 1, &[0xC9]), "JPEG with arithmetic coding is not read"),
        (with(INTERLEAVED, frame + 1, &[0xC3]), "lossless JPEG is not read"),
        (with(INTERLEAVED, frame + 1, &[0xC5]), "hierarchical JPEG is not read"),
        (with(INTERLEAVED, frame + 4, &[12]), "other samples than those of 8 bits"),
        (with(INTERLEAVED, frame + 5, &[0, 0]), "whose height comes after its data"),
        (with(THIRDS, thirds + 14, &[0x21]), "JPEG with such sampling is not read"),
        (INTERLEAVED[..frame + 6].to_vec(), "the file is damaged: the data end too early"),
    ] {
        room.write("a.jpg", file);
        for options in [&[][..], &["--allow-partial"]] {
            let error = room.fails(&[&["encode", "a.jpg", "a.gip"], options].concat());
            assert!(error.contains(words) && !error.contains('"'), "{error}");
        }
        let (_, errors) = room.batch(3, &["a.jpg", "--out", "out"]);
        assert!(errors.contains(words) && !errors.contains('"'), "{errors}");
    }
}

#[test]
fn a_progressive_picture_may_end_anywhere_after_its_first_scan() {
    let room = Room::new();
    let first = find(PROGRESSIVE, START_OF_SCAN)[0];
    let segments = [START_OF_SCAN, TABLE].map(|marker| find(PROGRESSIVE, marker)).concat();
    let later = segments.into_iter().filter(|at| *at > first);
    for cut in later.flat_map(|at| [at, at + 1, at + 2, at + 3, at + 7]) {
        room.write("a.jpg", &PROGRESSIVE[..cut]);
        let args = ["encode", "a.jpg", "a.gip", "--effort", "1", "--gaussians", "1"];
        assert!(room.fails(&args).contains("the data end too early"), "{cut}");
        let output = room.run(&[&args[..], &["--allow-partial"]].concat());
        assert!(output.status.success(), "{cut}: {}", text(&output.stderr));
    }
}

#[test]
fn a_progressive_picture_whose_scans_do_not_follow_each_other_is_damaged() {
    let room = Room::new();
    let error = |file: &[u8]| {
        room.write("a.jpg", file);
        let args = ["encode", "a.jpg", "a.gip", "--effort", "1", "--gaussians", "1"];
        let partial = room.run(&[&args[..], &["--allow-partial"]].concat());
        assert!(!text(&partial.stderr).is_empty());
        room.fails(&args)
    };
    let scans = find(PROGRESSIVE, START_OF_SCAN);
    let mut markers = [scans.clone(), find(PROGRESSIVE, TABLE)].concat();
    for &at in &markers {
        let mut file = PROGRESSIVE.to_vec();
        file[at + 1] = 0xAB;
        assert!(error(&file).contains("there is an invalid marker"), "{at}");
    }
    markers.push(PROGRESSIVE.len() - 2);
    // Nothing comes after the last bits of a coefficient, which the last four have.
    for &at in &scans[..scans.len() - 4] {
        let end = *markers.iter().filter(|&&marker| marker > at).min().expect("there is an end");
        let file = [&PROGRESSIVE[..at], &PROGRESSIVE[end..]].concat();
        assert!(error(&file).contains("a part is missing"), "{at}");
    }
    // Bits that do not come next.
    let mut file = PROGRESSIVE.to_vec();
    let length = usize::from(file[scans[5] + 3]);
    file[scans[5] + 1 + length] = 0x31;
    assert!(error(&file).contains("a part is missing"));
}

#[test]
fn a_profile_that_is_not_all_there_is_dropped_with_a_warning() {
    let room = Room::new();
    let mut profile = vec![7; 300];
    profile[..4].copy_from_slice(&300_u32.to_be_bytes());
    profile[16..20].copy_from_slice(b"RGB ");
    let part = |number: u8, data: &[u8]| [&b"ICC_PROFILE\0"[..], &[number, 2], data].concat();
    let halves = [part(1, &profile[..150]), part(2, &profile[150..])];
    let of = |segments: &[&[u8]]| {
        segments.iter().fold(INTERLEAVED.to_vec(), |file, data| with_segment(&file, APP2, data))
    };
    for (file, is_kept) in [
        (of(&[&halves[1], &halves[0]]), true),
        (of(&[&halves[0]]), false),
        (of(&[&halves[1]]), false),
        (of(&[&part(2, &profile[150..299]), &halves[0]]), false),
        (of(&[&part(2, &[&profile[150..], &[0]].concat()), &halves[0]]), false),
    ] {
        room.write("a.jpg", file);
        let args = ["encode", "a.jpg", "a.gip", "--effort", "1", "--gaussians", "1"];
        let output = room.run(&args);
        let warning = text(&output.stderr);
        assert!(output.status.success(), "{warning}");
        assert_eq!(warning.is_empty(), is_kept, "{warning}");
        assert!(is_kept || warning.contains("its ICC profile is damaged"), "{warning}");
        let kept = room.json(&["info", "a.gip", "--json"])["metadata"]["icc_profile"].as_u64();
        assert_eq!(kept, is_kept.then_some(300));
    }
}
