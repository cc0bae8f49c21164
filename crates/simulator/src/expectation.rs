//! Whether records can be those of a plan, told without taking its steps.
//!
//! Of a run much is known before it is made, or follows from its switches alone:
//!
//! - the state at the start, and what is recorded and when: [`crate::recorder`] asks the same
//!   functions;
//! - the normal load of every step, and the static thresholds of the blocks that switch
//!   ([`crate::contacts`]);
//! - the anchor of every friction spring, which moves only as its block re-attaches (5.15);
//! - kinetic and elastic energy of a state of all blocks, the change by anchors, and the balance of
//!   the energies ([`crate::budget`]);
//! - what the drive pulls with, and the forces between blocks, in a step of which the state of all
//!   blocks is known: that gives the state before it (4.13, 4.14), and with it the forces (5.6-5.8),
//!   up to rounding.
//!
//! Of a slab only the contacts are recorded: the loads that they bear, and with them thresholds, are
//! held against each other where a state and a switch are of one step, but not against where the nodes
//! are; nor are the drive's pull at a height and the energies that the nodes store, but for their
//! balance.
//!
//! What remains open is when blocks switch and how the slider moves in between; that only the solver
//! tells. Records that are missing may be excused one by one, see [`Expectation::take`].

use std::collections::VecDeque;
use std::sync::Arc;

use asperity_model::{Law, Plan, Reattach, RuptureFields};
use asperity_record::{Direction, FieldRecord, Record, RunStatus, StepRecord, Switch, WindowRecord};

use crate::audit::Audit;
use crate::budget::Budget;
use crate::contacts::{Load, StopForce, aged_threshold_n};
use crate::recorder::{self, Due};
use crate::slab_records;
use crate::solver::SimulationError;
use crate::state::ChainState;

/// How far forces may be from what follows from a state, over the largest terms of their sums: some
/// thousand roundings.
const ROUNDING: f64 = 1e-12;

const MISSING_FIELDS: &str = "the state of all blocks, which the scenario asks for, does not follow";
const OWED_WINDOW: &str = "the state of a dense window that was due before is not there";
const MISSING_WINDOW: &str = "the state of a dense window, which the scenario asks for, does not follow";

/// A record that no run of the plan gives in this place.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("step {step}: {what}")]
pub struct Departure {
    /// The step.
    pub step: u64,
    /// What is not as it must be.
    pub what: String,
}

/// What the records of a run of a plan must be.
#[derive(Debug, Clone)]
pub struct Expectation {
    plan: Arc<Plan>,
    /// Whether records may be missing, as from what was left of a damaged log.
    has_gaps: bool,
    begun: bool,
    /// The last step record; `None` where steps may be missing since.
    last: Option<Last>,
    /// The states that are due after it.
    due: VecDeque<Due>,
    /// Whether it is not known if the state of all blocks was due.
    fields_are_open: bool,
    /// States that were due and not there, to be excused by those that come next.
    owed_fields: bool,
    owed_windows: bool,
    /// Anchors of the friction springs; not a number where they are not known.
    anchor_m: Vec<f64>,
    /// Where contacts age, the step in which each stuck last; `u64::MAX` where that is not known.
    stuck_since_step: Vec<u64>,
    hold: Hold,
    /// The energies, and in which step they stop the run.
    budget: Budget,
    audit: Audit,
    stop: Option<SimulationError>,
    /// The next step whose record is the state of a rupture alone, if no block switches before.
    rupture_due: Option<u64>,
    /// The last state of all blocks, for the windows of the same step.
    fields: Option<FieldRecord>,
}

/// The last step record, as far as the next records depend on it.
#[derive(Debug, Clone)]
struct Last {
    record: StepRecord,
    /// How many blocks are detached after it.
    detached: u32,
}

impl Last {
    /// Whether the step after it is the onset or end of a slip event.
    fn is_before_edge(&self) -> bool {
        (self.record.sliding > 0) != (self.detached > 0)
    }
}

