//! Which steps and states are recorded. All solvers use this recorder, so that their records agree.

use std::collections::VecDeque;
use std::ops::Range;

use asperity_model::plan::outside::Driving;
use asperity_model::{Plan, SliderState, WindowPlan};
use asperity_record::{
    Direction, Energy, FieldRecord, Record, StepRecord, Switch, SwitchAcross, WindowRecord,
};

use crate::energy::instability_stop::InstabilityStop;
use crate::kernels;
use crate::records::solver::{Next, SimulationError};
use crate::step::single_step::SingleSteps;
use crate::step::strength::threshold_n;

/// Turns states into records, and determines the next step at which a cadence requires one.
#[derive(Debug, Clone)]
pub(crate) struct Recorder {
    due_step: u64,
    /// The first step of a run that begins while contacts slide: its record is the onset of a slip event.
    onset_step: Option<u64>,
    /// Records to be handed out, in order.
    pub(crate) ready: VecDeque<Record>,
    instability: InstabilityStop,
    /// The error to report once the queued records are handed out.
    stop: Option<SimulationError>,
}

impl Recorder {
    /// A recorder at the start of a run, with the initial fields ready. `initial_j` is the energy at the start that
    /// may set the slider in motion.
    pub(crate) fn new(plan: &Plan, initial: &SliderState, initial_j: f64) -> Recorder {
        let stop = state_not_finite(initial);
        let first = Record::Fields(Box::new(fields(plan, initial)));
        let mut recorder = Recorder {
            due_step: 0,
            onset_step: (initial.detached > 0).then_some(initial.step + 1),
            ready: if stop.is_none() { VecDeque::from([first]) } else { VecDeque::new() },
            instability: InstabilityStop::of(plan, initial_j),
            stop,
        };
        recorder.due_step = recorder.next_due(plan, initial);
        recorder
    }

    /// A recorder at the start of a stepper's run.
    pub(crate) fn at_start(plan: &Plan, stepper: &mut (impl SingleSteps + ?Sized)) -> Recorder {
        let mut recorder = Recorder::new(plan, stepper.state(), stepper.initial_j());
        if stepper.state().detached > 0 {
            let energy = stepper.energy();
            recorder.begin_sliding(plan, stepper.state(), energy);
        }
        recorder
    }

    /// Records the contacts that slide at the start as if they detached there, under the force that they bear, so that
    /// the switches tell which contacts slide.
    pub(crate) fn begin_sliding(&mut self, plan: &Plan, initial: &SliderState, energy: Energy) {
        if initial.detached == 0 || self.stop.is_some() {
            return;
        }
        let sliding = (0..plan.blocks).filter(|n| initial.slip[*n] != 0.0);
        let switches = sliding.map(|n| {
            let switch = switch(plan, initial, n);
            Switch { threshold_n: switch.force_magnitude_n(), ..switch }
        });
        let driving = plan
            .outside(initial.step, initial.hold_step)
            .pull([&initial.displacement_m, &initial.velocity_m_per_s], |_, _| {});
        let record = StepRecord { sliding: 0, ..load(plan, initial, driving, energy, switches.collect()) };
        self.stop = not_finite(&record, initial.step, initial);
        if self.stop.is_some() {
            self.ready.clear();
        } else {
            self.ready.push_front(Record::Step(record));
        }
    }

    /// The next queued record.
    ///
    /// # Errors
    /// If none is queued and the run cannot continue.
    pub(crate) fn next(&mut self) -> Result<Next, SimulationError> {
        match (self.ready.pop_front(), &self.stop) {
            (Some(record), _) => Ok(Next::Record(record)),
            (None, Some(stop)) => Err(stop.clone()),
            (None, None) => Ok(Next::End),
        }
    }

    /// Whether no record and no error is queued.
    pub(crate) fn is_empty(&self) -> bool {
        self.ready.is_empty() && self.stop.is_none()
    }

    /// The next step at which a cadence, or the end of the run, asks for a record.
    pub(crate) fn due_step(&self) -> u64 {
        self.due_step
    }

    /// Drops queued records, and continues after a state.
    pub(crate) fn continue_after(&mut self, plan: &Plan, state: &SliderState) {
        self.ready.clear();
        self.stop = None;
        self.due_step = self.next_due(plan, state);
    }

