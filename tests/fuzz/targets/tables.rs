//! Tables of logs that were changed.

#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| asperity_fuzz::tables(input));
