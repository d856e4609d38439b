//! `gip batch` that is interrupted, and `--resume`: whatever happens to a run, there are no
//! half-written files, and the next one ends with the same files as one that is not disturbed.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::Read;
use std::process::Output;
use std::time::{Duration, SystemTime};

use image::ColorType;
use serde_json::Value;

use super::pictures;
use super::room::{Room, by_input, text};

/// Options that make files of some 2,000 bytes quickly.
const QUICK: [&str; 6] = ["--effort", "1", "--gaussians", "50", "--precision", "f32"];
const PICTURES: usize = 6;

type Files = BTreeMap<String, Vec<u8>>;

/// A folder `in` with pictures, and the files that a run makes of them.
fn room_with_pictures() -> (Room, Files) {
    let room = Room::new();
    for number in 0..PICTURES {
        let name = format!("in/{}/{number}.png", number % 2);
        room.save_picture(&name, &pictures::picture((40 + number as u32, 32), ColorType::Rgb8));
    }
    batch(&room, 0, &["--out", "undisturbed", "--manifest", "undisturbed.jsonl"]);
    let files = room.files("undisturbed");
    assert_eq!(files.len(), PICTURES);
    (room, files)
}

fn args<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&["batch", "in"], &QUICK[..], more].concat()
}

/// Runs `gip batch in`, which must end with this status. Returns what it printed.
#[track_caller]
fn batch(room: &Room, status: i32, more: &[&str]) -> String {
    room.batch(status, &args(more)[1..]).0
}

/// Sets when a file was changed last, in seconds from now.
fn touch(room: &Room, name: &str, seconds: i64) {
    let now = SystemTime::now();
    let shift = Duration::from_secs(seconds.unsigned_abs());
    let time = if seconds < 0 { now - shift } else { now + shift };
    let file = File::options().write(true).open(room.path(name)).expect("it is there");
    file.set_modified(time).expect("our file");
}

/// A manifest without what differs from run to run: by input, the result's size and PSNR.
#[track_caller]
fn results(bytes: &[u8]) -> BTreeMap<String, [Value; 3]> {
    let fields = |line: Value| ["bytes", "psnr", "status"].map(|field| line[field].clone());
    by_input(bytes).into_iter().map(|(input, line)| (input, fields(line))).collect()
}

#[test]
fn what_is_whole_and_newer_is_skipped_and_all_else_made_again() {
    let (room, files) = room_with_pictures();
    for name in files.keys() {
        room.write(&format!("out/{name}"), &files[name]);
        touch(&room, &format!("in/{}", name.replace(".gip", ".png")), -100);
    }
    assert!(batch(&room, 0, &["--out", "out", "--resume"]).contains(" 0 written, 6 skipped"));

    let whole = &files["0/0.gip"];
    // Missing, incomplete, damaged, something else, older, and of the same time.
    fs::remove_file(room.path("out/0/0.gip")).expect("it is there");
    room.write("out/0/2.gip", &files["0/2.gip"][..whole.len() / 2]);
    let mut damaged = files["0/4.gip"].clone();
    damaged[whole.len() / 2] ^= 1;
    room.write("out/0/4.gip", damaged);
    room.write("out/1/1.gip", "something else");
    touch(&room, "out/1/3.gip", -200);
    let source = fs::metadata(room.path("in/1/5.png")).expect("it is there");
    let result = File::options().write(true).open(room.path("out/1/5.gip")).expect("there, too");
    result.set_modified(source.modified().expect("a time")).expect("our file");
    assert!(batch(&room, 0, &["--out", "out", "--resume"]).contains(" 6 written, 0 skipped"));
    assert_eq!(room.files("out"), files);

    // Without --resume everything is made, and with it options are not looked at.
    assert!(batch(&room, 0, &["--out", "out"]).contains(" 6 written, 0 skipped"));
    let other = ["--out", "out", "--resume", "--seed", "7"];
    assert!(batch(&room, 0, &other).contains(" 0 written, 6 skipped"));
}

