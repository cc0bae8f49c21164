//! The header of a run: what identifies it and the program that made it.

use asperity_model::{Plan, Scenario};
use asperity_record::{Parts, RECORD_SCHEMA_VERSION, RunHeader};

/// A hash over the sources that shape a run: those of this crate and of every workspace crate that
/// it depends on. Runs of equal code version and scenario are equal; changes to figures or the
/// command line do not change it.
pub const CODE_VERSION: &str = env!("ASPERITY_CODE_VERSION");

/// The same hash with the sources that read recordings besides.
pub(crate) const RECORDING_CODE_VERSION: &str = env!("ASPERITY_RECORDING_CODE_VERSION");

/// Whether this version of the program made the log with that header.
pub(crate) fn is_ours(header: &RunHeader) -> bool {
    header.code_version == if header.sensors.is_some() { RECORDING_CODE_VERSION } else { CODE_VERSION }
}

/// The header that this program writes into the log of a scenario's run.
pub(crate) fn header(scenario: &Scenario, plan: &Plan, solver: &str) -> RunHeader {
    let mut header = RunHeader {
        record_schema_version: RECORD_SCHEMA_VERSION,
        scenario: scenario.name.clone(),
        scenario_hash: scenario.hash(),
        run_id: String::new(),
        code_version: CODE_VERSION.to_owned(),
        parameter_set: scenario.parameter_set.word().to_owned(),
        solver: solver.to_owned(),
        blocks: scenario.slider.contacts(),
        rows: plan.elastic.layout().rows(),
        junction_count: scenario.junction_count(),
        flags: Parts { junctions: false, area: false, ..scenario.parts() },
        time_step_s: plan.grid.step_s(),
        longest_stable_step_s: Some(plan.longest_stable_step_s).filter(|longest_s| longest_s.is_finite()),
        steps: plan.steps,
        scales: plan.scales,
        sensors: None,
    };
    header.run_id = run_id(&header);
    header
}

/// The id of the run with that header: a BLAKE3 hash over scenario, schema version and code
/// version, hexadecimal.
pub(crate) fn run_id(header: &RunHeader) -> String {
    let id = blake3::Hasher::new()
        .update(header.scenario_hash.as_bytes())
        .update(&header.record_schema_version.to_le_bytes())
        .update(header.code_version.as_bytes())
        .finalize();
    id.to_hex().to_string()
}
