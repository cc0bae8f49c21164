//! The metadata that open and close a log.

#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| asperity_fuzz::metadata(input));
