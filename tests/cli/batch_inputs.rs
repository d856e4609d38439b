//! The files that `gip batch` finds: all kinds of names, and a line of the manifest for each.

use std::fs;

use image::ColorType;

use super::pictures;
use super::room::{Room, by_input, text};

/// Quick options of the encoder.
const QUICK: [&str; 4] = ["--effort", "1", "--gaussians", "20"];

#[test]
#[cfg(unix)]
fn names_that_differ_in_bytes_that_are_not_text_have_a_line_each() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let room = Room::new();
    room.save_picture("in/plain.png", &pictures::picture((40, 32), ColorType::Rgb8));
    let plain = room.path("in/plain.png");
    // The second one has in its name what stands for the byte in the first one.
    let names = [&b"a\xFF.png"[..], "a\u{FFFD}FF.png".as_bytes(), b"a\xFE.png"];
    for name in names {
        let path = room.path("in").join(OsStr::from_bytes(name));
        if let Err(error) = fs::copy(&plain, path) {
            eprintln!("skipped: there are no such names here: {error}");
            return;
        }
    }
    let args = ["in", "--out", "out", "--manifest", "m.jsonl", "--resume"];
    let run = |status| room.batch(status, &[&args[..], &QUICK].concat()).0;
    run(0);
    let first = text(&room.read("m.jsonl"));
    let written = by_input(first.as_bytes());
    let texts =
        ["in/a\u{FFFD}EF\u{FFFD}BF\u{FFFD}BDFF.png", "in/a\u{FFFD}FE.png", "in/a\u{FFFD}FF.png"];
    assert!(written.keys().eq(texts.iter().chain(&["in/plain.png"])), "{written:?}");
    assert_eq!(written[texts[1]]["output"], "out/a\u{FFFD}FE.gip");
    run(0);
    assert_eq!(text(&room.read("m.jsonl")), first, "each is found again");

    // One of them is made again, and it alone.
    fs::remove_file(room.path("out").join(OsStr::from_bytes(b"a\xFE.gip"))).expect("it is there");
    assert!(run(0).contains(" 1 written, 3 skipped"));
    let lines = text(&room.read("m.jsonl"));
    assert_eq!(by_input(lines.as_bytes()).len(), names.len() + 1);
    assert!(lines.lines().next_back().expect("a line").contains(texts[1]), "{lines}");
}
