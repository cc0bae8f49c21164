//! What the records of a run bear witness to of its state: a checkpoint is read from a file, and
//! its checksum says only that it is as somebody wrote it.
//!
//! Switches say which blocks are detached, where each stuck one is anchored and since when. States
//! of all blocks are recorded at the onset and end of every event; from the last of these the
//! steps up to the checkpoint are taken again, and must lead to it. What is left to a forger are
//! changes of displacements, velocities and forces below [`TOLERANCE`] of the largest of each
//! kind, to the bit where a state stands at the checkpoint's own step; and what does not enter the
//! physics: how the solver cuts up the steps, and counts of its work. Energies go by the same
//! share of the largest of them, must balance, and change by anchors to the bit as the switches
//! say. In a run that records no states, displacements and velocities are not held against anything.
//! Of a slab the contacts alone are recorded: its nodes are held against nothing but the balance of
//! the energies, to 1e-9 of the largest; without energies against nothing.

use std::sync::Arc;

use asperity_model::Plan;
use asperity_record::{Direction, Energy, FieldRecord, Record};

use crate::budget::{Budget, anchored_j};
use crate::contacts::aged_threshold_n;
use crate::counters::Counters;
use crate::energy::Bookkeeping;
use crate::fast::Fast;
use crate::lattice::LatticeStepper;
use crate::ledger::{Ledger, Sum};
use crate::recorder;
use crate::solver::Solver;
use crate::state::ChainState;
use crate::stepper::Stepper;
use crate::sweep::Sweeps;

/// How far a value may be from that of steps taken again, in parts of the largest of its kind.
/// The solvers agree to 1e-9 over whole runs.
const TOLERANCE: f64 = 1e-7;

/// Most that a count of work may be that nothing bears witness to: sums of it stay numbers.
const MOST_COUNTED: u64 = 1 << 48;

/// The records of a run up to a step.
#[derive(Debug, Clone)]
pub struct Witness {
    plan: Plan,
    detached: Vec<bool>,
    stick_position_m: Vec<f64>,
    stuck_since_step: Vec<u64>,
    switches: u64,
    /// The last step that was recorded, and how many blocks slid in it.
    last: Option<(u64, u32)>,
    /// The energies of the last step that was recorded.
    energy: Option<Energy>,
    /// The change by anchors up to it.
    anchor_change_j: Sum,
    /// The last state of all blocks, how many slid in its step, and since when each was stuck; the
    /// energies then.
    fields: Option<(FieldRecord, u32, Vec<u64>, Option<Ledger>)>,
    /// The last recorded step before which the load that stops the drive was not reached, and the
    /// first in which it was.
    below_step: u64,
    reached_step: u64,
}

impl Witness {
    /// Before the first record.
    pub fn new(plan: &Plan) -> Witness {
        Witness {
            detached: vec![false; plan.blocks],
            stick_position_m: plan.initial.stick_position_m.clone(),
            stuck_since_step: vec![plan.initial.step; plan.blocks],
            switches: 0,
            last: None,
            energy: None,
            anchor_change_j: Sum::default(),
            fields: None,
            below_step: 0,
            reached_step: u64::MAX,
            plan: plan.clone(),
        }
    }

