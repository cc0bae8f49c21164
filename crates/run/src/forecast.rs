//! Predictions about a run without making it: its material and its load while nothing slides, the ratio of
//! its time step to the limit of stability, and estimates of its log and of the plain solver's time.

use std::time::{Duration, Instant};

use asperity_model::{Plan, Preview, RecordingPlan, Scenario};
use asperity_runlog::Content;
use asperity_simulator::SolverKind;
use serde::Serialize;

use crate::header::header;

/// Predictions about a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Forecast {
    /// The scenario's name.
    pub scenario: String,
    /// Its hash.
    pub scenario_hash: String,
    /// The time step, s.
    pub time_step_s: f64,
    /// The longest time step that is stable while no block switches, s; infinite, in JSON `null`, where the solver
    /// chooses its steps.
    pub longest_stable_step_s: f64,
    /// The time step over the longest stable one; None, in JSON `null`, where the solver chooses its steps.
    pub step_ratio: Option<f64>,
    /// The number of steps.
    pub steps: u64,
    /// Estimated time of the plain solver on this machine, s; None without a trial.
    pub plain_solver_s: Option<f64>,
    /// About the size of the log.
    pub log: LogEstimate,
    /// Material, and load while nothing slides.
    pub preview: Preview,
    /// Warnings, see [`Scenario::warnings`].
    pub warnings: Vec<String>,
}

/// About the size of a log: its scheduled records. Steps with switches and events add to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct LogEstimate {
    /// Scheduled samples of the load, including the last step.
    pub samples: u64,
    /// Scheduled states of all blocks, including the initial one.
    pub states: u64,
    /// Records of dense windows, and of ruptures as if enough blocks slid all the time.
    pub window_records: u64,
    /// About the bytes of these, and of the parts that every log has.
    pub scheduled_bytes: u64,
}

impl Forecast {
    /// The forecast for a scenario, without a trial of the plain solver.
    pub fn of(scenario: &Scenario) -> Forecast {
        let plan = Plan::new(scenario);
        let longest_stable_step_s = scenario.longest_stable_step_s();
        let preview = scenario.preview();
        Forecast {
            scenario: scenario.name.clone(),
            scenario_hash: scenario.hash(),
            time_step_s: plan.grid.step_s(),
            longest_stable_step_s,
            step_ratio: preview.step_ratio,
            steps: plan.steps - plan.initial.step,
            plain_solver_s: None,
            log: LogEstimate::of(scenario, &plan),
            preview,
            warnings: scenario.warnings().into_iter().map(|warning| warning.text).collect(),
        }
    }

    /// Adds an estimate of the plain solver's time, from the steps it takes within `trial` at the
    /// start of the run.
    #[must_use]
    pub fn with_plain_solver(self, scenario: &Scenario, trial: Duration) -> Forecast {
        let step_s = plain_step_s(Plan::new(scenario), trial);
        Forecast { plain_solver_s: Some(step_s * self.steps as f64), ..self }
    }
}

/// Block steps between two readings of the clock.
const BLOCK_STEPS_OF_A_LOOK: u64 = 200_000;

/// Measured time of the plain solver per step, s.
fn plain_step_s(plan: Plan, trial: Duration) -> f64 {
    let first = plan.initial.step;
    let recording = RecordingPlan {
        sample_every_steps: (BLOCK_STEPS_OF_A_LOOK / plan.blocks as u64).max(1),
        ..RecordingPlan::default()
    };
    let mut solver = SolverKind::Plain.start(Plan { recording, ..plan });
    let started = Instant::now();
    while started.elapsed() < trial {
        // A run that fails or ends has been timed for long enough.
        let Ok(Some(_)) = solver.next_record() else { break };
    }
    started.elapsed().as_secs_f64() / (solver.step() - first).max(1) as f64
}

/// Bytes of a number in a chunk, compressed: nearly all digits of a double are as good as random.
const BYTES_OF_A_NUMBER: f64 = 9.0;

/// Numbers of a step record that change from step to step.
const NUMBERS_OF_A_STEP: f64 = 14.0;

/// Bytes of every log besides its scenario: header, end, schemas, index.
const FRAME_BYTES: usize = 16 << 10;

/// How much more often states must be recorded than samples, and how much larger they must be, for a log of states: with
/// more text, it would be longer by a tenth.
const MORE: u64 = 8;

/// What most of the log of a scenario will be.
pub(crate) fn content(scenario: &Scenario) -> Content {
    let plan = Plan::new(scenario);
    let LogEstimate { samples, states, window_records, scheduled_bytes } = LogEstimate::of(scenario, &plan);
    let states = states.saturating_add(window_records);
    // A step record stands before each state.
    let bytes_of_steps = states as f64 * NUMBERS_OF_A_STEP * BYTES_OF_A_NUMBER;
    let are_more = states / MORE >= samples && scheduled_bytes as f64 > MORE as f64 * bytes_of_steps;
    // States of ruptures may never come.
    let is_sure = plan.recording.rupture_fields.is_none();
    if are_more && is_sure { Content::States } else { Content::Text }
}

impl LogEstimate {
    fn of(scenario: &Scenario, plan: &Plan) -> LogEstimate {
        let on_cadence = |every: u64| match every {
            0 => 0,
            _ => plan.steps / every - plan.initial.step / every,
        };
        let RecordingPlan { windows, rupture_fields, .. } = &plan.recording;
        let samples = on_cadence(plan.recording.sample_every_steps) + 1;
        let states = on_cadence(plan.recording.fields_every_steps) + 1;
        let of_windows = windows.iter().map(|window| {
            ((window.to_step - window.from_step) / window.every_steps + 1, window.blocks.len())
        });
        // As if the required number of blocks slid all the time, but on a fault that rests for centuries.
        let rupture_fields = rupture_fields.filter(|_| plan.medium.is_none());
        let of_rupture = rupture_fields.map(|fields| (on_cadence(fields.every_steps), plan.blocks));
        let of_windows: Vec<(u64, usize)> = of_windows.chain(of_rupture).collect();
        let parts = header(scenario, plan, SolverKind::Plain.name()).parts();
        let (axes, count) = (1 + usize::from(parts.area), |is_there: bool| usize::from(is_there));
        let of_a_block =
            4 * axes + count(!plan.has_given_loads()) + 3 * count(parts.junctions) + count(parts.state);
        let in_windows =
            of_windows.iter().map(|(records, blocks)| *records as f64 * (3 * axes * blocks) as f64);
        let numbers = samples as f64 * NUMBERS_OF_A_STEP
            + states as f64 * (of_a_block * plan.blocks) as f64
            + in_windows.sum::<f64>();
        LogEstimate {
            samples,
            states,
            window_records: of_windows.iter().fold(0, |sum, (records, _)| sum.saturating_add(*records)),
            scheduled_bytes: (numbers * BYTES_OF_A_NUMBER) as u64
                + (FRAME_BYTES + scenario.to_commented_toml().len()) as u64,
        }
    }
}
