//! The stuck chain at rest or in steady motion.

use crate::Plan;

/// The stuck chain's stiffness `M`, of springs between blocks, friction springs and drive,
/// ready to be solved with: tridiagonal and positive definite, so elimination without
/// pivoting is stable.
#[derive(Debug, Clone)]
pub struct Stiffness {
    /// `k` over each pivot.
    factor: Vec<f64>,
    /// 1 over each pivot.
    inverse: Vec<f64>,
}

impl Stiffness {
    /// Of a plan's chain, every block stuck by a friction spring.
    pub fn of(plan: &Plan) -> Stiffness {
        let (k, kt) = (plan.stiffness_n_per_m, plan.friction.interfacial_stiffness_n_per_m);
        let drive = plan.drive.stiffness_n_per_m(plan.blocks);
        let mut inverse: Vec<f64> = Vec::with_capacity(plan.blocks);
        for (n, drive) in drive.into_iter().enumerate() {
            let neighbours = if n == 0 || n + 1 == plan.blocks { 1.0 } else { 2.0 };
            let diagonal = kt + neighbours * k + drive;
            let before = inverse.last().map_or(0.0, |inverse| k * inverse * k);
            inverse.push(1.0 / (diagonal - before));
        }
        Stiffness { factor: inverse.iter().map(|inverse| k * inverse).collect(), inverse }
    }

    /// Turns `pull` into the `x` with `M x = pull`.
    pub fn solve(&self, pull: &mut [f64]) {
        let last = pull.len() - 1;
        for n in 1..=last {
            pull[n] += self.factor[n - 1] * pull[n - 1];
        }
        pull[last] *= self.inverse[last];
        for n in (0..last).rev() {
            pull[n] = self.inverse[n] * pull[n] + self.factor[n] * pull[n + 1];
        }
    }
}

/// How a stuck chain follows a drive point that moves steadily, once it no longer
/// vibrates: every block advances by the same distance in every step.
#[derive(Debug, Clone)]
pub struct SteadyLoading {
    /// `b`, with `M b = sum_n e_n K_n d_n V dt`.
    pub advance_m: Vec<f64>,
    /// `v_q = b / dt`.
    pub velocity_m_per_s: Vec<f64>,
    /// `eta L v_q`, with `L` the second difference.
    viscous_n: Vec<f64>,
}

impl SteadyLoading {
    /// For a drive point that moves as fast as the plan says, or one that stands.
    pub fn of(plan: &Plan, stiffness: &Stiffness, moves: bool) -> SteadyLoading {
        let dt = plan.grid.step_s();
        let mut advance_m = vec![0.0; plan.blocks];
        if moves {
            for spring in &plan.drive.springs {
                advance_m[spring.block] = spring.force_n(plan.drive.velocity_m_per_s * dt, 0.0);
            }
            stiffness.solve(&mut advance_m);
        }
        let velocity_m_per_s: Vec<f64> = advance_m.iter().map(|advance| advance / dt).collect();
        let viscous_n = (0..plan.blocks)
            .map(|n| plan.damping_kg_per_s * crate::initial::neighbour_pull(&velocity_m_per_s, n))
            .collect();
        SteadyLoading { advance_m, velocity_m_per_s, viscous_n }
    }

    /// `a`, the displacements from which the step with the drive point at `point_m` is taken:
    /// `M a = k_t u_stick + eta L v_q + sum_n e_n K_n d_n point`.
    pub fn position_m(
        &self,
        plan: &Plan,
        stiffness: &Stiffness,
        stick_position_m: &[f64],
        point_m: f64,
        position_m: &mut [f64],
    ) {
        let kt = plan.friction.interfacial_stiffness_n_per_m;
        for (n, position) in position_m.iter_mut().enumerate() {
            *position = self.viscous_n[n] + kt * stick_position_m[n];
        }
        for spring in &plan.drive.springs {
            position_m[spring.block] += spring.force_n(point_m, 0.0);
        }
        stiffness.solve(position_m);
    }
}
