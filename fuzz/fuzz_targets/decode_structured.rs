//! Files that look valid reach the depths of the decoder; those that are valid are not refused.

#![no_main]

use image_gip::StreamDecoder;
use image_gip_fuzz::file::File;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|file: File| {
    let bytes = file.to_bytes();
    let mut decoder = StreamDecoder::new().with_limits(image_gip_fuzz::limits());
    let error = decoder.feed(&bytes).err();
    file.check(&decoder, error.as_ref());
    image_gip_fuzz::check(&decoder);
    image_gip_fuzz::check_prefixes(&bytes, &decoder);
});
