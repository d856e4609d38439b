//! Files of the day on which version 1 of the format was fixed: every later version must decode them to the same bits.

mod common;

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use common::{crc32, decode_valid, render};
use image_gip::RenderOptions;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// The lines of a table behind its headline, in columns.
fn table(path: &str) -> Vec<Vec<String>> {
    let table = fs::read_to_string(Path::new(ROOT).join(path)).expect("a table");
    let columns = |line: &str| line.split('\t').map(String::from).collect();
    table.lines().skip(1).map(columns).collect()
}

fn crc_of(path: &str) -> String {
    format!("{:08x}", crc32(&fs::read(Path::new(ROOT).join(path)).expect("a file")))
}

/// `tests/spec_vectors.rs` decodes them; this is about those that must remain.
#[test]
fn no_test_vector_has_changed() {
    let index = table("spec/vectors/index.tsv");
    let results: HashMap<_, _> =
        index.iter().map(|line| ((&line[0], &line[1]), &line[2])).collect();
    let frozen = table("tests/frozen/vectors.tsv");
    assert!(frozen.len() > 400);
    for line in &frozen {
        let [name, crc, rendering, result] = &line[..] else { panic!("{line:?}") };
        assert_eq!(crc_of(&format!("spec/vectors/{name}")), *crc, "{name}");
        assert_eq!(results.get(&(name, rendering)), Some(&result), "{name}, {rendering}");
    }
}

#[test]
fn pictures_have_the_samples_that_they_had() {
    let mut names = Vec::new();
    for line in table("tests/frozen/pictures.tsv") {
        let [name, crc, size, result] = &line[..] else { panic!("{line:?}") };
        let path = format!("tests/frozen/{name}");
        assert_eq!(crc_of(&path), *crc, "{name}");
        let decoder = decode_valid(&fs::read(Path::new(ROOT).join(path)).expect("a file"));
        let (width, height) = size.split_once('x').expect("width and height");
        let [width, height] = [width, height].map(|side| side.parse().expect("pixels"));
        let options = RenderOptions::new().with_size(width, height);
        assert_eq!(format!("{:08x}", render(&decoder, &options)), *result, "{name}, {size}");
        names.push(name.clone());
    }
    names.dedup();
    assert_eq!(names.len(), 10);
}