#[test]
fn decoded_pictures_are_resumed_too() {
    let (room, files) = room_with_pictures();
    for name in files.keys() {
        touch(&room, &format!("undisturbed/{name}"), -100);
    }
    let run = ["batch", "undisturbed", "--decode", "--out", "png", "--resume"];
    room.ok(&run);
    let decoded = room.files("png");
    assert!(room.ok(&run).contains(" 0 written, 6 skipped"));
    let png = &decoded["1/3.png"];
    room.write("png/1/3.png", &png[..png.len() - 30]);
    assert!(room.ok(&run).contains(" 1 written, 5 skipped"));
    assert_eq!(room.files("png"), decoded);
    assert_eq!(decoded.len(), files.len());
}

#[test]
fn leftovers_are_removed_but_not_the_files_of_a_run_that_goes_on() {
    let (room, mut files) = room_with_pictures();
    room.write("out/0/.gip-k1LLed.tmp", "half of a file");
    room.write("out/0/.gip-in_use.tmp", "a name that is never given");
    room.write("out/1/.gip-inUse9.tmp", "half of a file");
    // What a run that goes on does.
    let in_use = File::open(room.path("out/1/.gip-inUse9.tmp")).expect("it is there");
    in_use.lock().expect("no one else has it");
    batch(&room, 0, &["--out", "out", "--resume"]);
    let found = room.files("out");
    let also = ["0/.gip-in_use.tmp", "1/.gip-inUse9.tmp"];
    files.extend(also.map(|name| (name.to_owned(), found[name].clone())));
    assert!(found.keys().eq(files.keys()), "{:?}", found.keys());
    assert_eq!(found, files);
    drop(in_use);
    batch(&room, 0, &["--out", "out", "--resume"]);
    assert!(!room.files("out").contains_key(also[1]), "its run has ended");
}

#[test]
fn the_manifest_is_continued() {
    let (room, _) = room_with_pictures();
    let run = ["--out", "out", "--manifest", "m.jsonl", "--resume"];
    batch(&room, 0, &run);
    let first = text(&room.read("m.jsonl"));
    assert_eq!(first.lines().count(), PICTURES);
    batch(&room, 0, &run);
    assert_eq!(text(&room.read("m.jsonl")), first, "nothing was done");

    // One line is torn, one is missing, one is of another run, and one failed.
    let lines: Vec<&str> = first.lines().collect();
    let failed = lines[1].replace("\"written\"", "\"failed\"");
    let foreign = lines[2].replace("in/", "elsewhere/").replace("out/", "elsewhere/");
    let input = |line: &str| -> String {
        let value: Value = serde_json::from_str(line).expect("JSON");
        value["input"].as_str().expect("a name").into()
    };
    let torn = &lines[0][..lines[0].len() / 2];
    room.write("m.jsonl", [lines[3], &foreign, &failed, lines[4], lines[5], torn].join("\n"));
    batch(&room, 0, &run);
    let found = text(&room.read("m.jsonl"));
    let found: Vec<&str> = found.lines().collect();
    assert_eq!(found[..4], [lines[3], &foreign, lines[4], lines[5]], "in their order");
    // They are whole, so they are skipped. What their results tell is in their new lines.
    let results = results(&room.read("m.jsonl"));
    for line in &lines[..3] {
        let [bytes, psnr, status] = &results[&input(line)];
        assert!(bytes.is_number() && psnr.is_null() && *status == "skipped", "{results:?}");
    }
    assert_eq!(results.len(), PICTURES + 1);

    // A line of a file that is made again is replaced.
    fs::remove_file(room.path("out/0/0.gip")).expect("it is there");
    batch(&room, 0, &run);
    let fresh = self::results(&room.read("m.jsonl"));
    assert_eq!(fresh["in/0/0.png"][2], "written");
    assert_eq!(fresh.len(), PICTURES + 1);

    // Something else is not taken for a manifest, and not replaced; a line that was torn is.
    room.write("m.jsonl", "precious\nwords\n");
    for run in [&run[..], &run[..4]] {
        let errors = room.fails(&args(run));
        assert!(errors.contains("m.jsonl") && errors.contains("line 1"), "{errors}");
        assert_eq!(room.read("m.jsonl"), b"precious\nwords\n");
    }
    room.write("m.jsonl", torn);
    batch(&room, 0, &run[..4]);
    assert_eq!(self::results(&room.read("m.jsonl")).len(), PICTURES);
}

