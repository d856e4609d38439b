//! What fuzzing has found, one test each.

mod common;

use common::entropy::Code;
use common::{File, Header, RGB, decode, of_chunks, without_last_word};
use image_gip::Decoder;

/// Of the target `buf_independent`: two layers so short that they are read at once, the first without its
/// last word, the second with a wrong CRC. The error must be that of the first.
#[test]
fn what_is_wrong_with_the_first_layer_is_told_first() {
    let header = Header { color: RGB, ..Header::default() };
    let code = Code { axes: vec![1, 2, 3], center: [2000, 3000], ..Code::default() };
    let file = File::of_entropy_coded(header, vec![0.5; 7], vec![vec![code; 3]; 2]);
    let mut chunks = file.chunks();
    chunks[1] = without_last_word(&chunks[1]);
    *chunks[2].last_mut().expect("a CRC") ^= 1;
    let bytes = of_chunks(&chunks);
    let expected = decode(&bytes).1.expect_err("damaged").to_string();
    let mut decoder = Decoder::new(bytes.as_slice()).expect("it begins well");
    let found = decoder.read_to_end().expect_err("damaged").to_string();
    assert_eq!(found, expected);
    assert!(!found.contains("CRC"), "{found}");
}
