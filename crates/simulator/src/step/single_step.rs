//! A single step as recorders and solvers see it, whichever body took it.

use std::fmt::Debug;

use asperity_model::SliderState;
use asperity_model::plan::outside::Driving;
use asperity_record::Energy;

use crate::records::counters::Counters;

/// Takes single steps, of any body.
pub(crate) trait SingleSteps: Debug + Send {
    /// The state after the last step.
    fn state(&self) -> &SliderState;
    /// The contacts that switched in it, counted from 0, ascending.
    fn switched(&self) -> &[usize];
    /// Energies at its end.
    fn energy(&mut self) -> Energy;
    /// Energy at the start that may set the slider in motion.
    fn initial_j(&self) -> f64;
    /// Statistics of the steps taken so far.
    fn counters(&self) -> Counters;
    /// Takes one step, the first of at least `steps_ahead` single steps; returns the driving forces that it
    /// used.
    fn take_step(&mut self, steps_ahead: u64) -> Driving;
    /// Continues from a state.
    ///
    /// # Panics
    /// If it is of a slider of another size.
    fn restore(&mut self, state: &SliderState);
}
