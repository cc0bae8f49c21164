//! Whether the energies of records can be those of a plan.
//!
//! Kinetic and elastic energy and the work of the prestress follow from states of all blocks, the
//! change by anchors from the switches, to the bit. Of the others only the balance is known: what
//! is put into one of them must be taken from another. That friction heat only grows is not among
//! it: friction goes by the velocity before a step, so a block that turns round within the step is
//! pushed by it.

use asperity_model::{Law, Plan};
use asperity_record::{Direction, Energy, FieldRecord, StepRecord, Switch};

use crate::energy::{prestress_work_j, stored_j, stored_of};
use crate::lattice;
use crate::ledger::Sum;
use crate::state::ChainState;
use crate::sweep::{Stored, Sweeps};

/// How far the balance may be off, over the largest energy: some thousand roundings of totals that
/// are sums of hundreds of millions of parts.
const ROUNDING: f64 = 1e-9;

/// What friction springs hold as they take hold in a step, less what they lose as they let go.
pub(crate) fn anchored_j(plan: &Plan, switches: &[Switch]) -> f64 {
    if plan.friction.law != Law::Springs {
        return 0.0;
    }
    let kt = plan.friction.interfacial_stiffness_n_per_m;
    let parts = switches.iter().map(|switch| {
        let stretch_m = switch.displacement_m - switch.stick_position_m;
        let held_j = 0.5 * kt * stretch_m * stretch_m;
        if switch.direction == Direction::Attach { held_j } else { -held_j }
    });
    parts.fold(0.0, |sum, part| sum + part)
}

/// What is known of the energies up to a record.
#[derive(Debug, Clone)]
pub(crate) struct Budget {
    initial_j: f64,
    /// The change by anchors; `None` where switches may be missing.
    anchor_change_j: Option<Sum>,
    largest_j: f64,
}

impl Budget {
    /// Before the first step of a plan.
    pub(crate) fn of(plan: &Plan) -> Budget {
        let initial = ChainState::initial(plan);
        let (kinetic_j, elastic_j) = match plan.elastic.lattice() {
            Some(_) => lattice::stored_j(plan, &initial),
            None => {
                let stored = stored_of(plan, &initial);
                stored_j(Sweeps::detect(), plan, &stored, initial.step, initial.hold_step)
            }
        };
        let initial_j = kinetic_j + elastic_j;
        Budget { initial_j, anchor_change_j: None, largest_j: initial_j.abs() }
    }

    /// That all switches from the start on will be there.
    pub(crate) fn begin(&mut self) {
        self.anchor_change_j = Some(Sum::default());
    }

    /// Forgets what may have changed in steps that are missing.
    pub(crate) fn lose_sight(&mut self) {
        self.anchor_change_j = None;
    }

    /// The energies of the next step.
    pub(crate) fn step(&mut self, plan: &Plan, record: &StepRecord) -> Result<(), String> {
        let energy = match &record.energy {
            None if !plan.recording.energies => return Ok(()),
            None => return Err("it lacks the energies".to_owned()),
            Some(_) if !plan.recording.energies => {
                return Err("it has energies, and the scenario asks for none".to_owned());
            }
            Some(energy) => energy,
        };
        self.balance(energy)?;
        let pushes = !plan.prestress_n.is_empty() || plan.elastic.lattice().is_some();
        if !pushes && energy.prestress_work_j != 0.0 {
            return Err(format!("there is no prestress, and its work is {} J", energy.prestress_work_j));
        }
        self.anchors(plan, record, energy)
    }

    /// What is put into one of them must be taken from another.
    pub(crate) fn balance(&mut self, energy: &Energy) -> Result<(), String> {
        let parts = energy.parts();
        self.largest_j = parts.iter().fold(self.largest_j, |most, (_, part)| most.max(part.abs()));
        let missing_j = energy.balance_j() + self.initial_j;
        match missing_j.abs() <= ROUNDING * self.largest_j {
            true => Ok(()),
            false => Err(format!("the energies do not balance: {missing_j} J are left over")),
        }
    }

    fn anchors(&mut self, plan: &Plan, record: &StepRecord, energy: &Energy) -> Result<(), String> {
        let Some(sum) = &mut self.anchor_change_j else { return Ok(()) };
        sum.add(anchored_j(plan, &record.switches));
        let (expected_j, found_j) = (sum.value(), energy.anchor_change_j);
        if found_j != expected_j {
            return Err(format!(
                "the change by anchors is {found_j} J, and the switches give {expected_j} J"
            ));
        }
        Ok(())
    }

    /// The energies of a step, and the state of all blocks after it; `hold_step` where it is known
    /// when the drive point stops.
    pub(crate) fn state(
        plan: &Plan,
        energy: &Energy,
        state: &FieldRecord,
        hold_step: Option<u64>,
    ) -> Result<(), String> {
        let slip: Vec<f64> = state.detached.iter().map(|&detached| f64::from(detached)).collect();
        let stored = Stored {
            elastic: &plan.elastic,
            u: &state.displacement_m,
            v: &state.velocity_m_per_s,
            u_stick: &state.stick_position_m,
            slip: &slip,
            kt: plan.friction.interfacial_stiffness_n_per_m,
        };
        let (kinetic_j, elastic_j) =
            stored_j(Sweeps::detect(), plan, &stored, state.step, hold_step.unwrap_or(u64::MAX));
        let prestress_j = prestress_work_j(plan, &state.displacement_m);
        let kinds = [
            ("the kinetic energy", energy.kinetic_j, kinetic_j),
            ("the work of the prestress", energy.prestress_work_j, prestress_j),
            (
                "the elastic energy",
                energy.elastic_j,
                if hold_step.is_some() { elastic_j } else { energy.elastic_j },
            ),
        ];
        match kinds.into_iter().find(|(_, found, expected)| found != expected) {
            Some((what, found_j, expected_j)) => {
                Err(format!("{what} is {found_j} J, and the blocks are where it is {expected_j} J"))
            }
            None => Ok(()),
        }
    }
}
