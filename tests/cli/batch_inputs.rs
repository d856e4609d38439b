//! The files that `gip batch` finds: all kinds of names, and a line of the manifest for each.

use std::fs;

use image::ColorType;
use serde_json::Value;

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

#[test]
fn pictures_that_are_not_read_are_named_and_other_files_counted() {
    let room = Room::new();
    for name in ["in/a.png", "in/2024/b.JPG"] {
        room.save_picture(name, &pictures::picture((40, 32), ColorType::Rgb8));
    }
    for name in ["in/2024/c.HEIC", "in/d.cr3", "in/2024/e.avif", "in/f.txt", "in/g"] {
        room.write(name, "not looked at");
    }
    let args = ["in", "--out", "out", "--manifest", "m.jsonl", "--resume"];
    let run = |more: &[&str]| room.batch(0, &[&args[..], &QUICK, more].concat());
    let (printed, errors) = run(&[]);
    assert!(printed.starts_with("2 files: 2 written, 0 skipped, 0 failed, 0 left"), "{printed}");
    let warning = "warning: 3 pictures of formats that are not read left out \
                   (1 .avif, 1 .cr3, 1 .heic): in/2024/c.HEIC, in/2024/e.avif, in/d.cr3\n";
    let note = "note: 2 other files left out (1 .txt, 1 without extension)\n";
    assert_eq!(errors, format!("{warning}{note}"));
    let first = text(&room.read("m.jsonl"));
    let manifest = by_input(first.as_bytes());
    let names = ["2024/b.JPG", "2024/c.HEIC", "2024/e.avif", "a.png", "d.cr3"];
    assert!(manifest.keys().eq(&names.map(|name| format!("in/{name}"))), "{manifest:?}");
    let line = &manifest["in/d.cr3"];
    assert_eq!((&line["status"], &line["output"]), (&"ignored".into(), &Value::Null));
    assert_eq!((&line["input_bytes"], &line["bytes"]), (&13.into(), &Value::Null));
    let reason = line["error"].as_str().expect("a reason");
    assert!(reason.starts_with("in/d.cr3: ") && reason.contains("not read"), "{reason}");

    // They are told again, and there is a line of each still.
    assert_eq!(run(&[]).1, errors);
    assert_eq!(text(&room.read("m.jsonl")), first);
    // What one leaves out oneself need not be told, and what is said of it is kept.
    assert_eq!(
        run(&["--exclude", "c.heic", "--exclude", "*.cr3", "--include", "*.*"]).1.lines().count(),
        2
    );
    assert_eq!(run(&["--include", "*.png", "--include", "*.jpg"]).1, "");
    assert_eq!(text(&room.read("m.jsonl")), first);
    // One that is read after all has one line, too.
    room.save_picture("in/d.png", &pictures::picture((40, 32), ColorType::Rgb8));
    fs::rename(room.path("in/d.png"), room.path("in/d.cr3")).expect("in one folder");
    let named = ["in/d.cr3", "--out", "out", "--manifest", "m.jsonl", "--resume"];
    room.batch(0, &[&named[..], &QUICK].concat());
    let manifest = by_input(&room.read("m.jsonl"));
    assert_eq!((manifest.len(), &manifest["in/d.cr3"]["status"]), (names.len(), &"written".into()));

    // Where .gip files are decoded, nothing else is expected to be.
    let (_, errors) = room.batch(0, &["in", "out", "--decode", "--out", "back"]);
    assert!(errors.starts_with("note: 7 other files left out (") && errors.lines().count() == 1);
    let (_, errors) = room.batch(2, &["in", "--out", "out", "--include", "a["]);
    assert!(errors.contains("a["), "{errors}");
}

