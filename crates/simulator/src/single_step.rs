//! A single step as recorders and solvers see it, whichever body took it.

use asperity_record::Energy;

use crate::state::SliderState;

/// The drive in one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Driving {
    /// Sum of the forces on all nodes, N.
    pub total_n: f64,
    /// The forces on the first and the last block where the drive pulls both ways.
    pub ends_n: Option<[f64; 2]>,
}

/// A stepper after a single step, for any body.
pub(crate) trait SingleSteps {
    /// The state after that step.
    fn state(&self) -> &SliderState;
    /// The contacts that switched in it, counted from 0.
    fn switched(&self) -> &[usize];
    /// Energies at its end.
    fn energy(&mut self) -> Energy;
    /// Energy at the start that may set the slider in motion.
    fn initial_j(&self) -> f64;
}