/// What is known of the step in which the drive point stops.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Hold {
    /// It is this one; `u64::MAX` for none.
    Known(u64),
    /// After this step, if at all: a load stops it, which may be reached between records.
    After(u64),
    /// After the first and no later than the second.
    Between(u64, u64),
}

impl Expectation {
    /// Of the records of a plan from the first on; `has_gaps` where some may be missing.
    pub fn of(plan: impl Into<Arc<Plan>>, has_gaps: bool) -> Expectation {
        let plan = plan.into();
        let is_known = plan.drive.until_load_ratio.is_none() || plan.drive.hold_from_step.is_some();
        let ages = plan.friction.ageing.is_some();
        Expectation {
            has_gaps,
            begun: false,
            last: None,
            due: VecDeque::new(),
            fields_are_open: true,
            owed_fields: false,
            owed_windows: false,
            anchor_m: vec![f64::NAN; plan.blocks],
            stuck_since_step: if ages { vec![u64::MAX; plan.blocks] } else { Vec::new() },
            hold: match is_known {
                true => Hold::Known(plan.drive.hold_from_step.unwrap_or(u64::MAX)),
                false => Hold::After(plan.initial.step),
            },
            budget: Budget::of(&plan),
            audit: Audit::of(&plan),
            stop: None,
            rupture_due: None,
            fields: None,
            plan,
        }
    }

    /// Takes the next record; `is_after_gap` says that records of its kind are missing before it.
    ///
    /// # Errors
    /// If no run of the plan gives it here.
    pub fn take(&mut self, record: &Record, is_after_gap: bool) -> Result<(), Departure> {
        let outcome = match record {
            Record::Step(record) => self.step(record, is_after_gap),
            Record::Fields(record) => self.fields(record, is_after_gap),
            Record::Window(record) => self.window(record, is_after_gap),
        };
        outcome.map_err(|what| Departure { step: record.step(), what })
    }

    /// That nothing is missing behind the last record of a run that ended so: took all its steps, or
    /// was `stopped` for a reason, in words.
    ///
    /// # Errors
    /// If something is, or the run cannot have ended so.
    pub fn finish(&mut self, status: RunStatus, stopped: Option<&str>) -> Result<(), Departure> {
        let step = self.last.as_ref().map_or(0, |last| last.record.step);
        let outcome = self.nothing_is_due().and_then(|()| {
            let found = self.stop.as_ref().map(ToString::to_string);
            match (status, found) {
                (RunStatus::StoppedEnergy, found) if found.as_deref() == stopped => return Ok(()),
                (RunStatus::StoppedEnergy, Some(found)) => {
                    return Err(format!("the run is stopped there for another reason: {found}"));
                }
                (RunStatus::StoppedEnergy, None) => {
                    let why = match self.plan.recording.energies {
                        true => "its energies allow it to go on",
                        false => "a run without energies is not stopped for them",
                    };
                    return Err(format!("the run is said to be stopped there, and {why}"));
                }
                (_, Some(found)) => return Err(format!("a run is stopped there: {found}")),
                // That the next step cannot be recorded, only the solver tells.
                (RunStatus::StoppedNotFinite, None) => return Ok(()),
                (_, None) => {}
            }
            let load_not_reached = status == RunStatus::LoadNotReached;
            if self.plan.steps > self.plan.initial.step && step != self.plan.steps {
                return Err(format!("it is the last step record, not step {}", self.plan.steps));
            }
            match (load_not_reached, self.plan.drive.until_load_ratio, self.hold) {
                (true, None, _) => {
                    Err("the load is said not to have been reached, and the scenario gives none".to_owned())
                }
                (true, Some(ratio), Hold::Known(_) | Hold::Between(..)) => {
                    Err(format!("the load of {ratio} F_N is said not to have been reached, and it has been"))
                }
                _ => Ok(()),
            }
        });
        outcome.map_err(|what| Departure { step, what })
    }

    fn nothing_is_due(&mut self) -> Result<(), String> {
        for due in self.due.drain(..) {
            let (owed, what) = match due {
                Due::Fields => (&mut self.owed_fields, MISSING_FIELDS),
                Due::Window(_) => (&mut self.owed_windows, MISSING_WINDOW),
            };
            if !self.has_gaps {
                return Err(what.to_owned());
            }
            *owed = true;
        }
        Ok(())
    }