#[test]
#[cfg(unix)]
fn folders_that_cannot_be_read_are_failures() {
    let room = Room::new();
    room.save_picture("in/a.png", &pictures::picture((40, 32), ColorType::Rgb8));
    // A path that is too long for the system, whatever the rights are.
    let script = "cd in; for i in $(seq 20); do mkdir $0 && cd -P $0 || exit; done";
    let mut shell = std::process::Command::new("sh");
    let made = shell.args(["-c", script, &"d".repeat(250)]).current_dir(room.path("")).status();
    assert!(made.expect("there is a shell").success());
    let args = ["in", "--out", "out", "--manifest", "m.jsonl", "--resume"];
    for resumed in [false, true] {
        let (printed, errors) = room.batch(3, &[&args[..], &QUICK].concat());
        let done = if resumed { "0 written, 1 skipped" } else { "1 written, 0 skipped" };
        assert!(printed.starts_with(&format!("2 files: {done}, 1 failed, 0 left")), "{printed}");
        assert!(errors.starts_with("error: in/ddd") && errors.lines().count() == 1, "{errors}");
        let manifest = by_input(&room.read("m.jsonl"));
        let (_, line) = manifest.last_key_value().expect("a line");
        assert_eq!((manifest.len(), &line["status"]), (2, &"failed".into()));
        assert_eq!(format!("error: {}\n", line["error"].as_str().expect("a text")), errors);
    }
    fs::remove_dir_all(room.path("in").join("d".repeat(250))).expect("ours");
    room.batch(0, &[&args[..], &QUICK].concat());
}

#[test]
fn decoded_pictures_replace_no_file_of_an_input() {
    let room = Room::new();
    for name in ["in/a.png", "in/b/c.png"] {
        room.save_picture(name, &pictures::picture((40, 32), ColorType::Rgb8));
    }
    room.batch(0, &[&["in", "--out", "in"], &QUICK[..]].concat());
    room.batch(0, &[&["in", "--out", "in"], &QUICK[..]].concat());
    let before = room.files("in");
    for (inputs, out) in [
        (&["in"][..], "in"),
        (&["in/b", "in"], "in/b/.."),
        (&["in/a.gip"], "in"),
        (&["in/b/c.gip"], "in/b"),
        #[cfg(unix)]
        (&["link"], "in"),
        #[cfg(unix)]
        (&["in"], "link"),
    ] {
        #[cfg(unix)]
        let _ = std::os::unix::fs::symlink("in", room.path("link"));
        for task in [&["--decode"][..], &["--thumbnail", "8"]] {
            let (printed, errors) = room.batch(2, &[inputs, &["--out", out], task].concat());
            assert!(errors.contains("a.png") || errors.contains("c.png"), "{errors}");
            assert!(errors.starts_with("error: results would replace") && printed.is_empty());
        }
    }
    assert_eq!(room.files("in"), before);
    // One that is newer is taken for the result; another format has other names.
    room.batch(0, &["in", "--out", "in", "--decode", "--format", "bmp"]);
    room.batch(0, &["in", "--out", "in", "--decode", "--format", "bmp", "--resume"]);
    room.batch(2, &["in", "--out", "in", "--decode", "--resume"]);
    assert!(before.iter().all(|(name, bytes)| room.files("in")[name] == *bytes));
    room.batch(0, &["in", "--out", "elsewhere", "--decode"]);
    room.batch(0, &["in", "--out", "elsewhere", "--decode"]);
}

#[test]
fn results_in_a_folder_of_an_input_are_replaced_if_the_manifest_knows_them() {
    let room = Room::new();
    let picture = pictures::picture((40, 32), ColorType::Rgb8);
    for name in ["in/a.png", "in/b/c.png"] {
        room.save_picture(name, &picture);
    }
    room.batch(0, &[&["in", "--out", "gips"], &QUICK[..]].concat());
    let thumbs = ["gips", "--out", "gips/thumbs", "--thumbnail", "16"];
    let known = [&thumbs[..], &["--manifest", "m.jsonl"]].concat();
    room.batch(0, &known);
    let (_, errors) = room.batch(2, &thumbs);
    assert!(errors.contains("would replace") && errors.contains("--manifest"), "{errors}");
    for options in [&[][..], &["--resume"], &["--thumbnail", "8"]] {
        let args = match options {
            ["--thumbnail", _] => [&known[..3], options, &known[5..]].concat(),
            _ => [&known, options].concat(),
        };
        room.batch(0, &args);
    }
    // What has come in the place of a result since then is another file.
    room.save_picture("gips/thumbs/a.png", &picture);
    let before = room.files("gips");
    let (_, errors) = room.batch(2, &known);
    assert!(errors.contains("thumbs/a.png") && !errors.contains("c.png"), "{errors}");
    assert_eq!(room.files("gips"), before);
}

