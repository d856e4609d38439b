//! The test vectors of the specification, in every rendering of their index.

mod common;

use std::fs;

use common::{Differences, Request, decode, renderer};

const VECTORS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../spec/vectors");

/// The rendering of a line of the index. All are compared as RGBA with 8 bits.
fn request(rendering: &str) -> Request {
    let pair = |text: &str, separator| {
        let (a, b) = text.split_once(separator).expect("two numbers");
        let number = |text: &str| text.parse::<u32>().expect("a number");
        (number(a), number(b))
    };
    let mut request = Request::WHOLE;
    for part in rendering.split(", ") {
        match part.split(' ').collect::<Vec<_>>().as_slice() {
            ["whole"] | ["as", _] => {}
            ["size", size] => request.size = Some(pair(size, 'x')),
            ["region", size, "at", corner] => {
                let ((width, height), (x, y)) = (pair(size, 'x'), pair(corner, ','));
                request = request.region(x, y, width, height);
            }
            ["without", "texture"] => request = request.without_texture(),
            ["first", count] => request.prefix = Some(count.parse().expect("a number")),
            _ => panic!("an unknown rendering: {rendering}"),
        }
    }
    request
}

#[test]
fn every_vector_is_close_to_the_decoder() {
    let Some(renderer) = renderer() else { return };
    let index = fs::read_to_string(format!("{VECTORS}/index.tsv")).expect("the index");
    let mut renderings = 0;
    let mut all = Differences::default();
    for line in index.lines().skip(1) {
        let [name, rendering, _, _] = line.split('\t').collect::<Vec<_>>()[..] else {
            panic!("not four columns: {line}");
        };
        // Where Gaussians all but cancel, the last bits show, which are each driver's own.
        let cancels = name.starts_with("cancelling-") || name.starts_with("coarse-");
        if cancels || rendering == "error" || rendering == "skips" {
            continue;
        }
        let file = fs::read(format!("{VECTORS}/{name}")).expect("a vector");
        let decoder = decode(&file);
        let picture = decoder.picture().expect("a header");
        let differences = Differences::of(renderer, &picture, &request(rendering));
        differences.assert_close(&format!("{name}, {rendering}"));
        all.add(differences);
        renderings += 1;
    }
    println!("{renderings} renderings: {all:?}");
    assert!(renderings > 80, "{renderings} renderings");
}
