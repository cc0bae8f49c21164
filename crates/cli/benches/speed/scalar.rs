//! The reference loop for speed: a program for this chain that records nothing and loops from block to
//! block, compiled without tuning.

use asperity_model::Plan;

/// The parts of a plan that the loop needs; all blocks of the measured scenarios share thresholds and
/// sliding friction.
struct Constants {
    k: f64,
    eta: f64,
    kt: f64,
    dt: f64,
    dt_over_m: f64,
    threshold: f64,
    sliding_friction: f64,
}

struct Block {
    stick: f64,
    slides: bool,
}

/// Takes steps from a plan's start; displacement of block 1, and block switches. The
/// one-way rule only.
pub(crate) fn run(plan: &Plan, steps: u64) -> (f64, u64) {
    let dt = plan.grid.step_s();
    let constants = Constants {
        k: plan.elastic.stiffness_n_per_m,
        eta: plan.elastic.damping_kg_per_s,
        kt: plan.friction.interfacial_stiffness_n_per_m,
        dt,
        dt_over_m: dt / plan.block_mass_kg,
        threshold: plan.friction.static_threshold_n[0],
        sliding_friction: plan.friction.dynamic_friction_n[0],
    };
    let (mut u, mut v) = (plan.initial.displacement_m.clone(), plan.initial.velocity_m_per_s.clone());
    let drive_n_per_m = plan.drive.stiffest_n_per_m();
    let mut tau = vec![0.0; plan.blocks];
    let mut friction: Vec<Block> =
        plan.initial.stick_position_m.iter().map(|&stick| Block { stick, slides: false }).collect();
    let mut switches = 0;
    for step in 1..=steps {
        let drive = drive_n_per_m * (plan.drive.velocity_m_per_s * (step as f64 * dt) - u[0]);
        add_up_forces(&mut tau, &u, &v, &constants);
        tau[0] += drive;
        switches += move_blocks(&mut u, &mut v, &mut friction, &tau, &constants);
    }
    (u[0], switches)
}

// Separate functions, so that each has all registers.
#[inline(never)]
fn add_up_forces(tau: &mut [f64], u: &[f64], v: &[f64], constants: &Constants) {
    let &Constants { k, eta, .. } = constants;
    let last = tau.len() - 1;
    tau[0] = k * (u[1] - u[0]) + eta * (v[1] - v[0]);
    for (tau, (u, v)) in tau[1..last].iter_mut().zip(u.windows(3).zip(v.windows(3))) {
        *tau = k * (u[2] - 2.0 * u[1] + u[0]) + eta * (v[2] - 2.0 * v[1] + v[0]);
    }
    tau[last] = k * (u[last - 1] - u[last]) + eta * (v[last - 1] - v[last]);
}

#[inline(never)]
fn move_blocks(
    u: &mut [f64],
    v: &mut [f64],
    friction: &mut [Block],
    tau: &[f64],
    constants: &Constants,
) -> u64 {
    let &Constants { kt, dt, dt_over_m, threshold, sliding_friction, .. } = constants;
    let mut switches = 0;
    for ((u, v), (Block { stick, slides }, tau)) in
        u.iter_mut().zip(v.iter_mut()).zip(friction.iter_mut().zip(tau))
    {
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
            if tau.abs() >= threshold {
                *slides = true;
                switches += 1;
            }
        }
    }
    switches
}
