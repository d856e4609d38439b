//! `gip batch --shards`: tar files as WebDataset reads them.

use std::fs;
use std::time::{Duration, SystemTime};

use image::ColorType;

use super::pictures;
use super::room::{Room, by_input};

const QUICK: [&str; 4] = ["--effort", "1", "--gaussians", "20"];
const NAMES: [&str; 5] = ["a.b.png", "c.png", "d/e.png", "d/f.png", "g.png"];

fn room() -> Room {
    let room = Room::new();
    for name in NAMES {
        room.save_picture(&format!("in/{name}"), &pictures::picture((48, 32), ColorType::Rgb8));
    }
    room
}

fn batch(room: &Room, status: i32, args: &[&str]) -> (String, String) {
    room.batch(status, &[&["in", "--out", "out", "--shards", "2"], args, &QUICK].concat())
}

/// The names and contents of the members of a tar file.
fn members(tar: &[u8]) -> Vec<(String, Vec<u8>)> {
    let (mut found, mut at) = (Vec::new(), 0);
    while tar[at] != 0 {
        let field = |from: usize, length: usize| {
            let text = String::from_utf8_lossy(&tar[at + from..][..length]).into_owned();
            text.trim_end_matches('\0').to_owned()
        };
        let size = usize::from_str_radix(&field(124, 12), 8).expect("octal");
        found.push((field(0, 100), tar[at + 512..][..size].to_vec()));
        at += 512 + size.next_multiple_of(512);
    }
    assert_eq!(tar.len() - at, 1024);
    found
}

#[test]
fn members_are_the_files_that_there_would_be() {
    let room = room();
    let (printed, _) = batch(&room, 0, &["--manifest", "m.jsonl", "--jobs", "2"]);
    assert!(printed.starts_with("5 files: 5 written, 0 skipped, 0 failed, 0 left; "), "{printed}");
    let shards = room.files("out");
    assert!(shards.keys().eq(&["000000.tar", "000001.tar", "000002.tar"]), "{:?}", shards.keys());
    room.batch(0, &[&["in", "--out", "single"], &QUICK[..]].concat());
    let single = room.files("single");
    let all: Vec<_> = shards.values().flat_map(|shard| members(shard)).collect();
    let names = ["a_b.gip", "c.gip", "d/e.gip", "d/f.gip", "g.gip"];
    assert!(all.iter().map(|(name, _)| name).eq(&names), "{all:?}");
    assert!(all.iter().map(|(_, bytes)| bytes).eq(single.values()));
    let manifest = by_input(&room.read("m.jsonl"));
    assert_eq!(manifest["in/d/f.png"]["output"], "out/000001.tar/d/f.gip");
    assert_eq!(manifest["in/d/f.png"]["bytes"], single["d/f.gip"].len());
    // The same files, whatever the number of jobs.
    room.batch(
        0,
        &[&["in", "--out", "again", "--shards", "2", "--jobs", "1"], &QUICK[..]].concat(),
    );
    assert_eq!(room.files("again"), shards);
}

#[test]
fn a_bad_picture_is_left_out_and_tried_again() {
    let room = room();
    let good = room.read("in/c.png");
    room.write("in/c.png", &good[..40]);
    room.write("in/g.png", &good[..40]);
    let (printed, errors) = batch(&room, 3, &["--manifest", "m.jsonl"]);
    assert!(printed.starts_with("5 files: 3 written, 0 skipped, 2 failed, 0 left; "), "{printed}");
    assert!(errors.contains("in/c.png: "), "{errors}");
    assert!(errors.contains("000002.tar: none of its pictures could be read"), "{errors}");
    let shards = room.files("out");
    assert!(shards.keys().eq(&["000000.tar", "000001.tar"]), "{:?}", shards.keys());
    assert_eq!(members(&shards["000000.tar"]).len(), 1);
    assert_eq!(by_input(&room.read("m.jsonl"))["in/c.png"]["status"], "failed");

    room.write("in/c.png", &good);
    room.write("in/g.png", &good);
    let (printed, _) = batch(&room, 0, &["--resume", "--manifest", "m.jsonl"]);
    assert!(printed.starts_with("5 files: 3 written, 2 skipped, 0 failed, 0 left; "), "{printed}");
    let manifest = by_input(&room.read("m.jsonl"));
    assert_eq!(manifest.len(), 5);
    assert!(manifest.values().all(|line| line["status"] == "written"), "{manifest:?}");
}

#[test]
fn only_what_is_old_or_damaged_is_made_again() {
    let room = room();
    batch(&room, 0, &[]);
    let whole = room.files("out");
    room.write("out/000001.tar", &whole["000001.tar"][..700]);
    let picture = fs::File::options().write(true).open(room.path("in/g.png")).expect("it is there");
    let later = SystemTime::now() + Duration::from_secs(3);
    picture.set_modified(later).expect("it is ours");
    let (printed, _) = batch(&room, 0, &["--resume"]);
    assert!(printed.starts_with("5 files: 3 written, 2 skipped, 0 failed, 0 left; "), "{printed}");
    assert_eq!(room.files("out"), whole);
}

#[test]
fn shards_beyond_the_last_one_are_refused() {
    let room = room();
    batch(&room, 0, &[]);
    let before = room.files("out");
    for resume in [&[][..], &["--resume"]] {
        let args = ["in", "--out", "out", "--shards", "3"];
        let (_, error) = room.batch(2, &[&args[..], &QUICK, resume].concat());
        assert!(error.contains("which is 000001.tar: 000002.tar; remove"), "{error}");
        assert_eq!(room.files("out"), before);
    }
    fs::remove_file(room.path("out/000002.tar")).expect("it is ours");
    // Names that no run writes.
    for name in ["other.tar", "2.tar", "0000007.tar", "000007.tar.gz"] {
        room.write(&format!("out/{name}"), "");
    }
    room.batch(0, &[&["in", "--out", "out", "--shards", "3"], &QUICK[..]].concat());
    assert_eq!(room.files("out").len(), 6);
}

#[test]
fn decoded_pictures_are_members_too() {
    let room = room();
    room.batch(0, &[&["in", "--out", "gips"], &QUICK[..]].concat());
    room.batch(0, &["gips", "--out", "back", "--decode", "--format", "jpg", "--shards", "9"]);
    let members = members(&room.read("back/000000.tar"));
    assert_eq!(members[4].0, "g.jpg");
    assert!(members.iter().all(|(_, bytes)| bytes.starts_with(b"\xff\xd8")));
    let output = room.run(&["batch", "in", "--out", "x", "--shards", "2", "--preserve-times"]);
    assert_eq!(output.status.code(), Some(2));
}