    /// Forgets what may have changed in steps that are missing.
    fn lose_sight(&mut self) {
        self.last = None;
        self.due.clear();
        self.rupture_due = None;
        self.fields_are_open = true;
        self.anchor_m.fill(f64::NAN);
        self.stuck_since_step.fill(u64::MAX);
        self.fields = None;
        self.budget.lose_sight();
    }

    fn step(&mut self, record: &StepRecord, is_after_gap: bool) -> Result<(), String> {
        if let Some(stop) = &self.stop {
            return Err(format!("it stands behind the end of a run: {stop}"));
        }
        self.stop = self.audit.stops(record);
        if !self.begun && !self.has_gaps {
            return Err("there is no state of all blocks before the first step".to_owned());
        }
        self.begun = true;
        self.nothing_is_due()?;
        if is_after_gap {
            self.lose_sight();
        }
        let step = record.step;
        if self.rupture_due.is_some_and(|due| due < step) && !self.has_gaps {
            return Err(MISSING_WINDOW.to_owned());
        }
        let edge = match &self.last {
            Some(last) => {
                let edge = last.is_before_edge();
                let last_step = last.record.step;
                let next = if edge { last_step + 1 } else { recorder::next_step_due(&self.plan, last_step) };
                if step > next {
                    return Err(format!("there is no record of step {next}, which the scenario asks for"));
                }
                if step < next && record.switches.is_empty() {
                    return Err(format!(
                        "no block switches in it, and the next record to be made is that of step {next}"
                    ));
                }
                if record.sliding != last.detached {
                    let (sliding, detached) = (record.sliding, last.detached);
                    return Err(format!("{sliding} blocks slide, and {detached} are detached"));
                }
                Some(edge)
            }
            // The first of a run begins at rest.
            None if !self.has_gaps => Some(false),
            None => None,
        };
        self.load(record)?;
        self.budget.step(&self.plan, record)?;
        for switch in &record.switches {
            self.switch(record, switch)?;
        }
        let count = |direction| record.switches.iter().filter(|switch| switch.direction == direction).count();
        let (detach, attach) = (count(Direction::Detach) as u32, count(Direction::Attach) as u32);
        let Some(detached) = (record.sliding + detach).checked_sub(attach) else {
            return Err(format!("{attach} blocks re-attach, and {} slide", record.sliding));
        };
        self.due = recorder::due_states(&self.plan, step, edge.unwrap_or(false), record.sliding).collect();
        let of_rupture = self.plan.recording.rupture_fields;
        self.rupture_due = of_rupture.and_then(|fields| fields.next_due(step, detached));
        self.fields_are_open = edge.is_none();
        self.fields = None;
        self.last = Some(Last { record: record.clone(), detached });
        Ok(())
    }

