//! A fault line in an elastic medium, quasi-dynamic: per node, with `w` the slip less that of the drive,
//!
//! ```text
//! T = tau_0 + K w = sigma a asinh[(V / 2 V_0) exp(psi / a)] + eta V,    psi = f_0 + b phi,    w' = V - V_p,
//! ```
//!
//! where `phi = ln(V_0 theta / D_c)` is the unknown, so that `b` may be 0: `phi' = (V_0 exp(-phi) - |V|) / D_c` by the
//! ageing law, `-(|V| / D_c) (phi + ln(|V| / V_0))` by the slip law. Energies are per metre of strike: the stored one is
//! `-dz sum c w K w / 2`, with `c` the share of a cell, and its rate is that of drive, friction and waves, which are
//! unknowns as well.

use asperity_model::body::medium::Medium;
use asperity_model::law::rate_and_state::{Evolution, RateAndState};
use asperity_model::plan::adaptive_state::POWERS;
use asperity_record::Energy;

use super::convolution::Convolution;
use crate::kernels::{self, NodeFriction};

/// Stress `T`, velocity `V` and its rise `dV / dT` at every node.
#[derive(Debug, Clone, Default)]
pub(super) struct Field {
    pub(super) stress: Vec<f64>,
    pub(super) velocity: Vec<f64>,
    pub(super) slope: Vec<f64>,
}

/// The equations of a line, with the numbers of the last evaluation.
#[derive(Debug, Clone)]
pub(super) struct Line {
    pub(super) medium: Medium,
    law: RateAndState,
    convolution: Convolution,
    /// `eta`.
    radiation_pa_s_per_m: f64,
    /// `sigma a`, `f_0 / a` and `b / a`, and `c`.
    direct_pa: Vec<f64>,
    state_over_a: [Vec<f64>; 2],
    weight: Vec<f64>,
    /// `max |S|` and the least `D_c`.
    stiffest_pa_per_m: f64,
    least_slip_m: f64,
    pub(super) field: Field,
}

