//! The smallest run with events, about a second of work, and small bodies.

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

/// Overrides that make the built-in scenario `sheet-coarse` small enough to slip as a whole within half a
/// second: 13 x 4 nodes, pulled at one row, so that its ruptures are oblique.
pub(crate) const SHEET: [&str; 8] = [
    "slider.blocks=13",
    "slider.across=4",
    "slider.length_m=0.048",
    "slider.width_m=0.012",
    "slider.mass_kg=0.004",
    "normal_load.total_n=60",
    "drive.across=2",
    "time.duration_s=0.6",
];

/// Keys of a small `body-coarse`: 9 x 3 x 5 nodes.
pub(crate) const BODY: [&str; 11] = [
    "slider.blocks=9",
    "slider.across=3",
    "slider.rows=5",
    "slider.length_m=0.08",
    "slider.width_m=0.02",
    "slider.height_m=0.04",
    "slider.mass_kg=0.2592",
    "normal_load.total_n=1200",
    "drive.across=1",
    "time.step_s=8e-7",
    "time.duration_s=0.13",
];