#[test]
#[cfg(unix)]
fn an_ignore_file_that_is_a_pipe_ends_the_run() {
    let room = Room::new();
    for folder in ["in", "in/b"] {
        room.save_picture("in/b/a.png", &pictures::picture((40, 32), ColorType::Rgb8));
        let name = format!("{folder}/.gipignore");
        let made = std::process::Command::new("mkfifo").arg(room.path(&name)).status();
        assert!(made.expect("there is mkfifo").success());
        let errors = room.fails(&["batch", "in", "--out", "out"]);
        assert_eq!(errors, format!("error: {name}: not a file\n"));
        fs::remove_file(room.path(&name)).expect("it is there");
    }
}

#[test]
fn a_manifest_replaces_no_other_file() {
    let room = Room::new();
    room.save_picture("in/a.png", &pictures::picture((40, 32), ColorType::Rgb8));
    for name in ["in/x.heic", "in/notes.txt", "in/.hidden.png", "in/no-end", "other.json"] {
        for contents in ["precious\n", "{}\n", "precious", "{\"a\":", "\n"] {
            room.write(name, contents);
            let errors = room.fails(&["batch", "in", "--out", "out", "--manifest", name]);
            assert!(errors.contains(name) && errors.contains("not replaced"), "{errors}");
            assert_eq!(room.read(name), contents.as_bytes());
        }
    }
    assert!(!room.path("out").exists(), "nothing is done");
    room.write("empty", "");
    room.batch(0, &[&["in", "--out", "out", "--manifest", "empty"], &QUICK[..]].concat());
    room.batch(0, &[&["in", "--out", "out", "--manifest", "empty"], &QUICK[..]].concat());
    assert_eq!(by_input(&room.read("empty")).len(), 2);
}

#[test]
fn an_ignore_file_that_cannot_be_read_ends_the_run() {
    let room = Room::new();
    room.save_picture("in/b/a.png", &pictures::picture((40, 32), ColorType::Rgb8));
    let utf16 = |bom: &[u8], text: &str| {
        [bom, &text.encode_utf16().flat_map(u16::to_be_bytes).collect::<Vec<_>>()].concat()
    };
    for (contents, line) in [
        (utf16(b"\xFE\xFF", "*.png\n"), 1),
        (utf16(b"", "*.png\n"), 1),
        (b"good\r\n[\r\n*.png".to_vec(), 2),
        (b"good\n\n{a".to_vec(), 3),
        (b"# caf\xE9".to_vec(), 1),
    ] {
        for folder in ["in", "in/b"] {
            let name = format!("{folder}/.gipignore");
            room.write(&name, &contents);
            let errors = room.fails(&["batch", "in", "--out", "out"]);
            assert!(errors.contains(&format!("{name}: line {line}")), "{errors}");
            fs::remove_file(room.path(&name)).expect("it is there");
        }
    }
    fs::create_dir(room.path("in/b/.gipignore")).expect("writable");
    let errors = room.fails(&["batch", "in", "--out", "out"]);
    assert!(errors.contains("in/b/.gipignore: "), "{errors}");
    fs::remove_dir(room.path("in/b/.gipignore")).expect("it is there");
    room.write("in/.gipignore", "\u{feff}a.png\r\n");
    let (printed, _) = room.batch(0, &["in", "--out", "out"]);
    assert!(printed.starts_with("0 files"), "{printed}");
}