    /// The first step after a state at which a cadence, a rupture, the onset or the end of the run requires a record;
    /// `u64::MAX` after the end. The detached blocks slide until then.
    fn next_due(&self, plan: &Plan, state: &SliderState) -> u64 {
        let onset_step = self.onset_step.filter(|onset| *onset > state.step);
        let ruptures = plan.recording.rupture_fields;
        let of_rupture = ruptures.and_then(|fields| fields.next_due(state.step, state.detached));
        [onset_step, of_rupture].into_iter().flatten().fold(next_step_due(plan, state.step), u64::min)
    }

    /// Records a single step if a block switched in it, if it is the onset or end of a slip event, or if
    /// a cadence requires it.
    pub(crate) fn observe(
        &mut self,
        plan: &Plan,
        stepper: &mut (impl SingleSteps + ?Sized),
        was_sliding: bool,
        driving: Driving,
    ) -> Result<(), SimulationError> {
        let state = stepper.state();
        let edge = was_sliding != (state.sliding > 0);
        if edge || !stepper.switched().is_empty() || state.step == self.due_step {
            let energy = stepper.energy();
            self.record(plan, stepper.state(), driving, energy, stepper.switched(), edge)?;
        }
        Ok(())
    }

    /// Records the step that led to `state`: the energies then, the blocks that switched in it
    /// (counted from 0), and whether it is the onset or end of a slip event. Returns whether it has a step record.
    pub(crate) fn record(
        &mut self,
        plan: &Plan,
        state: &SliderState,
        driving: Driving,
        energy: Energy,
        switched: &[usize],
        edge: bool,
    ) -> Result<bool, SimulationError> {
        let step = state.step;
        let edge = edge || self.onset_step == Some(step);
        if !edge && switched.is_empty() && next_step_due(plan, step - 1) != step {
            // Only the state of a rupture is due. If it is not finite, the next step record reports
            // that, as in a run without these states.
            if state_not_finite(state).is_none() {
                self.states(plan, state, false);
            }
            self.due_step = self.next_due(plan, state);
            return Ok(false);
        }
        let switches = switched.iter().map(|&n| switch(plan, state, n)).collect();
        let record = load(plan, state, driving, energy, switches);
        self.stop = state_not_finite(state).or_else(|| not_finite(&record, step, state));
        if let Some(stop) = &self.stop {
            return Err(stop.clone());
        }
        self.stop = self.instability.stops(&record);
        self.ready.push_back(Record::Step(record));
        self.states(plan, state, edge);
        self.due_step = self.next_due(plan, state);
        Ok(true)
    }

    /// Records the states that are due after a step, in this order; `edge` marks the onset or end of a slip event. A
    /// step without a step record may have the state of a rupture; all other states follow the record of their step.
    fn states(&mut self, plan: &Plan, state: &SliderState, edge: bool) {
        let (recording, step) = (&plan.recording, state.step);
        if (edge && recording.event_fields) || step.is_multiple_of(recording.fields_every_steps) {
            self.ready.push_back(Record::Fields(Box::new(fields(plan, state))));
        }
        let windows = recording.windows.iter().enumerate();
        for (index, window) in windows.filter(|(_, window)| next_in_window(window, step - 1) == Some(step)) {
            self.ready.push_back(window_record(plan, state, index, window.blocks.clone()));
        }
        if recording.rupture_fields.is_some_and(|fields| fields.are_due(step, state.sliding)) {
            self.ready.push_back(window_record(plan, state, recording.windows.len(), 0..plan.blocks));
        }
    }
}

fn load(
    plan: &Plan,
    state: &SliderState,
    driving: Driving,
    energy: Energy,
    switches: Vec<Switch>,
) -> StepRecord {
    let in_medium_n = plan.medium.as_ref().map(|_| state.tangential_force_n.iter().sum());
    StepRecord {
        step: state.step,
        time_s: plan.grid.time_s(state.step),
        driving_force_n: in_medium_n.unwrap_or(driving.total_n),
        ft_fn_error: None,
        end_forces_n: driving.ends_n,
        energy,
        junctions: state.junctions.as_ref().map(|junctions| junctions.totals_before()),
        peak_velocity_m_per_s: state.peak_velocity_m_per_s,
        normal_load_n: plan
            .outside(state.step, state.hold_step)
            .total_load()
            .scaled_n(plan.total_normal_load_n),
        sliding: state.sliding,
        switches,
    }
}

