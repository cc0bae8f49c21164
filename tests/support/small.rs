//! The smallest run with events, about a second of work.

use std::path::Path;

use super::binary;

/// Twelve million steps of ten blocks: 28 slip events, most of them of one step.
pub(crate) const SCENARIO: [&str; 7] = [
    "ten-blocks",
    "--set",
    "parameter_set=as-coded",
    "--set",
    "time.step_s=1e-7",
    "--set",
    "time.duration_s=1.2",
];

/// Runs it and logs it.
pub(crate) fn run(out: &Path) {
    binary::run(&SCENARIO, out);
}
