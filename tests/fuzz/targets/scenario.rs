//! Scenario files and overrides, as far as the first step.

#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| asperity_fuzz::scenario(input));
