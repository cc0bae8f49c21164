//! What a state of the contacts of a slab must agree with, told without its nodes.

use asperity_model::Plan;
use asperity_record::{FieldRecord, StepRecord};

use crate::contacts::aged_coefficient;

/// How far the drive's force may be from what follows from a state, over the largest terms of its
/// sum: some thousand roundings.
const ROUNDING: f64 = 1e-12;

/// That the contacts bear what the thresholds of their switches say, and are pulled as much as the
/// drive pulls where all of it is at contacts. `stuck_since_step` is empty where contacts do not age,
/// and `hold_step` given where it is known when the drive stops.
pub(crate) fn is_state_of(
    plan: &Plan,
    step: &StepRecord,
    record: &FieldRecord,
    stuck_since_step: &[u64],
    hold_step: Option<u64>,
) -> Result<(), String> {
    for switch in &step.switches {
        let n = switch.block as usize - 1;
        let since_step = stuck_since_step.get(n).copied();
        if since_step.is_some_and(|since| since > step.step) {
            continue;
        }
        let expected_n = aged_coefficient(plan, n, since_step, step.step) * record.normal_load_n[n];
        if switch.threshold_n != expected_n {
            return Err(format!(
                "the threshold of block {} is {} N, and it bears what makes {expected_n} N",
                switch.block, switch.threshold_n
            ));
        }
    }
    let Some(hold_step) = hold_step else { return Ok(()) };
    let springs = &plan.drive.springs;
    if springs.iter().any(|spring| spring.block >= plan.blocks) {
        return Ok(());
    }
    let (dt, point_m) = (plan.grid.step_s(), plan.drive_point_m(step.step, hold_step));
    let (mut driving_n, mut bound_n) = (0.0, 0.0);
    for spring in springs {
        let before_m = record.displacement_m[spring.block] - dt * record.velocity_m_per_s[spring.block];
        driving_n += spring.force_n(point_m, before_m);
        bound_n += spring.stiffness_n_per_m * (point_m.abs() + before_m.abs() + spring.rest_m.abs());
    }
    if (driving_n - step.driving_force_n).abs() > ROUNDING * bound_n {
        return Err(format!(
            "the driving force is {} N, and the blocks are where it is {driving_n} N",
            step.driving_force_n
        ));
    }
    Ok(())
}
