//! How much rounding the plain stepper amplifies in a run, and when it decides a switch.

use asperity_model::Plan;
use asperity_record::Record;
use asperity_simulator::{Plain, Solver};

use super::{entries, left_of, steps};

/// Single steps before velocities are changed.
const BEFORE: u64 = 100;

/// The plain stepper's records after its first [`BEFORE`] steps, with velocities changed by that share there.
fn nudged(plan: &Plan, nudge: f64) -> Vec<Record> {
    let mut nudged = Plain::new(plan.clone());
    for _ in 0..BEFORE {
        nudged.take_step();
    }
    let mut state = nudged.snapshot();
    for velocity in &mut state.slider.velocity_m_per_s {
        *velocity *= 1.0 + nudge;
    }
    nudged.restore(&state);
    left_of(&mut nudged)
}

/// Relative difference of forces on blocks that switch, between the plain stepper and itself with
/// velocities changed early on by a few rounding errors.
pub(super) fn amplified(plan: &Plan, plain: &[Record]) -> f64 {
    let forces = |records: &[Record]| -> Vec<f64> {
        let late = steps(records).into_iter().filter(|record| record.step > plan.initial.step + BEFORE);
        late.flat_map(|record| record.switches.iter().map(|s| s.tangential_force_n)).collect()
    };
    let (one, other) = (forces(plain), forces(&nudged(plan, 4.0 * f64::EPSILON)));
    let largest = one.iter().fold(0.0, |largest: f64, force| largest.max(force.abs()));
    one.iter().zip(&other).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs())) / largest
}

/// The step at which the plain stepper diverges from itself if its velocities are changed early on by
/// one part in 10^13, or ten. Some sliders are chaotic, so that no two ways of rounding agree for ever.
pub(super) fn horizon(plan: &Plan, plain: &[Record]) -> u64 {
    let plain = entries(plain);
    let from = plain.partition_point(|entry| entry.0 <= plan.initial.step + BEFORE);
    let parts_at = |nudge: f64| {
        let nudged = entries(&nudged(plan, nudge));
        let parted = plain[from..].iter().zip(&nudged).find(|(plain, nudged)| plain != nudged);
        parted.map_or(plan.steps, |(plain, nudged)| plain.0.min(nudged.0) - 1)
    };
    [1e-13, -1e-13, 1e-12].into_iter().map(parts_at).min().unwrap_or(plan.steps)
}