    /// Normal load and driving force.
    fn load(&mut self, record: &StepRecord) -> Result<(), String> {
        let plan = &*self.plan;
        let step = record.step;
        let load_n = |hold_step| Load::in_step(plan, step, hold_step).scaled_n(plan.total_normal_load_n);
        let other = |expected_n: f64| {
            Err(format!("the normal load is {} N, not {expected_n} N", record.normal_load_n))
        };
        match self.hold {
            Hold::Known(hold_step) => {
                let expected_n = load_n(hold_step);
                if record.normal_load_n != expected_n {
                    return other(expected_n);
                }
            }
            Hold::After(_) | Hold::Between(..) if !plan.load_course.counts_from_hold() => {
                let expected_n = load_n(u64::MAX);
                if record.normal_load_n != expected_n {
                    return other(expected_n);
                }
            }
            Hold::After(from) | Hold::Between(from, _) => {
                let until = match self.hold {
                    Hold::Between(_, until) => until,
                    _ => step,
                };
                let ratio = record.normal_load_n / plan.total_normal_load_n;
                // A load that rests for some time, as before the drive stops, says nothing.
                if !plan.load_course.rests_at(ratio) {
                    let candidates = plan.load_course.hold_steps(step, ratio);
                    let mut found = candidates
                        .into_iter()
                        .filter(|&hold_step| hold_step > from && hold_step <= until)
                        .filter(|&hold_step| load_n(hold_step) == record.normal_load_n);
                    match (found.next(), found.next()) {
                        (Some(hold_step), None) => self.hold = Hold::Known(hold_step),
                        (Some(_), Some(_)) => {}
                        (None, _) => return other(load_n(u64::MAX)),
                    }
                }
            }
        }
        if let Hold::After(from) = self.hold
            && let Some(stop) = StopForce::of(plan, u64::MAX)
            // It may also have stopped earlier, and its load have fallen and risen again.
            && record.driving_force_n >= stop.under_n(Load::in_step(plan, step, u64::MAX))
        {
            self.hold = Hold::Between(from, step);
        }
        match record.end_forces_n {
            Some(_) if !plan.drive.pulls_both_ways() => {
                return Err("it has forces on both ends, and the drive pulls one way".to_owned());
            }
            None if plan.drive.pulls_both_ways() => {
                return Err("it lacks the forces on both ends, and the drive pulls both ways".to_owned());
            }
            Some([first, last])
                if plan.drive.springs.len() == 2 && first + last != record.driving_force_n =>
            {
                let found = record.driving_force_n;
                return Err(format!(
                    "the driving force is {found} N, and its parts add up to {} N",
                    first + last
                ));
            }
            _ => {}
        }
        Ok(())
    }

    /// A switch: threshold, anchor, and whether there was reason for it.
    fn switch(&mut self, record: &StepRecord, switch: &Switch) -> Result<(), String> {
        let plan = &*self.plan;
        let block = switch.block;
        let Some(n) = (block as usize).checked_sub(1).filter(|&n| n < plan.blocks) else {
            return Err(format!("there is no block {block}"));
        };
        let other = |what: &str, found: f64, expected: f64, unit: &str| {
            Err(format!("{what} of block {block} is {found} {unit}, not {expected} {unit}"))
        };
        let attaches = switch.direction == Direction::Attach;
        if attaches && let Some(since) = self.stuck_since_step.get_mut(n) {
            *since = record.step;
        }
        let is_known = self.stuck_since_step.get(n).is_none_or(|&since| since <= record.step);
        if plan.elastic.lattice().is_some() {
            // Up to what its contact bears, which a state tells.
            if !(switch.threshold_n >= 0.0 && switch.threshold_n.is_finite()) {
                return Err(format!("the threshold of block {block} is {} N", switch.threshold_n));
            }
        } else if is_known {
            let at_start_n = aged_threshold_n(plan, n, &self.stuck_since_step, record.step);
            let factor = record.normal_load_n / plan.total_normal_load_n;
            let expected_n = match self.hold {
                Hold::Known(hold_step) => Load::in_step(plan, record.step, hold_step).scaled_n(at_start_n),
                _ if !plan.load_course.counts_from_hold() => {
                    Load::in_step(plan, record.step, u64::MAX).scaled_n(at_start_n)
                }
                // Known from the normal load, up to rounding.
                _ if (switch.threshold_n - factor * at_start_n).abs() <= ROUNDING * at_start_n => {
                    switch.threshold_n
                }
                _ => factor * at_start_n,
            };
            if switch.threshold_n != expected_n {
                return other("the threshold", switch.threshold_n, expected_n, "N");
            }
        }
        if !attaches {
            let (force_n, threshold_n) = (switch.tangential_force_n, switch.threshold_n);
            if force_n.abs() < threshold_n {
                return Err(format!("block {block} detaches at {force_n} N, below {threshold_n} N"));
            }
            let anchor_m = self.anchor_m[n];
            if !anchor_m.is_nan() && switch.stick_position_m != anchor_m {
                return other("the anchor", switch.stick_position_m, anchor_m, "m");
            }
        } else {
            let velocity = switch.velocity_m_per_s;
            let (rests, anchor_m) = match plan.friction.law {
                Law::Rigid { .. } => (velocity == 0.0, switch.displacement_m),
                Law::Springs => {
                    let stretch_m = switch.tangential_force_n / plan.friction.interfacial_stiffness_n_per_m;
                    let rests = plan.friction.reattach == Reattach::TwoWay || velocity <= 0.0;
                    (rests, switch.displacement_m - stretch_m)
                }
            };
            if !rests {
                return Err(format!("block {block} re-attaches at {velocity} m/s"));
            }
            if switch.stick_position_m != anchor_m {
                return other("the anchor", switch.stick_position_m, anchor_m, "m");
            }
        }
        self.anchor_m[n] = switch.stick_position_m;
        Ok(())
    }

