//! Any bytes give an error or a picture, and what has arrived can be rendered either way.

#![no_main]

use image_gip::StreamDecoder;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let mut decoder = StreamDecoder::new().with_limits(image_gip_fuzz::limits());
    let fed = decoder.feed(bytes);
    assert_eq!(fed.is_ok() && decoder.is_complete(), decoder.finish().is_ok());
    image_gip_fuzz::check(&decoder);
    image_gip_fuzz::check_prefixes(bytes, &decoder);
    let _orientation = decoder.orientation();
    image_gip_fuzz::decode_region(bytes);
});
