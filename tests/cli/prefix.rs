//! `gip prefix`, and what `gip encode --first-layer` and `gip info` have to do with it.

use image::ColorType;

use super::pictures;
use super::room::{Room, text};

/// A room with a file of several layers, of which the first makes a file of at most 300 bytes.
fn room() -> Room {
    let room = Room::new();
    room.save_picture("a.png", &pictures::picture((160, 120), ColorType::Rgb8));
    let options = ["--gaussians", "600", "--effort", "1", "--first-layer", "300"];
    room.ok(&[&["encode", "a.png", "a.gip"], &options[..]].concat());
    room
}

#[test]
fn the_first_layers_become_a_file() {
    let room = room();
    let info = room.json(&["info", "a.gip", "--json"]);
    let prefixes = info["prefixes"].as_array().expect("an array");
    assert_eq!(prefixes.len() as u64, info["layers"].as_u64().expect("a number"));
    assert!(prefixes.len() > 1, "{info}");
    let first = &prefixes[0];
    let bytes = first["bytes"].as_u64().expect("a number");
    assert!((200..=300).contains(&bytes), "{first}");
    assert!(first["end"].as_u64() <= first["bytes"].as_u64(), "{first}");
    let row = format!("{} Gaussians, {bytes} bytes", first["gaussians"]);
    assert!(room.ok(&["info", "a.gip"]).contains(&row), "{row}");

    let printed = room.ok(&["prefix", "a.gip", "300", "small.gip"]);
    let expected = format!(
        "small.gip: 1 of {} layers, {} Gaussians, {bytes} bytes\n",
        prefixes.len(),
        first["gaussians"]
    );
    assert_eq!(printed, expected);
    assert_eq!(room.read("small.gip").len() as u64, bytes);
    let small = room.json(&["info", "small.gip", "--json"]);
    assert_eq!(small["gaussians"], first["gaussians"]);
    room.ok(&["decode", "small.gip", "small.png"]);

    // From a pipe to a pipe, where the beginning of the file is enough.
    let beginning = &room.read("a.gip")[..first["end"].as_u64().expect("a number") as usize];
    let output = room.pipe(&["prefix", "-", "300", "-"], beginning);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(output.stdout, room.read("small.gip"));
}

#[test]
fn what_cannot_be_done_is_told_and_leaves_the_output_alone() {
    let room = room();
    room.write("small.gip", "it was here before");
    room.write("picture.png", "no .gip");
    room.write("cut.gip", &room.read("a.gip")[..40]);
    for (args, status, expected) in [
        (["prefix", "a.gip", "60", "small.gip"], 2, "a.gip: the file of its first layer has "),
        (["prefix", "cut.gip", "900", "small.gip"], 1, "cut.gip: has no complete layer"),
        (["prefix", "picture.png", "900", "small.gip"], 1, "not a .gip file"),
        (["prefix", "none.gip", "900", "small.gip"], 1, "none.gip"),
        (["prefix", "a.gip", "300", "./a.gip"], 1, "a.gip is the input; use another name"),
        (["prefix", "a.gip", "many", "small.gip"], 2, "many"),
        (
            ["prefix", "a.gip", "300", "picture.png"],
            1,
            "picture.png: gip prefix writes .gip files only",
        ),
    ] {
        let output = room.run(&args);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(status), "{error}");
        assert!(error.contains(expected), "{error}");
        assert_eq!(room.read("small.gip"), b"it was here before");
        assert_eq!(room.read("picture.png"), b"no .gip");
    }
    room.ok(&["prefix", "a.gip", "300", "picture.png", "--force"]);
    assert!(room.read("picture.png").starts_with(b"\xC7GIP"));
    let small = ["encode", "a.png", "b.gip", "--first-layer", "79"];
    let output = room.run(&small);
    assert_eq!(output.status.code(), Some(2));
    let error = text(&output.stderr);
    assert!(error.contains("79 is not in 80..=65536"), "{error}");
}