    fn fields(&mut self, record: &FieldRecord, is_after_gap: bool) -> Result<(), String> {
        if record.displacement_m.len() != self.plan.blocks {
            return Err(format!("{} blocks, not {}", record.displacement_m.len(), self.plan.blocks));
        }
        let loads = if self.plan.elastic.lattice().is_some() { self.plan.blocks } else { 0 };
        if record.normal_load_n.len() != loads {
            return Err(format!("{} normal loads of contacts, not {loads}", record.normal_load_n.len()));
        }
        if let Some(n) = record.normal_load_n.iter().position(|load_n| *load_n < 0.0) {
            let load_n = record.normal_load_n[n];
            return Err(format!(
                "the normal load of block {} is {load_n} N, and nothing pulls it down",
                n + 1
            ));
        }
        let begins = !std::mem::replace(&mut self.begun, true) && record.step == self.plan.initial.step;
        if begins && !is_after_gap {
            return self.initial(record);
        }
        if self.owed_fields && !is_after_gap {
            return Err("the state of all blocks that was due before is not there".to_owned());
        }
        self.owed_fields = false;
        let is_of_last = self.last.as_ref().is_some_and(|last| last.record.step == record.step);
        if !is_of_last {
            if !self.has_gaps {
                return Err("there is no step record of this state of all blocks".to_owned());
            }
            // That of another step, which is missing.
            self.lose_sight();
        } else if self.due.front() == Some(&Due::Fields) {
            self.due.pop_front();
        } else if !self.fields_are_open {
            return Err("the state of all blocks stands where the scenario asks for none".to_owned());
        }
        self.fields_are_open = false;
        let pairs = self.anchor_m.iter().zip(&record.stick_position_m);
        if let Some((n, (expected, found))) =
            pairs.enumerate().find(|(_, (known, found))| !known.is_nan() && known != found)
        {
            return Err(format!("the anchor of block {} is {found} m, not {expected} m", n + 1));
        }
        if let Some(last) = self.last.as_ref().filter(|_| is_of_last) {
            self.is_state_of(&last.record, record)?;
        }
        self.anchor_m.copy_from_slice(&record.stick_position_m);
        let recording = &self.plan.recording;
        if !recording.windows.is_empty() || recording.rupture_fields.is_some() {
            self.fields = Some(record.clone());
        }
        Ok(())
    }

    /// The state before the first step, which follows from the plan.
    fn initial(&mut self, record: &FieldRecord) -> Result<(), String> {
        let initial = ChainState::initial(&self.plan);
        if *record != recorder::fields(&self.plan, &initial) {
            return Err("the state at the start is not that of the scenario".to_owned());
        }
        self.budget.begin();
        self.anchor_m.copy_from_slice(&initial.stick_position_m);
        self.stuck_since_step.copy_from_slice(&initial.stuck_since_step);
        self.fields_are_open = false;
        // As if a step had led to it.
        let record = StepRecord {
            step: initial.step,
            time_s: record.time_s,
            driving_force_n: 0.0,
            normal_load_n: self.plan.total_normal_load_n,
            end_forces_n: None,
            energy: None,
            sliding: 0,
            switches: Vec::new(),
        };
        self.last = Some(Last { record, detached: 0 });
        Ok(())
    }

