//! The vector code of this machine and of the least of its kind give the bits of the reference code.

#![no_main]

use image_gip::StreamDecoder;
use image_gip_fuzz::file::File;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|file: File| {
    let mut decoder = StreamDecoder::new().with_limits(image_gip_fuzz::limits());
    // What came before an error is rendered, too.
    let _ = decoder.feed(&file.to_bytes());
    image_gip_fuzz::check_levels(&decoder);
});
