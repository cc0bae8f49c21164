//! A single step as recorders and solvers see it, whichever body took it.

use std::fmt::Debug;

use asperity_model::{Plan, SliderState};
use asperity_record::Energy;

use crate::records::counters::Counters;

/// The drive in one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Driving {
    /// Sum of the forces on all nodes, N.
    pub total_n: f64,
    /// The forces on the first and the last block where the drive pulls both ways.
    pub ends_n: Option<[f64; 2]>,
}

impl Driving {
    /// With the point of the drive at the step of a state, and the nodes where they are; also the pull of its springs in
    /// the direction in which it moves. Each force on a node is passed on.
    #[inline]
    pub(crate) fn of(plan: &Plan, state: &SliderState, mut pull: impl FnMut(usize, f64)) -> (Driving, f64) {
        let point_m = plan.drive_point_m(state.step, state.hold_step);
        let (mut total_n, mut ends_n, mut along_n, mut both_ways) = (0.0, [0.0; 2], 0.0, false);
        for spring in &plan.drive.springs {
            let force_n = spring.force_n(point_m, state.displacement_m[spring.block]);
            pull(spring.block, force_n);
            total_n += force_n;
            along_n += spring.direction * force_n;
            both_ways |= spring.direction < 0.0;
            if spring.block == 0 {
                ends_n[0] = force_n;
            } else if spring.block == plan.blocks - 1 {
                ends_n[1] = force_n;
            }
        }
        if let Some(force_n) = plan.drive_force_n(state.step, state.hold_step) {
            pull(0, force_n);
            total_n += force_n;
        }
        (Driving { total_n, ends_n: both_ways.then_some(ends_n) }, along_n)
    }
}

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
