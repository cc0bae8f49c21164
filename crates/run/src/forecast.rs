//! Predictions about a run without making it: its material and its load while nothing slides, the ratio of
//! its time step to the limit of stability, an upper bound on its log, and an estimate of the plain
//! solver's time.

use std::time::{Duration, Instant};

use asperity_model::{Plan, Preview, RecordingPlan, Scenario};
use asperity_record::{EventPayload, GlobalSlip, Onset, SlipEvent};
use asperity_runlog::MostBytes;
use asperity_simulator::SolverKind;
use serde::Serialize;

use crate::detectors;
use crate::header::header;
use crate::run::CHECKPOINT_BYTES_PER_S;

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
    /// Upper bound on the size of the log.
    pub log: MostLogBytes,
    /// Material, and load while nothing slides.
    pub preview: Preview,
    /// Warnings, see [`Scenario::warnings`].
    pub warnings: Vec<String>,
}

/// Upper bound on the size of a log: scheduled records, and the cost of everything whose number
/// only the run determines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct MostLogBytes {
    /// Scheduled samples of the load, including the last step.
    pub samples: u64,
    /// Scheduled states of all blocks, including the initial one.
    pub states: u64,
    /// Records of dense windows, and of ruptures as if enough blocks slid all the time.
    pub window_records: u64,
    /// Bytes of all scheduled records and of the parts that every log has.
    pub scheduled_bytes: u64,
    /// Bytes of a step with switches, without the switches.
    pub step_with_switches_bytes: u64,
    /// Bytes of a switch, including the events that detectors may find in it.
    pub switch_bytes: u64,
    /// Bytes of a slip event: records of its first step and of the step after its last, with the
    /// states of all blocks if they are recorded, and the events of the detectors.
    pub slip_event_bytes: u64,
    /// Bytes per second of computing time, for at most one checkpoint per second.
    pub second_bytes: u64,
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
            log: MostLogBytes::of(scenario, &plan),
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

/// Kinds of events with at most one per slip event; of the other kinds there may be one per switch.
const OF_SLIP_EVENTS: [&str; 3] = [Onset::TOPIC, SlipEvent::TOPIC, GlobalSlip::TOPIC];

/// Bytes per block in a checkpoint: its numbers, times their length in JSON.
const CHECKPOINT_BYTES_OF_A_BLOCK: u64 = 7 * 25;

/// Of rate-and-state friction, which saves its own unknowns besides.
const CHECKPOINT_BYTES_WITH_STATE: u64 = 9 * 25;

/// Bytes per junction: its anchor, its last step of slip and how often it has broken.
const CHECKPOINT_BYTES_OF_A_JUNCTION: u64 = 25 + 12 + 8;

/// Bytes of a checkpoint without the blocks.
const CHECKPOINT_FRAME_BYTES: u64 = 8 << 10;

impl MostLogBytes {
    fn of(scenario: &Scenario, plan: &Plan) -> MostLogBytes {
        let header = header(scenario, plan, SolverKind::Plain.name());
        let kinds = detectors::event_kinds(header.parts());
        let most = MostBytes::of(&header, &scenario.to_commented_toml(), &kinds);
        let steps = plan.initial.step + 1..=plan.steps;
        let on_cadence = |every: u64| match every {
            0 => 0,
            _ => steps.end() / every - (steps.start() - 1) / every,
        };
        let recording = &plan.recording;
        let samples = on_cadence(recording.sample_every_steps) + 1;
        let fields = on_cadence(recording.fields_every_steps);
        let step = most.step(plan.drive.pulls_both_ways());
        let state = most.fields(plan.blocks, !plan.has_given_loads());
        let junctions = plan.blocks as u64 * u64::from(scenario.junction_count());
        let of_block = match plan.friction.law.rate_and_state() {
            Some(_) => CHECKPOINT_BYTES_WITH_STATE,
            None => CHECKPOINT_BYTES_OF_A_BLOCK,
        };
        let checkpoint = plan.elastic.freedoms() as u64 * of_block
            + junctions * CHECKPOINT_BYTES_OF_A_JUNCTION
            + CHECKPOINT_FRAME_BYTES;
        let events = |of_slip_events: bool| -> u64 {
            let kinds = kinds.iter().filter(|kind| OF_SLIP_EVENTS.contains(&kind.topic) == of_slip_events);
            kinds.map(|kind| most.event(kind)).sum()
        };
        let of_windows = recording.windows.iter().map(|window| {
            let count = (window.to_step - window.from_step) / window.every_steps + 1;
            (count, step + most.window(window.blocks.len()))
        });
        // As if the required number of blocks slid all the time; these records have no step record.
        let of_rupture =
            recording.rupture_fields.map(|fields| (on_cadence(fields.every_steps), most.window(plan.blocks)));
        // The product may overflow for very many steps.
        let times = |count: u64, bytes: u64| count.saturating_mul(bytes);
        let (window_records, window_bytes) =
            of_windows.chain(of_rupture).fold((0, 0), |(records, bytes): (u64, u64), (count, each)| {
                (records.saturating_add(count), bytes.saturating_add(times(count, each)))
            });
        let frame = most.frame() + checkpoint + state;
        let records = [times(samples, step), times(fields, step + state), window_bytes];
        MostLogBytes {
            samples,
            states: fields + 1,
            window_records,
            scheduled_bytes: records.into_iter().fold(frame, u64::saturating_add),
            step_with_switches_bytes: step,
            switch_bytes: most.switch() + events(false),
            slip_event_bytes: 2 * step + if recording.event_fields { 2 * state } else { 0 } + events(true),
            second_bytes: CHECKPOINT_BYTES_PER_S as u64 + 3 * most.early_chunk(),
        }
    }
}
