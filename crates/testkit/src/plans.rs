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

/// The plan of a built-in scenario with overrides.
///
/// # Panics
/// As [`scenario`] does.
pub fn plan<S: AsRef<str>>(name: &str, sets: &[S]) -> Plan {
    scenario(name, sets).1
}
