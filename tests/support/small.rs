//! The smallest run with events, about a second of work.

use std::path::Path;

use super::binary;

/// Overrides of `ten-blocks`: twelve million steps and 28 slip events, most of them of one step.
pub(crate) const SETS: [&str; 3] = ["parameter_set=as-coded", "time.step_s=1e-7", "time.duration_s=1.2"];

/// The scenario with them.
pub(crate) const SCENARIO: [&str; 7] = ["ten-blocks", "--set", SETS[0], "--set", SETS[1], "--set", SETS[2]];

/// Runs it and logs it.
pub(crate) fn run(out: &Path) {
    binary::run(&SCENARIO, out);
}
