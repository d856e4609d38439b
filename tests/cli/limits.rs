//! Limits: what cannot be read is not written, and `--limit` is for all commands.

use image::{ColorType, DynamicImage, GrayImage};

use super::pictures;
use super::room::{Room, by_input};

const QUICK: [&str; 4] = ["--effort", "1", "--gaussians", "5"];

#[test]
fn a_picture_beyond_the_limits_is_refused_until_they_are_raised() {
    let room = Room::new();
    room.save_picture("in/tall.png", &DynamicImage::from(GrayImage::new(1, 65_537)));
    room.save_picture("in/small.png", &pictures::picture((20, 16), ColorType::L8));
    let encode = [&["encode", "in/tall.png", "a.gip"], &QUICK[..]].concat();
    let error = room.fails(&encode);
    assert!(error.contains("height: 65537 required, 65536 allowed"), "{error}");
    assert!(error.contains("--limit height=N"), "{error}");

    let raised = ["--limit", "height=70k"];
    room.ok(&[&encode[..], &raised].concat());
    let compare = ["compare", "in/tall.png", "a.gip"];
    for command in [&["decode", "a.gip", "a.png"][..], &["info", "a.gip"], &compare] {
        assert!(room.fails(command).contains("--limit height=N"), "{command:?}");
        room.ok(&[command, &raised].concat());
        room.ok(&[command, &["--limit", "none"]].concat());
    }

    // A batch refuses it at once, and again when it goes on; with the limit it is done, once.
    let batch = ["in", "--out", "out", "--manifest", "m.jsonl", "--resume"];
    let batch = [&batch[..], &QUICK].concat();
    for _ in 0..2 {
        let (_, errors) = room.batch(3, &batch);
        assert!(errors.contains("--limit height=N"), "{errors}");
        let manifest = by_input(&room.read("m.jsonl"));
        assert_eq!(manifest["in/tall.png"]["status"], "failed");
    }
    let with_limit = [&batch[..], &raised].concat();
    let source = std::fs::File::options().write(true).open(room.path("in/tall.png"));
    let long_ago = std::time::SystemTime::now() - std::time::Duration::from_secs(100);
    source.and_then(|file| file.set_modified(long_ago)).expect("our file");
    assert!(room.batch(0, &with_limit).0.contains(" 0 failed"));
    assert!(room.batch(0, &with_limit).0.contains(" 0 written, 2 skipped"));
    assert_eq!(by_input(&room.read("m.jsonl"))["in/tall.png"]["status"], "written");
    assert!(room.files("out").contains_key("tall.gip"));
}

#[test]
fn a_png_of_any_size_is_refused_for_its_size() {
    let room = Room::new();
    room.save_picture("a.png", &pictures::picture((20, 16), ColorType::L8));
    let mut file = room.read("a.png");
    // Width and height, and the checksum of the header.
    file[16..24].copy_from_slice(&[0x7F, 255, 255, 255].repeat(2));
    let checksum = crc32fast::hash(&file[12..29]);
    file[29..33].copy_from_slice(&checksum.to_be_bytes());
    room.write("a.png", file);
    let expected = "width: 2147483647 required, 65536 allowed";
    assert!(room.fails(&["encode", "a.png", "a.gip"]).contains(expected));
    assert!(room.batch(3, &["a.png", "--out", "out"]).1.contains(expected));
}

#[test]
fn limits_may_be_lowered_too() {
    let room = Room::new();
    for source in ["a.png", "a.tif"] {
        room.save_picture(source, &pictures::picture((60, 50), ColorType::Rgb8));
    }
    for (source, limit, name) in [
        ("a.png", "width=59", "width"),
        ("a.png", "pixels=2k", "pixels"),
        ("a.png", "gaussians=4", "gaussians"),
        ("a.png", "memory=100", "memory"),
        ("a.tif", "memory=100", "memory"),
    ] {
        let args = ["encode", source, "a.gip", "--limit", limit];
        let error = room.fails(&[&args[..], &QUICK].concat());
        assert!(error.contains(&format!("--limit {name}=N")), "{limit}: {error}");
        let (_, allowed) = limit.split_once('=').expect("there is one");
        let allowed = allowed.replace('k', "000");
        assert!(error.contains(&format!("required, {allowed} allowed")), "{limit}: {error}");
    }
    let usage = room.run(&["info", "a.gip", "--limit", "size=5"]);
    assert_eq!(usage.status.code(), Some(2));
    assert_eq!(room.names(), ["a.png", "a.tif"]);

    // 64 evaluations for a pixel are always allowed, and each Gaussian that is near takes them all.
    room.ok(&[&["encode", "a.png", "a.gip", "--limit", "work=1"], &QUICK[..]].concat());
    let small = ["decode", "a.gip", "small.png", "--region", "30,25,1,1", "--limit"];
    let error = room.fails(&[&small[..], &["work=1"]].concat());
    assert!(error.contains("65 allowed") && error.contains("--limit work=N"), "{error}");
    room.ok(&[&small[..], &["work=256"]].concat());
}
