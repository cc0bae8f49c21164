//! The loop that speed is measured against: what a program for this chain looks like
//! that records nothing and goes from block to block, compiled as it stands.

use asperity_model::Plan;

/// Takes steps from a plan's start; displacement of block 1, and block switches. The
/// one-way rule only.
pub(crate) fn run(plan: &Plan, steps: u64) -> (f64, u64) {
    let blocks = plan.blocks;
    let last = blocks - 1;
    let (k, eta) = (plan.stiffness_n_per_m, plan.damping_kg_per_s);
    let kt = plan.friction.interfacial_stiffness_n_per_m;
    let dt = plan.grid.step_s();
    let dt_over_m = dt / plan.block_mass_kg;
    let threshold = &plan.friction.static_threshold_n[..blocks];
    let sliding_friction = &plan.friction.dynamic_friction_n[..blocks];
    let mut u = plan.initial.displacement_m.clone();
    let mut v = plan.initial.velocity_m_per_s.clone();
    let mut stick = plan.initial.stick_position_m.clone();
    let (mut slides, mut tau) = (vec![false; blocks], vec![0.0; blocks]);
    let (u, v, stick) = (&mut u[..blocks], &mut v[..blocks], &mut stick[..blocks]);
    let (slides, tau) = (&mut slides[..blocks], &mut tau[..blocks]);
    let mut switches = 0;
    for step in 1..=steps {
        let drive = plan.drive.stiffness_n_per_m * (plan.drive.velocity_m_per_s * (step as f64 * dt) - u[0]);
        tau[0] = k * (u[1] - u[0]) + eta * (v[1] - v[0]) + drive;
        for n in 1..last {
            tau[n] = k * (u[n + 1] - 2.0 * u[n] + u[n - 1]) + eta * (v[n + 1] - 2.0 * v[n] + v[n - 1]);
        }
        tau[last] = k * (u[last - 1] - u[last]) + eta * (v[last - 1] - v[last]);
        let state = u.iter_mut().zip(v.iter_mut()).zip(stick.iter_mut().zip(slides.iter_mut()));
        let given = tau.iter().zip(threshold.iter().zip(sliding_friction));
        for (((u, v), (stick, slides)), (tau, (threshold, sliding_friction))) in state.zip(given) {
            if *slides {
                let sign = if *v > 0.0 {
                    1.0
                } else if *v < 0.0 {
                    -1.0
                } else {
                    0.0
                };
                *v += (tau - sliding_friction * sign) * dt_over_m;
                *u += *v * dt;
                if *v <= 0.0 {
                    *slides = false;
                    *stick = *u - tau / kt;
                    switches += 1;
                }
            } else {
                *v += (tau - kt * (*u - *stick)) * dt_over_m;
                *u += *v * dt;
                if tau.abs() >= *threshold {
                    *slides = true;
                    switches += 1;
                }
            }
        }
    }
    (u[0], switches)
}