/// The first step after `step` at which a step record is due, which the states of ruptures do not need.
fn next_step_due(plan: &Plan, step: u64) -> u64 {
    if step >= plan.steps {
        return u64::MAX;
    }
    let recording = &plan.recording;
    let cadences = [recording.sample_every_steps, recording.fields_every_steps];
    let on_cadence = cadences.into_iter().filter(|&every| every > 0).map(|every| (step / every + 1) * every);
    let in_window = recording.windows.iter().filter_map(|window| next_in_window(window, step));
    on_cadence.chain(in_window).chain([plan.steps]).min().unwrap_or(plan.steps)
}

/// The first step of a window after `step`, if there is one.
fn next_in_window(window: &WindowPlan, step: u64) -> Option<u64> {
    let next = match step.checked_sub(window.from_step) {
        Some(into) => window.from_step + (into / window.every_steps + 1) * window.every_steps,
        // A window from step 0 starts with step 1, since step 0 is the initial state.
        None => window.from_step,
    };
    (next <= window.to_step).then_some(next)
}

fn switch(plan: &Plan, state: &SliderState, n: usize) -> Switch {
    Switch {
        block: n as u32 + 1,
        direction: if state.slip[n] != 0.0 { Direction::Detach } else { Direction::Attach },
        displacement_m: state.displacement_m[n],
        velocity_m_per_s: state.velocity_m_per_s[n],
        tangential_force_n: state.tangential_force_n[n],
        stick_position_m: state.stick_position_m[n],
        threshold_n: threshold_n(plan, state, n),
        junctions_slipping: state.junctions.as_ref().map(|junctions| junctions.slipping(n)),
        across: is_area(plan).then(|| SwitchAcross {
            displacement_m: state.displacement_m[plan.elastic.nodes() + n],
            velocity_m_per_s: state.velocity_m_per_s[plan.elastic.nodes() + n],
            tangential_force_n: state.tangential_force_n[plan.blocks + n],
            stick_position_m: state.stick_position_m[plan.blocks + n],
        }),
        measured: None,
    }
}

/// Whether contacts cover an area, so that they have a second tangential axis, across the sliding direction.
fn is_area(plan: &Plan) -> bool {
    plan.elastic.tangential_axes() > 1
}

/// The values across the sliding direction of some contacts, of an array in which those of all nodes or
/// contacts, `along`, come before; none where contacts lie in a single row.
fn across(plan: &Plan, values: &[f64], along: usize, contacts: Range<usize>) -> Vec<f64> {
    if is_area(plan) { values[along..][contacts].to_vec() } else { Vec::new() }
}

/// The state of all blocks; of a lattice, of its contacts.
pub fn fields(plan: &Plan, state: &SliderState) -> FieldRecord {
    let (junctions_slipping, pinned_mean_ratio, pinned_width_ratio) = junctions(plan, state);
    let (nodes, contacts) = (plan.elastic.nodes(), plan.blocks);
    let across = |values: &[f64], along| across(plan, values, along, 0..contacts);
    FieldRecord {
        step: state.step,
        time_s: plan.grid.time_s(state.step),
        displacement_m: state.displacement_m[..plan.blocks].to_vec(),
        velocity_m_per_s: state.velocity_m_per_s[..plan.blocks].to_vec(),
        tangential_force_n: state.tangential_force_n[..plan.blocks].to_vec(),
        normal_load_n: state.normal_load_n.clone(),
        stick_position_m: state.stick_position_m[..plan.blocks].to_vec(),
        detached: state.slip.iter().map(|&slip| u8::from(slip != 0.0)).collect(),
        junctions_slipping,
        pinned_mean_ratio,
        pinned_width_ratio,
        state: state.friction_state.clone(),
        displacement_across_m: across(&state.displacement_m, nodes),
        velocity_across_m_per_s: across(&state.velocity_m_per_s, nodes),
        tangential_force_across_n: across(&state.tangential_force_n, contacts),
        stick_position_across_m: across(&state.stick_position_m, contacts),
    }
}

