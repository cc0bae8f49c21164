//! The log reader over any bytes.

#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| asperity_fuzz::log_bytes(input));