    /// Takes note of the next record.
    pub fn saw(&mut self, record: &Record) {
        match record {
            Record::Step(record) => {
                self.last = Some((record.step, record.sliding));
                self.energy = record.energy;
                self.switches += record.switches.len() as u64;
                self.anchor_change_j.add(anchored_j(&self.plan, &record.switches));
                for switch in &record.switches {
                    let Some(n) = (switch.block as usize).checked_sub(1).filter(|n| *n < self.detached.len())
                    else {
                        continue;
                    };
                    self.detached[n] = switch.direction == Direction::Detach;
                    if switch.direction == Direction::Attach {
                        self.stick_position_m[n] = switch.stick_position_m;
                        self.stuck_since_step[n] = record.step;
                    }
                }
                if let Some(ratio) = self.plan.drive.until_load_ratio
                    && self.reached_step == u64::MAX
                {
                    match record.driving_force_n >= ratio * record.normal_load_n {
                        true => self.reached_step = record.step,
                        false => self.below_step = record.step,
                    }
                }
            }
            Record::Fields(record) => {
                let sliding =
                    self.last.filter(|(step, _)| *step == record.step).map_or(0, |(_, sliding)| sliding);
                let ledger = match self.last {
                    Some((step, _)) if step == record.step => self.energy.as_ref().map(Ledger::of),
                    Some(_) => None,
                    None => self.plan.recording.energies.then(Ledger::default),
                };
                self.fields = Some((record.clone(), sliding, self.stuck_since_step.clone(), ledger));
            }
            Record::Window(_) => {}
        }
    }

    /// Whether a state and the work that led to it can be those after the records seen, all of
    /// which must be up to the state's step.
    ///
    /// # Errors
    /// In words, what cannot be.
    pub fn confirm(&self, state: &ChainState, counters: &Counters) -> Result<(), String> {
        if !state.fits(&self.plan) {
            return Err("it is not a state of this scenario".to_owned());
        }
        match (state.energy.is_some(), self.plan.recording.energies) {
            (true, false) => return Err("it has energies, the scenario asks for none".to_owned()),
            (false, true) => return Err("it has no energies, the scenario asks for them".to_owned()),
            _ => self.confirm_contacts(state)?,
        }
        self.confirm_work(state, counters)?;
        self.confirm_drive(state)?;
        self.confirm_motion(state)
    }

    fn confirm_contacts(&self, state: &ChainState) -> Result<(), String> {
        for (n, detached) in self.detached.iter().enumerate() {
            let block = n + 1;
            if (state.slip[n] != 0.0) != *detached {
                return Err(format!(
                    "it has block {block} {}, the switches do not",
                    if *detached { "stuck" } else { "detached" }
                ));
            }
            let (found, recorded) = (state.stick_position_m[n], self.stick_position_m[n]);
            if found.to_bits() != recorded.to_bits() {
                return Err(format!(
                    "it has block {block} anchored at {found} m, the switches at {recorded} m"
                ));
            }
        }
        if self.plan.friction.ageing.is_some() {
            for n in 0..self.plan.blocks {
                let block = n + 1;
                let (found, recorded) = (state.stuck_since_step[n], self.stuck_since_step[n]);
                if found != recorded {
                    return Err(format!("it has block {block} stuck since step {found}, not {recorded}"));
                }
                // Those of a slab are told by the times.
                if state.aged_threshold_n.is_empty() {
                    continue;
                }
                // No contact is older than in the step that comes next.
                let oldest = aged_threshold_n(&self.plan, n, &self.stuck_since_step, state.step + 1);
                let aged = state.aged_threshold_n[n];
                if !(self.plan.friction.static_threshold_n[n]..=oldest).contains(&aged) {
                    return Err(format!(
                        "it has a threshold of {aged} N for block {block}, {oldest} N at most"
                    ));
                }
            }
        }
        let detached = self.detached.iter().filter(|detached| **detached).count() as u32;
        let sliding = match self.last {
            Some((step, sliding)) if step == state.step => sliding,
            _ => detached,
        };
        if state.sliding != sliding {
            return Err(format!("it has {} blocks sliding, the records {sliding}", state.sliding));
        }
        let bits = |sum: Sum| (sum.total.to_bits(), sum.rest.to_bits());
        let anchored = |ledger: Ledger| bits(ledger.anchor_change_j) == bits(self.anchor_change_j);
        if !state.energy.is_none_or(anchored) {
            return Err("it has another change by anchors than the switches".to_owned());
        }
        Ok(())
    }

