//! Bodies: how nodes are joined, and one step of their motion.
//!
//! A body computes the part of a step that depends on how its nodes are joined: the pull between them, the
//! normal load on its contacts, friction, the motion of all freedoms, and the energies of these. The
//! [`Stepper`](crate::step::stepper::Stepper) does the rest: drive, switches, the end of the drive.
//!
//! A body is a file of the folder `body`, and an arm where the plain and the fast solver start.

mod chain;
mod lattice;

pub(crate) use chain::ChainBody;
pub(crate) use lattice::LatticeBody;

use std::fmt::Debug;

use asperity_model::law::magnitude;
use asperity_model::plan::outside::Outside;
use asperity_model::{Plan, SliderState};
use asperity_record::Energy;

use crate::energy::Bookkeeping;

/// The part of a step that depends on the body.
pub(crate) trait Body: Clone + Debug + Send + 'static {
    /// Counts the energies of a run that begins in a given state from there.
    fn begin_in(&mut self, _plan: &Plan, _state: &mut SliderState) {}

    /// Prepares the energies for a step, the first of at least `steps_ahead` single steps.
    fn begin_step(&mut self, _plan: &Plan, _state: &mut SliderState, _steps_ahead: u64) {}

    /// Brings prestress, loads and the strength of contacts to the step, and sets the forces from outside back to these.
    fn apply_load(&mut self, plan: &Plan, state: &mut SliderState, outside: Outside<'_>);

    /// Adds a force from outside on a freedom in this step, after [`Body::apply_load`].
    fn add_force(&mut self, freedom: usize, force_n: f64);

    /// Adds the work of the drive in this step; `along_n` is the pull of its springs in the direction it
    /// moves, `moved_m` its way.
    fn add_drive(&mut self, _state: &mut SliderState, _along_n: f64, _way_m: f64) {}

    /// Computes forces, friction, new velocities and positions of all freedoms, with the tangential forces
    /// on contacts; returns whether any contact may switch.
    fn advance(&mut self, plan: &Plan, state: &mut SliderState) -> bool;

    /// Sets the bit of each contact that switches after [`Body::advance`], or may if contacts age.
    fn mark_switches(&self, plan: &Plan, state: &SliderState, marks: &mut [u64]);

    /// The magnitude of the force by which a stuck contact detached in this step: that of the tangential force without
    /// friction, unless the law says otherwise.
    fn detaching_force_n(&self, plan: &Plan, state: &SliderState, n: usize) -> f64 {
        match state.tangential_force_n.get(plan.blocks + n) {
            None => magnitude([state.tangential_force_n[n]]),
            Some(across) => magnitude([state.tangential_force_n[n], *across]),
        }
    }

    /// Updates the memory of the contacts after a step in which some switched, for a law with memory.
    fn remember(&self, plan: &Plan, state: &mut SliderState, switched: &[usize]);

    /// Displacement before the step of a freedom of a contact.
    fn former_displacement_m(&self, freedom: usize) -> f64;

    /// Adds the energy changes of the step.
    fn add_step(&mut self, plan: &Plan, state: &mut SliderState, outside: Outside<'_>);

    /// Ends the step; `is_last` if a contact switched in it or the drive stopped.
    fn end_step(&mut self, _plan: &Plan, _state: &mut SliderState, _is_last: bool) {}

    /// Energy at the start that may set the body in motion.
    fn initial_j(&self) -> f64;

    /// Energies at the end of the last step.
    fn energy(&mut self, plan: &Plan, state: &SliderState) -> Energy;

    /// Continues with the energies of a state that was not reached by the last step.
    fn follow(&mut self, _plan: &Plan, _state: &SliderState) {}
}

/// A body that a plan can ask for.
pub(crate) trait OfPlan: Body {
    /// How the model gives its nodes and bonds.
    type Elastic: Clone + Debug;

    /// The body at the start of a plan.
    fn of_plan(plan: &Plan, elastic: &Self::Elastic, state: &SliderState, keeping: Bookkeeping) -> Self;
}