impl Line {
    pub(super) fn of(medium: &Medium, law: RateAndState) -> Line {
        let nodes = medium.nodes();
        let by_a = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
            medium.direct_effect.iter().enumerate().map(|(n, a)| of(n) / a).collect()
        };
        let direct = medium.normal_stress_pa.iter().zip(&medium.direct_effect);
        let (convolution, zeros) = (Convolution::of(medium), || vec![0.0; nodes]);
        Line {
            law,
            radiation_pa_s_per_m: medium.radiation_pa_s_per_m(),
            direct_pa: direct.map(|(sigma, a)| sigma * a).collect(),
            state_over_a: [by_a(&|_| law.reference_coefficient), by_a(&|n| medium.evolution_effect[n])],
            weight: (0..nodes).map(|n| medium.weight(n)).collect(),
            stiffest_pa_per_m: kernels::largest(&convolution.spectrum),
            least_slip_m: medium.critical_slip_m.iter().copied().fold(f64::INFINITY, f64::min),
            field: Field { stress: zeros(), velocity: zeros(), slope: zeros() },
            convolution,
            medium: medium.clone(),
        }
    }

    /// Brings stresses and velocities to `w` and `phi`.
    pub(super) fn evaluate(&mut self, w: &[f64], phi: &[f64]) {
        let Field { mut stress, mut velocity, mut slope } = std::mem::take(&mut self.field);
        self.convolution.stress(&mut stress, &self.medium.prestress_pa, w);
        self.velocities([&mut velocity, &mut slope], 0, &stress, phi);
        self.field = Field { stress, velocity, slope };
    }

    /// `V` and `dV / dT` of the nodes from `first` on, of their stresses and states.
    fn velocities(&self, found: [&mut [f64]; 2], first: usize, stress: &[f64], phi: &[f64]) {
        let friction = NodeFriction {
            direct_pa: &self.direct_pa[first..][..phi.len()],
            state_over_a: self.state_over_a.each_ref().map(|of| &of[first..][..phi.len()]),
            reference_m_per_s: self.law.reference_velocity_m_per_s,
            radiation_pa_s_per_m: self.radiation_pa_s_per_m,
        };
        kernels::velocities(found, stress, phi, &friction);
    }

    /// `|V|` of node `n`, of its stress and state.
    pub(super) fn speed_m_per_s(&self, n: usize, stress: f64, phi: f64) -> f64 {
        let [mut velocity, mut slope] = [[0.0]; 2];
        self.velocities([&mut velocity, &mut slope], n, &[stress], &[phi]);
        velocity[0].abs()
    }

    /// `w'`, `phi'` and the powers, evaluated last at `phi`, with the drive at `V_p`.
    pub(super) fn rates(&self, phi: &[f64], drive_m_per_s: f64, rates: &mut [f64]) {
        let (Field { stress, velocity, .. }, slip_m) = (&self.field, &self.medium.critical_slip_m);
        let v0 = self.law.reference_velocity_m_per_s;
        let (behind_rate, rest) = rates.split_at_mut(phi.len());
        let (state_rate, work_w) = rest.split_at_mut(phi.len());
        for (rate, v) in behind_rate.iter_mut().zip(velocity) {
            *rate = v - drive_m_per_s;
        }
        let nodes = state_rate.iter_mut().zip(phi).zip(velocity.iter().zip(slip_m));
        match self.law.evolution {
            Evolution::Ageing => kernels::age(state_rate, phi, velocity, slip_m, v0),
            Evolution::Slip => nodes.for_each(|((rate, phi), (v, slip_m))| {
                let ln_speed = if *v == 0.0 { 0.0 } else { libm::log(v.abs() / v0) };
                *rate = -v.abs() / slip_m * (phi + ln_speed);
            }),
            Evolution::Prz => nodes.for_each(|((rate, phi), (v, slip_m))| {
                let healing = v0 * libm::exp(-phi);
                *rate = 0.5 * (healing - v * v / healing) / slip_m;
            }),
        }
        let of = [stress, velocity, &self.medium.prestress_pa, &self.weight];
        let powers = kernels::powers(of.map(|of| &**of), drive_m_per_s, self.radiation_pa_s_per_m);
        work_w.iter_mut().zip(powers).for_each(|(w, power)| *w = self.medium.spacing_m * power);
    }

    /// A bound on the rate at which small changes decay, 1/s.
    pub(super) fn decay_per_s(&self, field: &Field) -> f64 {
        self.stiffest_pa_per_m * kernels::largest(&field.slope)
            + kernels::largest(&field.velocity) / self.least_slip_m
    }

    /// The change of the stress at node `n` per change of the slip of each.
    pub(super) fn stiffness_pa_per_m(&self, n: usize) -> Vec<f64> {
        self.convolution.row(n, self.weight.len())
    }

    /// The extent of node `n`, m.
    fn cell_m(&self, n: usize) -> f64 {
        self.weight[n] * self.medium.spacing_m
    }

    /// The friction that bears the stress at node `n`, per metre of strike.
    pub(super) fn friction_n(&self, field: &Field, n: usize) -> f64 {
        (field.stress[n] - self.radiation_pa_s_per_m * field.velocity[n]) * self.cell_m(n)
    }

    pub(super) fn moment_rate_n_m_per_s(&self, field: &Field) -> f64 {
        let sum: f64 = field.velocity.iter().enumerate().map(|(n, v)| self.cell_m(n) * v).sum();
        self.medium.shear_modulus_pa * sum
    }

    /// Energies at `w`, which was evaluated last.
    pub(super) fn energy(
        &self,
        w: &[f64],
        [drive_work_j, friction_heat_j, radiated_j]: [f64; POWERS],
    ) -> Energy {
        let stored = |(n, w): (usize, &f64)| {
            -0.5 * self.cell_m(n) * w * (self.field.stress[n] - self.medium.prestress_pa[n])
        };
        Energy {
            drive_work_j,
            friction_heat_j,
            radiated_j: Some(radiated_j),
            elastic_j: w.iter().enumerate().map(stored).sum(),
            ..Energy::default()
        }
    }

    /// Of node `n`: friction, N per metre, friction over the load, `psi` and `theta`, s.
    pub(super) fn friction_of(&self, field: &Field, phi: &[f64], n: usize) -> [f64; 4] {
        let (law, medium, friction_n) = (&self.law, &self.medium, self.friction_n(field, n));
        let unit_s = law.steady_theta_s(law.reference_velocity_m_per_s) / law.critical_slip_m;
        [
            friction_n,
            friction_n / (medium.normal_stress_pa[n] * self.cell_m(n)),
            law.reference_coefficient + medium.evolution_effect[n] * phi[n],
            (unit_s * medium.critical_slip_m[n] * libm::exp(phi[n])).min(f64::MAX),
        ]
    }
}