    /// That a state is what a step led to: the blocks that switched as they are there, and forces
    /// that follow from where the blocks were before.
    fn is_state_of(&self, step: &StepRecord, record: &FieldRecord) -> Result<(), String> {
        let plan = &*self.plan;
        let mut slid: Vec<bool> = record.detached.iter().map(|&detached| detached != 0).collect();
        for switch in &step.switches {
            let n = switch.block as usize - 1;
            slid[n] = switch.direction == Direction::Attach;
            let of_step = [switch.displacement_m, switch.velocity_m_per_s, switch.tangential_force_n];
            let of_state =
                [record.displacement_m[n], record.velocity_m_per_s[n], record.tangential_force_n[n]];
            if of_step != of_state {
                return Err(format!("block {} is not where its switch says", switch.block));
            }
        }
        let hold_step = match self.hold {
            Hold::Known(hold_step) => Some(hold_step),
            Hold::After(_) | Hold::Between(..) => None,
        };
        if plan.elastic.lattice().is_some() {
            return slab_records::is_state_of(plan, step, record, &self.stuck_since_step, hold_step);
        }
        if let Some(energy) = &step.energy {
            Budget::state(plan, energy, record, hold_step)?;
        }
        let Some(hold_step) = hold_step else { return Ok(()) };
        let point_m = plan.drive_point_m(step.step, hold_step);
        let dt = plan.grid.step_s();
        let before_m: Vec<f64> =
            record.displacement_m.iter().zip(&record.velocity_m_per_s).map(|(u, v)| u - dt * v).collect();
        let largest = |values: &[f64]| values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        let drive_n_per_m: f64 = plan.drive.springs.iter().map(|spring| spring.stiffness_n_per_m).sum();
        let largest_m = largest(&before_m);
        let drive_bound_n = drive_n_per_m * (point_m.abs() + largest_m);
        let driving_n = plan.drive.total_force_n(point_m, &before_m);
        if (driving_n - step.driving_force_n).abs() > ROUNDING * drive_bound_n {
            return Err(format!(
                "the driving force is {} N, and the blocks are where it is {driving_n} N",
                step.driving_force_n
            ));
        }
        if plan.friction.law != Law::Springs {
            return Ok(());
        }
        let kt = plan.friction.interfacial_stiffness_n_per_m;
        let load = step.normal_load_n / plan.total_normal_load_n;
        let dt_over_m = dt / plan.block_mass_kg;
        // Not a number where the direction of sliding is not known.
        let before_m_per_s: Vec<f64> = (0..plan.blocks)
            .map(|n| {
                let (v, tau) = (record.velocity_m_per_s[n], record.tangential_force_n[n]);
                let without = |friction_n: f64| v - (tau - friction_n) * dt_over_m;
                if !slid[n] {
                    return without(kt * (before_m[n] - self.anchor_m[n]));
                }
                let drag_n = load * plan.friction.dynamic_friction_n[n];
                let (forward, backward) = (without(drag_n), without(-drag_n));
                match (forward > 0.0, backward < 0.0) {
                    (true, false) => forward,
                    (false, true) => backward,
                    _ => f64::NAN,
                }
            })
            .collect();
        let elastic = &plan.elastic;
        let fastest =
            before_m_per_s.iter().filter(|v| !v.is_nan()).fold(0.0, |most: f64, v| most.max(v.abs()));
        let bound_n = (elastic.row_bound_n_per_m() + kt) * largest_m
            + kt * largest(&record.stick_position_m)
            + elastic.damping_row_bound_kg_per_s() * fastest
            + drive_bound_n
            + largest(&record.tangential_force_n);
        let mut pull_n: Vec<f64> =
            (0..plan.blocks).map(|n| elastic.pull_n(&before_m, &before_m_per_s, n)).collect();
        for spring in &plan.drive.springs {
            pull_n[spring.block] += spring.force_n(point_m, before_m[spring.block]);
        }
        for (pull, prestress) in pull_n.iter_mut().zip(&plan.prestress_n) {
            *pull += prestress;
        }
        for (n, (expected_n, found_n)) in pull_n.iter().zip(&record.tangential_force_n).enumerate() {
            if (expected_n - found_n).abs() > ROUNDING * bound_n {
                return Err(format!(
                    "the tangential force on block {} is {found_n} N, and the blocks are where it is {expected_n} N",
                    n + 1
                ));
            }
        }
        Ok(())
    }

