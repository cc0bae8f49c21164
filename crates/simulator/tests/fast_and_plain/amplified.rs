//! How much rounding the plain stepper amplifies in a run.

use asperity_model::Plan;
use asperity_record::Record;
use asperity_simulator::{Plain, Solver};

/// Single steps before velocities are changed.
const BEFORE: u64 = 100;

/// The plain stepper's records after its first [`BEFORE`] steps, with velocities changed by that share there.
pub(crate) fn nudged(plan: &Plan, nudge: f64) -> Vec<Record> {
    let mut nudged = Plain::new(plan.clone());
    for _ in 0..BEFORE {
        nudged.take_step();
    }
    let mut state = nudged.snapshot();
    for velocity in &mut state.slider.velocity_m_per_s {
        *velocity *= 1.0 + nudge;
    }
    nudged.restore(&state);
    std::iter::from_fn(|| nudged.next_record().unwrap()).collect()
}

/// Relative difference of forces on blocks that switch, between the plain stepper and itself with
/// velocities changed early on by a few rounding errors.
pub(crate) fn amplified(plan: &Plan, plain: &[Record]) -> f64 {
    let forces = |records: &[Record]| -> Vec<f64> {
        let late = records.iter().filter_map(|record| match record {
            Record::Step(step) if step.step > plan.initial.step + BEFORE => Some(step),
            _ => None,
        });
        late.flat_map(|record| record.switches.iter().map(|s| s.tangential_force_n)).collect()
    };
    let (one, other) = (forces(plain), forces(&nudged(plan, 4.0 * f64::EPSILON)));
    let largest = one.iter().fold(0.0, |largest: f64, force| largest.max(force.abs()));
    one.iter().zip(&other).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs())) / largest
}