    fn confirm_work(&self, state: &ChainState, counters: &Counters) -> Result<(), String> {
        let Counters { plain_steps, jumps, jump_steps, windows, window_steps, switches, .. } = *counters;
        let taken = plain_steps.checked_add(jump_steps).and_then(|steps| steps.checked_add(window_steps));
        let steps = state.step - self.plan.initial.step.min(state.step);
        if taken != Some(steps) {
            return Err(format!("it is of step {}, and counts other steps", state.step));
        }
        if switches != self.switches {
            return Err(format!("it counts {switches} switches, the records {}", self.switches));
        }
        let others = [counters.refused_jumps, counters.refused_windows, counters.applications];
        if jumps > jump_steps
            || windows > window_steps
            || others.into_iter().any(|count| count > MOST_COUNTED)
        {
            return Err("it counts more work than there was".to_owned());
        }
        Ok(())
    }

    fn confirm_drive(&self, state: &ChainState) -> Result<(), String> {
        let hold = state.hold_step;
        let wrong = |recorded: &str| Err(format!("it has the drive stop in step {hold}, {recorded}"));
        if self.plan.drive.until_load_ratio.is_none() {
            let planned = self.plan.drive.hold_from_step.unwrap_or(u64::MAX);
            return if hold == planned { Ok(()) } else { wrong("the scenario does not") };
        }
        let has_stopped = hold <= state.step;
        if hold != u64::MAX && !has_stopped {
            return wrong("which is to come");
        }
        if hold > self.reached_step || (has_stopped && hold <= self.below_step && self.reached_step != hold) {
            return wrong("the loads recorded say another");
        }
        Ok(())
    }

    /// Takes the steps from the last state recorded again.
    fn confirm_motion(&self, state: &ChainState) -> Result<(), String> {
        if self.plan.elastic.lattice().is_some() {
            return self.confirm_slab(state);
        }
        let Some((fields, sliding, stuck_since_step, ledger)) = &self.fields else { return Ok(()) };
        let is_initial = fields.step <= self.plan.initial.step;
        let recording = &self.plan.recording;
        if is_initial && !recording.event_fields && recording.fields_every_steps == 0 {
            return Ok(());
        }
        let mut from = ChainState {
            step: fields.step,
            displacement_m: fields.displacement_m.clone(),
            velocity_m_per_s: fields.velocity_m_per_s.clone(),
            stick_position_m: fields.stick_position_m.clone(),
            slip: fields.detached.iter().map(|detached| f64::from(*detached)).collect(),
            detached: fields.detached.iter().map(|detached| u32::from(*detached)).sum(),
            tangential_force_n: fields.tangential_force_n.clone(),
            normal_load_n: Vec::new(),
            sliding: *sliding,
            single_steps: 0,
            no_jump_before_step: 0,
            whole_until_switch: false,
            saved_steps: 0,
            // One that came before is as good as told by the loads since.
            energy: *ledger,
            hold_step: match self.plan.drive.until_load_ratio {
                Some(_) if state.hold_step > fields.step => u64::MAX,
                _ => state.hold_step,
            },
            stuck_since_step: Vec::new(),
            aged_threshold_n: Vec::new(),
        };
        if self.plan.friction.ageing.is_some() {
            let aged = |n| aged_threshold_n(&self.plan, n, stuck_since_step, from.step);
            from.aged_threshold_n = (0..self.plan.blocks).map(aged).collect();
            from.stuck_since_step.clone_from(stuck_since_step);
        }
        if !from.fits(&self.plan) {
            return Err(format!("the state recorded in step {} is none", from.step));
        }
        let is_there = from.step == state.step;
        if !is_there {
            let mut plan = self.plan.clone();
            plan.steps = state.step;
            let mut again = Fast::new(Arc::new(plan));
            again.restore(&from);
            while again.next_record().map_err(|error| error.to_string())?.is_some() {}
            from = again.snapshot();
        }
        if from.hold_step != state.hold_step || from.slip != state.slip {
            return Err("the steps before it lead to another state of the drive or the contacts".to_owned());
        }
        self.confirm_energy(&from, state)?;
        let kinds = [
            ("displacement", "m", &from.displacement_m, &state.displacement_m),
            ("velocity", "m/s", &from.velocity_m_per_s, &state.velocity_m_per_s),
            ("tangential force", "N", &from.tangential_force_n, &state.tangential_force_n),
        ];
        for (what, unit, expected, found) in kinds {
            let largest = expected.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
            // What is at rest in one is so in the other, but for rounding.
            let most = if is_there { 0.0 } else { TOLERANCE * largest + f64::MIN_POSITIVE };
            let differs = |(a, b): (&f64, &f64)| (a - b).abs() > most;
            if let Some(n) = expected.iter().zip(found).position(differs) {
                return Err(format!(
                    "it has a {what} of {} {unit} for block {}, the steps before it lead to {} {unit}",
                    found[n],
                    n + 1,
                    expected[n]
                ));
            }
        }
        Ok(())
    }

