//! The log reader over sound logs with changes, all checksums right.

#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| asperity_fuzz::log_edits(input));
