//! Made-up runs for unit tests.

use asperity_model::{Plan, Scenario, ScenarioSource};
use asperity_record::{Direction, RunHeader, SlipEvent, StepRecord};
use asperity_testkit::{quiet_step, slip_event, switch};

use crate::run_data::RunData;

/// Slip events of three blocks: onset and end step, blocks.
pub(crate) const EVENTS: [(u64, u64, &[u32]); 7] = [
    (100, 101, &[1]),
    (200, 210, &[1, 2]),
    (300, 310, &[1]),
    (400, 410, &[2, 3]),
    (412, 420, &[1, 3]),
    (500, 510, &[1, 2, 3]),
    (600, 610, &[1, 2, 3]),
];

/// A run of three blocks with these slip events: onset and end step, blocks. There is a step
/// record before each onset, where its blocks detach, and none besides.
pub(crate) fn run(scenario_toml: &str, events: &[(u64, u64, &[u32])]) -> RunData {
    let text = format!("slider.blocks = 3\ntime.step_s = 1e-7\n{scenario_toml}");
    let source = ScenarioSource::new("test", &text);
    let scenario = Scenario::resolve(&source).unwrap();
    let plan = Plan::new(&scenario);
    let steps = events.iter().map(|&(onset, _, blocks)| StepRecord {
        driving_force_n: 1.0,
        normal_load_n: 400.0,
        switches: blocks.iter().map(|&block| switch(block, Direction::Detach)).collect(),
        ..quiet_step(onset - 1, plan.grid.time_s(onset - 1), 0.0)
    });
    let slips = events.iter().zip(0..).map(|(&(onset, end, blocks), event)| SlipEvent {
        onset_s: plan.grid.time_s(onset),
        end_s: Some(plan.grid.time_s(end)),
        max_sliding: blocks.len() as u32,
        ft_fn_onset: 0.1,
        ft_fn_end: Some(0.1),
        event,
        blocks_slipped: blocks.len() as u32,
        nucleation_block: blocks[0],
        ft_fn_min: 0.1,
        ft_fn_max: 0.1,
        ..slip_event(onset, end, *blocks.iter().min().unwrap()..=*blocks.iter().max().unwrap())
    });
    RunData {
        name: "test".to_owned(),
        header: RunHeader {
            record_schema_version: 1,
            scenario: "test".to_owned(),
            scenario_hash: String::new(),
            run_id: String::new(),
            code_version: String::new(),
            parameter_set: "as-coded".to_owned(),
            solver: "plain".to_owned(),
            blocks: 3,
            time_step_s: plan.grid.step_s(),
            steps: plan.steps,
            scales: None,
        },
        steps: steps.collect(),
        slips: slips.collect(),
        lacks: None,
        scenario,
        plan,
        fields: Vec::new(),
        windows: Vec::new(),
    }
}
