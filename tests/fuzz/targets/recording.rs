//! Files of recordings.

#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| asperity_fuzz::recording(input));
