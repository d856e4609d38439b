//! The entropy coder against the one that the tests have from the specification alone.

#![no_main]

use image_gip_fuzz::coder::Case;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|case: Case| case.check());
