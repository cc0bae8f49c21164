//! Built-in scenarios with overrides.

use asperity_model::scenario::builtin;
use asperity_model::{Plan, Scenario, ScenarioSource};

/// A built-in scenario with overrides, each `KEY=VALUE`, and its plan. It is as coded unless it or an
/// override names another parameter set: the events that tests expect are those of the thesis' program.
///
/// # Panics
/// If there is no such scenario, or it cannot be run.
pub fn scenario<S: AsRef<str>>(name: &str, sets: &[S]) -> (Scenario, Plan) {
    let text = builtin::find(name).unwrap_or_else(|| panic!("no built-in scenario {name}"));
    let source = ScenarioSource::new(name, text);
    let source = match source.named_set() {
        None => source.with_override("parameter_set=as-coded"),
        Some(_) => source,
    };
    let source = sets.iter().fold(source, |source, set| source.with_override(set.as_ref()));
    let scenario = Scenario::resolve(&source).unwrap_or_else(|errors| panic!("{errors}"));
    let plan = Plan::new(&scenario);
    (scenario, plan)
}

/// Overrides that make the built-in scenario `slab` small enough to slip within a moment: 9 x 5 nodes.
pub const SMALL_SLAB: [&str; 8] = [
    "slider.blocks=9",
    "slider.rows=5",
    "slider.height_m=0.07",
    "slider.mass_kg=7.56",
    "drive.velocity_m_per_s=4e-3",
    "drive.height_m=0.0175",
    "time.step_s=1e-5",
    "time.duration_s=0.2",
];

/// Overrides that make the built-in scenario `sheet-coarse` small enough to slip as a whole within half a
/// second: 13 x 4 nodes, pulled at one row, so that its ruptures are oblique.
pub const SMALL_SHEET: [&str; 8] = [
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
pub const SMALL_BODY: [&str; 11] = [
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

/// The plan of a built-in scenario with overrides.
///
/// # Panics
/// As [`scenario`] does.
pub fn plan<S: AsRef<str>>(name: &str, sets: &[S]) -> Plan {
    scenario(name, sets).1
}
