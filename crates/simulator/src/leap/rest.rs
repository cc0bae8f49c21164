//! Chains at rest under laws without friction springs: nothing moves until a contact detaches.

use asperity_model::{Plan, SliderState};

use crate::energy::Accounts;
use crate::leap::clearance::Clearance;
use crate::leap::norms::ROUNDING;
use crate::step::strength::StopForce;

/// Number of steps for which a chain stays at rest when all its blocks stick without springs. Nothing
/// moves: only the pull of the drive and the thresholds change, so only these round.
pub(crate) fn rest_steps(plan: &Plan, state: &SliderState) -> u64 {
    let [last, next] = [state.step, state.step + 1].map(|step| plan.outside(step, state.hold_step));
    let (advance_m, ramp) = (next.advance_m(), next.ramp());
    let mut rates = vec![0.0; plan.blocks];
    // Values of the last step, in which the drive pulled slightly less.
    let mut forces = state.tangential_force_n.clone();
    for spring in &plan.drive.springs {
        let stretch_m = spring.direction * (next.point_m - last.point_m);
        forces[spring.block] += spring.stiffness_n_per_m * stretch_m;
        rates[spring.block] = spring.force_n(advance_m, 0.0);
    }
    let mut clearance = Clearance::ENDLESS;
    for n in 0..plan.blocks {
        let threshold = plan.friction.static_threshold_n[n];
        let room = ramp.load.scaled_n(threshold) * (1.0 - ROUNDING);
        if !clearance.stays_between(forces[n], rates[n], room, -ramp.change_n(threshold)) {
            return 0;
        }
    }
    if let Some(stop) = StopForce::of(plan, state.hold_step) {
        let force = plan.drive.total_force_n(next.point_m, &state.displacement_m);
        let rate = plan.drive.total_force_n(advance_m, &vec![0.0; plan.blocks]);
        if !clearance.stays_below_stop(stop, (ramp.load, ramp), (force, rate), [0.0; 2]) {
            return 0;
        }
    }
    clearance.steps()
}

/// Takes steps in which nothing moves but the drive point.
pub(crate) fn rest(plan: &Plan, steps: u64, state: &mut SliderState) {
    let from_step = state.step;
    state.step += steps;
    state.sliding = 0;
    let displacement_m = std::mem::take(&mut state.displacement_m);
    let sum_m = |n: usize| steps as f64 * displacement_m[n];
    Accounts::add_drive(plan, state, from_step, steps, sum_m, |n| displacement_m[n]);
    state.displacement_m = displacement_m;
}