    fn window(&mut self, record: &WindowRecord, is_after_gap: bool) -> Result<(), String> {
        self.begun = true;
        if self.owed_windows && !is_after_gap {
            return Err(OWED_WINDOW.to_owned());
        }
        self.owed_windows = false;
        let recording = &self.plan.recording;
        let index = record.window as usize;
        let of_rupture = recording.rupture_fields.filter(|_| index == recording.windows.len());
        if index >= recording.windows.len() && of_rupture.is_none() {
            return Err(format!("the scenario has no dense window {}", record.window));
        }
        let blocks = recorder::blocks_of(&self.plan, index);
        let expected = (blocks.start as u32 + 1, blocks.len());
        if (record.first_block, record.displacement_m.len()) != expected {
            return Err(format!("dense window {} is of other blocks", record.window));
        }
        let is_of_last = self.last.as_ref().is_some_and(|last| last.record.step == record.step);
        if let Some(fields) = of_rupture.filter(|_| !is_of_last) {
            return self.of_rupture(record, fields, is_after_gap);
        }
        let Some(last) = self.last.as_ref().filter(|_| is_of_last) else {
            if !self.has_gaps {
                return Err("there is no step record of this dense window".to_owned());
            }
            self.lose_sight();
            return Ok(());
        };
        if record.sliding != last.record.sliding {
            return Err(format!("{} blocks slide, not {}", record.sliding, last.record.sliding));
        }
        // States stand in the order in which they are due; one before it may be missing.
        while let Some(due) = self.due.pop_front() {
            if due == Due::Window(index) {
                if let Some(fields) = &self.fields {
                    let of_all =
                        [&fields.displacement_m, &fields.velocity_m_per_s, &fields.tangential_force_n];
                    let found =
                        [&record.displacement_m, &record.velocity_m_per_s, &record.tangential_force_n];
                    if of_all.iter().zip(found).any(|(all, found)| all[blocks.clone()] != found[..]) {
                        return Err("a dense window and the state of all blocks differ".to_owned());
                    }
                }
                return Ok(());
            }
            match due {
                Due::Fields if self.has_gaps => self.owed_fields = true,
                // What is missing of a topic shows in the next number of it, which is this one.
                Due::Window(_) if is_after_gap => {}
                Due::Fields => return Err(MISSING_FIELDS.to_owned()),
                Due::Window(_) => return Err(MISSING_WINDOW.to_owned()),
            }
        }
        Err("a dense window stands where the scenario asks for none".to_owned())
    }

    /// The state of a rupture after a step that has no record: between two others, while no block
    /// switches.
    fn of_rupture(
        &mut self,
        record: &WindowRecord,
        fields: RuptureFields,
        is_after_gap: bool,
    ) -> Result<(), String> {
        if !fields.are_due(record.step, record.sliding) {
            return Err("the state of a rupture stands where the scenario asks for none".to_owned());
        }
        self.nothing_is_due()?;
        if self.has_gaps {
            // Which steps are missing is not known; what was due before is excused by this one alone.
            if std::mem::take(&mut self.owed_windows) && !is_after_gap {
                return Err(OWED_WINDOW.to_owned());
            }
            return Ok(());
        }
        let detached = self.last.as_ref().map_or(0, |last| last.detached);
        if record.sliding != detached {
            return Err(format!("{} blocks slide, and {detached} are detached", record.sliding));
        }
        match self.rupture_due {
            Some(due) if due == record.step => {
                self.rupture_due = fields.next_due(due, detached);
                Ok(())
            }
            Some(due) if due < record.step => Err(MISSING_WINDOW.to_owned()),
            _ => Err("the state of a rupture stands where the scenario asks for none".to_owned()),
        }
    }
}