/// What needs signals, limits of the shell, or mounts.
#[cfg(unix)]
mod killed {
    use super::*;
    use std::os::unix::process::ExitStatusExt;
    use std::process::{Child, Command, Stdio};

    const SIGINT: i32 = 2;
    const SIGKILL: i32 = 9;
    const SIGTERM: i32 = 15;

    impl Room {
        /// Runs a script of the shell, whose `$@` is `gip` with arguments.
        fn script(&self, script: &str, args: &[&str]) -> Output {
            Command::new("sh")
                .args(["-c", script, "sh", env!("CARGO_BIN_EXE_gip")])
                .args(args)
                .current_dir(self.path(""))
                .output()
                .expect("there is a shell")
        }
    }

    /// Waits until something holds, or the process has ended.
    fn wait(gip: &mut Child, holds: impl Fn() -> bool) {
        while !holds() && gip.try_wait().expect("our child").is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// Sends a signal, unless the process has ended, and waits for the end. Returns whether it ended
    /// by the signal, and what it printed.
    fn kill(mut gip: Child, signal: i32) -> (bool, String) {
        let kill = format!("kill -{signal} {}", gip.id());
        let _ = Command::new("sh").args(["-c", &kill]).stderr(Stdio::null()).status();
        let mut printed = String::new();
        let out = gip.stdout.as_mut().expect("piped").read_to_string(&mut printed);
        out.expect("text");
        let status = gip.wait().expect("our child");
        assert!(status.success() || status.signal() == Some(signal), "{status}");
        (!status.success(), printed)
    }

    fn is_temporary(name: &str) -> bool {
        name.contains(".gip-") && name.ends_with(".tmp")
    }

    #[test]
    fn killed_again_and_again_a_run_ends_with_the_same_files() {
        let (room, files) = room_with_pictures();
        let run = args(&["--out", "out", "--manifest", "m.jsonl", "--resume", "--jobs", "2"]);
        let lines = || text(&fs::read(room.path("m.jsonl")).unwrap_or_default()).lines().count();
        // After how many more lines of the manifest it is killed.
        for (signal, after) in [
            (SIGKILL, 0),
            (SIGKILL, 1),
            (SIGTERM, 1),
            (SIGINT, 0),
            (SIGINT, 1),
            (SIGKILL, 1),
            (SIGKILL, 0),
        ] {
            let before = lines();
            let mut gip = room.spawn(&run);
            wait(&mut gip, || lines() >= before + after && room.path("out").exists());
            kill(gip, signal);
            for (name, contents) in room.files("out").iter().filter(|(name, _)| !is_temporary(name))
            {
                assert_eq!(contents, &files[name], "{name} after {signal}");
            }
        }
        room.ok(&run);
        assert_eq!(room.files("out"), files);
        assert_eq!(room.names(), ["in", "m.jsonl", "out", "undisturbed", "undisturbed.jsonl"]);

        let mut found = results(&room.read("m.jsonl"));
        let expected = results(&room.read("undisturbed.jsonl"));
        for (input, result) in &mut found {
            // A run that is killed between a file and its line leaves the line to the next run,
            // which cannot know the PSNR.
            if result[2] == "skipped" {
                result[1..].clone_from_slice(&expected[input][1..]);
            }
        }
        assert_eq!(found, expected);
    }

    #[test]
    fn killed_while_it_writes_it_leaves_no_half_of_a_file() {
        let (room, files) = room_with_pictures();
        room.write("out/0/2.gip", "precious");
        // Writing more than 512 or 1,024 bytes to a file kills the process.
        let script = "ulimit -c 0; ulimit -f 1; exec \"$@\"";
        let output = room.script(script, &args(&["--out", "out", "--jobs", "1"]));
        assert!(output.status.signal().is_some(), "{}", output.status);
        let left = room.files("out");
        assert_eq!(left.len(), 2, "{:?}", left.keys());
        let temporary = left.keys().find(|name| is_temporary(name)).expect("it was being written");
        assert!(files["0/0.gip"].starts_with(&left[temporary]) && !left[temporary].is_empty());
        assert_eq!(left["0/2.gip"], b"precious");
        room.ok(&args(&["--out", "out", "--resume"]));
        assert_eq!(room.files("out"), files, "and no temporary file");
    }

    #[test]
    fn files_that_cannot_be_written_are_reported_and_unchanged() {
        let (room, files) = room_with_pictures();
        let flat = image::GrayImage::from_pixel(20, 20, image::Luma([77]));
        flat.save(room.path("in/flat.png")).expect("writable");
        room.write("out/0/2.gip", "precious");
        // Writing more than 512 or 1,024 bytes to a file is an error.
        let script = "trap '' XFSZ; ulimit -f 1; exec \"$@\"";
        let run = args(&["--out", "out", "--manifest", "-"]);
        let output = room.script(script, &run);
        assert_eq!(output.status.code(), Some(3), "{}", text(&output.stderr));
        let results = results(&output.stdout);
        let failed = results.values().filter(|[.., status]| status == "failed").count();
        assert_eq!((failed, results.len()), (PICTURES, PICTURES + 1));
        let errors = text(&output.stderr);
        for name in files.keys() {
            let error =
                errors.lines().find(|line| line.starts_with("error: ") && line.contains(name));
            assert!(error.is_some_and(|error| error.contains("too large")), "{name}: {errors}");
        }
        assert!(room.files("out").keys().eq(&["0/2.gip", "flat.gip"]));
        assert_eq!(room.read("out/0/2.gip"), b"precious");
        room.ok(&args(&["--out", "out", "--resume"]));
        assert_eq!(room.files("out").len(), PICTURES + 1);
    }

    #[test]
    fn a_full_disk_ends_the_run_which_can_be_resumed() {
        let (room, files) = room_with_pictures();
        // A disk of three pages, which hold a file each, in a space of mounts of its own.
        let alone = |script: &str, args: &[&str]| {
            let mount = "mkdir -p out && mount -t tmpfs -o size=12k none out";
            let script = format!("unshare -rm sh -c '{mount} || exit; {script}' sh \"$@\"");
            room.script(&script, args)
        };
        let probe = alone("", &[]);
        if !probe.status.success() {
            eprintln!("skipped: no disk can be mounted here: {}", text(&probe.stderr));
            return;
        }
        let script = "\"$@\"; status=$?
            cp -r out after; mount -o remount,size=1m out
            \"$@\" --resume --manifest m.jsonl && cp -r out end && exit $status";
        let output = alone(script, &args(&["--jobs", "1", "--out", "out"]));
        let (printed, errors) = (text(&output.stdout), text(&output.stderr));
        assert_eq!(output.status.code(), Some(3), "{printed}{errors}");
        let after = room.files("after");
        assert!(!after.is_empty() && after.len() < PICTURES, "{:?}", after.keys());
        assert!(after.iter().all(|(name, contents)| files[name] == *contents));
        let note = "1 failed, 2 left";
        assert!(printed.contains(note) && printed.contains("the disk is full"), "{printed}");
        assert!(errors.lines().count() == 1 && errors.contains("No space left"), "{errors}");
        assert_eq!(room.files("end"), files);
    }

    #[test]
    fn a_signal_stops_an_encoding_at_once() {
        let room = Room::new();
        room.save_picture("in/large.png", &pictures::picture((400, 300), ColorType::Rgb8));
        for signal in [SIGINT, SIGTERM] {
            let mut gip = room.spawn(&["batch", "in", "--out", "out", "--effort", "7"]);
            wait(&mut gip, || room.path("out").exists());
            // Long enough to begin, and little of the seconds that it would take.
            std::thread::sleep(Duration::from_millis(100));
            let (ended_by_signal, printed) = kill(gip, signal);
            assert!(ended_by_signal, "{printed}");
            let expected = "1 file: 0 written, 0 skipped, 0 failed, 1 left; ";
            assert!(printed.starts_with(expected) && printed.contains("--resume"), "{printed}");
            assert!(room.files("out").is_empty());
            fs::remove_dir(room.path("out")).expect("it is empty");
        }
    }
}
