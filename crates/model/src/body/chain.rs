//! The stuck chain in static equilibrium or in steady motion.

use crate::body::elastic::Chain;
pub use crate::body::elastic::Stiffness;
use crate::plan::Plan;
use crate::plan::outside::Outside;

impl Stiffness {
    /// The stiffness of a plan's chain with every contact stuck by a friction spring.
    pub fn of(plan: &Plan, chain: &Chain) -> Stiffness {
        let mut held_n_per_m = plan.drive.stiffness_n_per_m(plan.blocks);
        let bonds = || plan.end_bonds.iter();
        for bond in bonds().filter(|bond| bond.other.is_none()) {
            held_n_per_m[bond.block] += bond.stiffness_n_per_m;
        }
        let stuck = chain.stuck(&plan.friction.springs_n_per_m, &held_n_per_m);
        match bonds().find(|bond| bond.other.is_some()) {
            Some(bond) => stuck.closed_by(bond.stiffness_n_per_m, plan.blocks),
            None => stuck,
        }
    }
}

/// The steady motion of a stuck chain behind a uniformly moving drive point, after vibrations have
/// decayed: every block advances by the same distance in every step.
#[derive(Debug, Clone)]
pub struct SteadyLoading {
    /// `b`, with `M b = sum_n e_n K_n d_n V dt`.
    pub advance_m: Vec<f64>,
    /// `v_q = b / dt`.
    pub velocity_m_per_s: Vec<f64>,
    /// `eta L v_q`, with the second difference `L`.
    viscous_n: Vec<f64>,
}

impl SteadyLoading {
    /// The steady motion for a drive point that moves by `point_m` in each step.
    pub fn of(plan: &Plan, stiffness: &Stiffness, point_m: f64) -> SteadyLoading {
        let dt = plan.grid.step_s();
        let mut advance_m = vec![0.0; plan.blocks];
        if point_m != 0.0 {
            for spring in &plan.drive.springs {
                advance_m[spring.block] = spring.force_n(point_m, 0.0);
            }
            stiffness.solve(&mut advance_m);
        }
        let velocity_m_per_s: Vec<f64> = advance_m.iter().map(|advance| advance / dt).collect();
        let mut viscous_n: Vec<f64> =
            (0..plan.blocks).map(|n| plan.elastic.damping_force_n(&velocity_m_per_s, n)).collect();
        for bond in &plan.end_bonds {
            bond.add(-bond.damping_kg_per_s * bond.stretch(&velocity_m_per_s), &mut viscous_n);
        }
        SteadyLoading { advance_m, velocity_m_per_s, viscous_n }
    }

    /// `a`, the displacements before a step: `M a = k_t u_stick + eta L v_q + F`, with the forces `F` from outside in that step on
    /// blocks at rest at 0, and the dashpots of the ends in `eta L`.
    pub fn position_m(
        &self,
        plan: &Plan,
        stiffness: &Stiffness,
        stick_position_m: &[f64],
        outside: Outside<'_>,
        position_m: &mut [f64],
    ) {
        let springs = &plan.friction.springs_n_per_m;
        for (n, position) in position_m.iter_mut().enumerate() {
            *position = self.viscous_n[n] + springs[n] * stick_position_m[n];
        }
        let nowhere = vec![0.0; plan.blocks];
        outside.add_n(position_m, [&nowhere, &nowhere]);
        stiffness.solve(position_m);
    }
}
