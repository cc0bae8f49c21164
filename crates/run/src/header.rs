//! What a run is called, and by which program it was made.

use asperity_model::{Plan, Scenario};
use asperity_record::{RECORD_SCHEMA_VERSION, RunHeader};

/// A hash over the sources that shape a run: those of this crate and of every crate of the
/// workspace that it is built from. Runs of the same code version and the same scenario are the
/// same; a change to a figure or to the command line leaves it as it is.
pub const CODE_VERSION: &str = env!("ASPERITY_CODE_VERSION");

/// What a run of this scenario by this program says of itself in its log.
pub(crate) fn header(scenario: &Scenario, plan: &Plan, solver: &str) -> RunHeader {
    let mut header = RunHeader {
        record_schema_version: RECORD_SCHEMA_VERSION,
        scenario: scenario.name.clone(),
        scenario_hash: scenario.hash(),
        run_id: String::new(),
        code_version: CODE_VERSION.to_owned(),
        parameter_set: scenario.parameter_set.word().to_owned(),
        solver: solver.to_owned(),
        blocks: scenario.slider.blocks,
        rows: plan.elastic.layout().rows(),
        time_step_s: plan.grid.step_s(),
        longest_stable_step_s: Some(plan.longest_stable_step_s),
        steps: plan.steps,
        scales: Some(plan.scales),
    };
    header.run_id = run_id(&header);
    header
}

/// The id of a run with the rest of that header: a BLAKE3 hash over scenario, schema version
/// and code version, hexadecimal.
pub(crate) fn run_id(header: &RunHeader) -> String {
    let id = blake3::Hasher::new()
        .update(header.scenario_hash.as_bytes())
        .update(&header.record_schema_version.to_le_bytes())
        .update(header.code_version.as_bytes())
        .finalize();
    id.to_hex().to_string()
}
