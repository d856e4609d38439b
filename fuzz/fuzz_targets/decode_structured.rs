//! Files that look valid reach the depths of the decoder; those that are valid are not refused.

#![no_main]

use image_gip::{DecodeError, StreamDecoder};
use image_gip_fuzz::file::File;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|file: File| {
    let bytes = file.to_bytes();
    let mut decoder = StreamDecoder::with_limits(image_gip_fuzz::limits());
    let fed = decoder.feed(&bytes);
    if file.is_sound() {
        match fed {
            Ok(used) => {
                assert_eq!(used, bytes.len());
                assert!(decoder.is_complete());
            }
            Err(DecodeError::Limit { .. }) => {}
            Err(error) => panic!("a sound file was refused: {error}"),
        }
    }
    image_gip_fuzz::check(&decoder);
});