/// The normal load of each contact in the last step, whether the foundation bears it or it is given.
pub fn contact_loads_n(plan: &Plan, state: &SliderState) -> Vec<f64> {
    if !state.normal_load_n.is_empty() {
        return state.normal_load_n.clone();
    }
    plan.outside(state.step, state.hold_step).loads_n()
}

/// How many junctions of each contact slip, and mean and width of the forces of the pinned ones, over the load
/// that each bears.
fn junctions(plan: &Plan, state: &SliderState) -> (Vec<u32>, Vec<f64>, Vec<f64>) {
    let Some(junctions) = &state.junctions else { return Default::default() };
    let loads_n = contact_loads_n(plan, state);
    let of = |n: usize| {
        let [mean, width] = junctions.pinned_ratios(plan, n, state.displacement_m[n], loads_n[n]);
        (junctions.slipping(n), (mean, width))
    };
    let (slipping, (mean, width)) = (0..plan.blocks).map(of).unzip();
    (slipping, mean, width)
}

/// The state of some blocks, counted from 0, in a dense window or that of ruptures, by its index.
fn window_record(plan: &Plan, state: &SliderState, index: usize, blocks: Range<usize>) -> Record {
    let (nodes, contacts) = (plan.elastic.nodes(), plan.blocks);
    let across = |values: &[f64], along| across(plan, values, along, blocks.clone());
    Record::Window(WindowRecord {
        window: index as u32,
        step: state.step,
        time_s: plan.grid.time_s(state.step),
        sliding: state.sliding,
        first_block: blocks.start as u32 + 1,
        displacement_m: state.displacement_m[blocks.clone()].to_vec(),
        velocity_m_per_s: state.velocity_m_per_s[blocks.clone()].to_vec(),
        tangential_force_n: state.tangential_force_n[blocks.clone()].to_vec(),
        displacement_across_m: across(&state.displacement_m, nodes),
        velocity_across_m_per_s: across(&state.velocity_m_per_s, nodes),
        tangential_force_across_n: across(&state.tangential_force_n, contacts),
    })
}

/// The error for the first block whose state is not finite.
fn state_not_finite(state: &SliderState) -> Option<SimulationError> {
    let kinds = [
        ("a displacement", &state.displacement_m),
        ("a velocity", &state.velocity_m_per_s),
        ("a tangential force", &state.tangential_force_n),
        ("the anchor of a friction spring", &state.stick_position_m),
    ];
    let mut suspect = kinds.into_iter().filter(|(_, values)| !kernels::are_finite(values));
    suspect.find_map(|(what, values)| {
        let n = values.iter().position(|value| !value.is_finite())?;
        Some(at_block(what, state.step, state, n))
    })
}

/// The error if a number of a step record is not finite although the state is. A number of the whole
/// slider is reported with the fastest block.
fn not_finite(record: &StepRecord, step: u64, state: &SliderState) -> Option<SimulationError> {
    let ends_n = record.end_forces_n.into_iter().flatten();
    let driving_n = ends_n.chain([record.driving_force_n]).map(|force_n| ("the force of the drive", force_n));
    let energies_j = record.energy.parts();
    let peak = record.peak_velocity_m_per_s.map(|speed| ("the largest speed", speed));
    let mut numbers = driving_n.chain(energies_j).chain(peak);
    let (what, _) = numbers.find(|(_, value)| !value.is_finite())?;
    let speed = |n: &usize| state.velocity_m_per_s[*n].abs();
    let fastest = (0..state.velocity_m_per_s.len()).max_by(|a, b| speed(a).total_cmp(&speed(b)));
    Some(at_block(what, step, state, fastest.unwrap_or(0)))
}

/// The error of a quantity after a step: the block is the first whose number is not finite, or the fastest for a number
/// of the whole slider.
pub(crate) fn at_block(what: &str, step: u64, state: &SliderState, n: usize) -> SimulationError {
    SimulationError::NotFinite(format!(
        "in step {step} {what} is no longer finite: block {} is at u = {:.3e} m, v = {:.3e} m/s",
        // For a node above the contacts, the contact below it.
        n % state.slip.len() + 1,
        state.displacement_m[n],
        state.velocity_m_per_s[n]
    ))
}