    /// Of a slab only the contacts are recorded, so its steps cannot be taken again. But what its
    /// nodes store is what the energies leave over; and where the contacts are recorded in the
    /// state's own step, they are there.
    fn confirm_slab(&self, state: &ChainState) -> Result<(), String> {
        let plan = Arc::new(self.plan.clone());
        let mut stepper = LatticeStepper::new(Arc::clone(&plan), Sweeps::detect());
        stepper.restore(state);
        let found = stepper.energy();
        if let Some(found) = &found {
            Budget::of(&plan).balance(found)?;
        }
        let Some((step, _)) = self.last.filter(|(step, _)| *step == state.step) else { return Ok(()) };
        if self.energy != found {
            return Err(format!("it has other energies than the record of step {step}"));
        }
        let Some((fields, ..)) = self.fields.as_ref().filter(|(fields, ..)| fields.step == step) else {
            return Ok(());
        };
        let at_contacts = recorder::fields(&plan, state);
        match at_contacts == *fields {
            true => Ok(()),
            false => Err(format!("its contacts are not where the record of step {step} has them")),
        }
    }

    /// Holds the energies of a state against those that the records lead to.
    fn confirm_energy(&self, expected: &ChainState, state: &ChainState) -> Result<(), String> {
        let plan = Arc::new(self.plan.clone());
        let mut stepper = Stepper::new(plan, Sweeps::detect(), Bookkeeping::Spans);
        let [expected, found] = [expected, state].map(|state| {
            stepper.restore(state);
            stepper.energy()
        });
        let (Some(expected), Some(mut found)) = (expected, found) else {
            return match (expected, found) {
                (Some(_), None) => Err("it has no energies, the records have".to_owned()),
                _ => Ok(()),
            };
        };
        let kinds = [
            ("work of the drive", expected.drive_work_j, found.drive_work_j),
            ("friction heat", expected.friction_heat_j, found.friction_heat_j),
            ("work of the scheme", expected.scheme_work_j, found.scheme_work_j),
        ];
        let largest = kinds
            .iter()
            .map(|(_, expected, _)| expected.abs())
            .fold(expected.kinetic_j + expected.elastic_j, f64::max);
        for (what, expected, found) in kinds {
            let is_near = (expected - found).abs() <= TOLERANCE * largest + f64::MIN_POSITIVE;
            if !is_near {
                return Err(format!(
                    "it has a {what} of {found} J, the steps before it lead to {expected} J"
                ));
            }
        }
        // What the plain solver adds up; for the fast one it is what the balance leaves.
        let viscous_j = state.energy.map_or(0.0, |ledger| ledger.viscous_loss_j.value());
        if viscous_j != 0.0 {
            found.viscous_loss_j = viscous_j;
        }
        Budget::of(&self.plan).balance(&found)
    }
}
