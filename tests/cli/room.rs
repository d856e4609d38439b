//! A directory in which a test runs the tool.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};

use image::DynamicImage;
use serde_json::Value;
use tempfile::TempDir;

/// A directory for one test.
pub(crate) struct Room(TempDir);

impl Room {
    pub(crate) fn new() -> Self {
        Self(TempDir::new_in(env!("CARGO_TARGET_TMPDIR")).expect("the directory is writable"))
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Runs `gip` in this directory.
    pub(crate) fn run(&self, args: &[&str]) -> Output {
        self.pipe(args, &[])
    }

    /// Starts `gip` in this directory, with pipes.
    pub(crate) fn spawn(&self, args: &[&str]) -> Child {
        Command::new(env!("CARGO_BIN_EXE_gip"))
            .args(args)
            .current_dir(self.0.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the binary was built")
    }

    /// Runs `gip` in this directory with bytes on its standard input.
    pub(crate) fn pipe(&self, args: &[&str], input: &[u8]) -> Output {
        let mut gip = self.spawn(args);
        // A tool that fails early reads nothing; that is no failure of the test.
        let _ = gip.stdin.take().expect("piped").write_all(input);
        gip.wait_with_output().expect("the tool ends")
    }

    /// Runs `gip`, which must succeed, and returns what it printed.
    pub(crate) fn ok(&self, args: &[&str]) -> String {
        let output = self.run(args);
        assert!(output.status.success(), "{args:?}: {}", text(&output.stderr));
        text(&output.stdout)
    }

    pub(crate) fn json(&self, args: &[&str]) -> Value {
        let line = self.ok(args);
        assert_eq!(line.lines().count(), 1, "one object on one line: {line}");
        serde_json::from_str(&line).expect("JSON")
    }

    /// Runs `gip`, which must fail with one line of error; returns that line.
    pub(crate) fn fails(&self, args: &[&str]) -> String {
        let output = self.run(args);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{args:?}: {error}");
        assert!(error.starts_with("error: ") && error.lines().count() == 1, "{args:?}: {error}");
        assert!(output.stdout.is_empty(), "{args:?}");
        error
    }

    /// Runs `gip batch`, which must end with this status. Returns what it printed and the errors.
    #[track_caller]
    pub(crate) fn batch(&self, status: i32, args: &[&str]) -> (String, String) {
        let output = self.run(&[&["batch"], args].concat());
        let (printed, errors) = (text(&output.stdout), text(&output.stderr));
        assert_eq!(output.status.code(), Some(status), "{args:?}: {printed}{errors}");
        (printed, errors)
    }

    /// Saves a picture in the format of its name, and makes the folders that it is in.
    pub(crate) fn save_picture(&self, name: &str, picture: &DynamicImage) {
        self.write(name, "");
        picture.save(self.path(name)).expect("the format takes the colour type");
    }

    /// Writes a file, and the folders that it is in.
    pub(crate) fn write(&self, name: &str, contents: impl AsRef<[u8]>) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("writable");
        fs::write(path, contents).expect("writable");
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// All files below a folder with their paths in it; none if there is no folder.
    pub(crate) fn files(&self, folder: &str) -> BTreeMap<String, Vec<u8>> {
        let mut files = BTreeMap::new();
        let mut folders = vec![String::new()];
        while let Some(below) = folders.pop() {
            let Ok(entries) = fs::read_dir(self.path(folder).join(&below)) else { continue };
            for entry in entries {
                let entry = entry.expect("readable");
                let name = format!("{below}{}", entry.file_name().to_string_lossy());
                if entry.path().is_dir() {
                    folders.push(name + "/");
                } else {
                    files.insert(name, fs::read(entry.path()).expect("readable"));
                }
            }
        }
        files
    }

    /// The names of what is in the directory, sorted.
    pub(crate) fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).expect("the directory exists");
        let mut names: Vec<_> = entries
            .map(|entry| entry.expect("readable").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }
}

pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The lines of a manifest of `gip batch` by their inputs.
#[track_caller]
pub(crate) fn by_input(manifest: &[u8]) -> BTreeMap<String, Value> {
    let lines = text(manifest);
    let parse = |line: &str| -> (String, Value) {
        let value: Value = serde_json::from_str(line).expect("JSON");
        (value["input"].as_str().expect("a name").into(), value)
    };
    let by_input: BTreeMap<_, _> = lines.lines().map(parse).collect();
    assert_eq!(by_input.len(), lines.lines().count(), "a line per file: {lines}");
    by_input
}
