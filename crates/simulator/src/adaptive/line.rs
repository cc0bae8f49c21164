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
use asperity_model::{Plan, SliderState};
use asperity_record::Energy;

use super::convolution::Convolution;
use super::dormand_prince::DormandPrince;
use super::motion::{DriveAndLoad, Motion, StepEnd, Unknowns};
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
    medium: Medium,
    law: RateAndState,
    convolution: Convolution,
    friction: NodeFriction,
    /// `c` of each node.
    weight: Vec<f64>,
    field: Field,
}

impl Unknowns {
    /// `w`, `phi` and the energies.
    pub(super) fn line(&self) -> (&[f64], &[f64], &[f64; POWERS]) {
        let (of_nodes, work_j) = self.0.split_last_chunk().expect("energies come last");
        let (w, phi) = of_nodes.split_at(of_nodes.len() / 2);
        (w, phi, work_j)
    }
}

impl Line {
    /// `|V|` of node `n`, of its stress and state.
    pub(super) fn speed_m_per_s(&self, n: usize, stress: f64, phi: f64) -> f64 {
        let [mut velocity, mut slope] = [[0.0]; 2];
        kernels::velocities([&mut velocity, &mut slope], n, &[stress], &[phi], &self.friction);
        velocity[0].abs()
    }

    /// A bound on the rate at which small changes decay, 1/s.
    pub(super) fn decay_per_s(&self, field: &Field) -> f64 {
        let least_m = self.medium.critical_slip_m.iter().copied().fold(f64::INFINITY, f64::min);
        kernels::largest(&self.convolution.spectrum) * kernels::largest(&field.slope)
            + kernels::largest(&field.velocity) / least_m
    }

    /// The change of the stress at node `n` per change of the slip of each.
    pub(super) fn stiffness_pa_per_m(&self, n: usize) -> Vec<f64> {
        self.convolution.row(n, self.weight.len())
    }

    /// The force that friction bears at node `n`, N per metre of strike.
    fn friction_n(&self, field: &Field, n: usize) -> f64 {
        (field.stress[n] - self.friction.radiation_pa_s_per_m * field.velocity[n]) * self.medium.cell_m(n)
    }
}

impl Motion for Line {
    type Contacts = Field;
    type Method = DormandPrince;

    fn of(plan: &Plan, law: RateAndState) -> Line {
        let medium = &**plan.medium.as_ref().expect("the plan has a medium");
        let (a, b, nodes) = (&medium.direct_effect, &medium.evolution_effect, medium.nodes());
        let zeros = vec![0.0; nodes];
        let of_nodes = |of: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..nodes).map(of).collect() };
        Line {
            law,
            friction: NodeFriction {
                direct_pa: of_nodes(&|n| medium.normal_stress_pa[n] * a[n]),
                state_over_a: [of_nodes(&|n| law.reference_coefficient / a[n]), of_nodes(&|n| b[n] / a[n])],
                reference_m_per_s: law.reference_velocity_m_per_s,
                radiation_pa_s_per_m: medium.radiation_pa_s_per_m(),
            },
            weight: of_nodes(&|n| medium.weight(n)),
            field: Field { stress: zeros.clone(), velocity: zeros.clone(), slope: zeros },
            convolution: Convolution::of(medium),
            medium: medium.clone(),
        }
    }

    fn contacts(&self) -> &Field {
        &self.field
    }

    fn velocity(field: &Field, n: usize) -> f64 {
        field.velocity[n]
    }

    fn evaluate(&mut self, at: &mut Unknowns, _: DriveAndLoad) {
        let (w, phi, _) = at.line();
        let Field { stress, velocity, slope } = &mut self.field;
        self.convolution.stress(stress, &self.medium.prestress_pa, w);
        kernels::velocities([velocity, slope], 0, stress, phi, &self.friction);
    }

    fn rates(&self, at: &Unknowns, outside: DriveAndLoad, rates: &mut Unknowns) {
        let (Field { stress, velocity, .. }, slip_m) = (&self.field, &self.medium.critical_slip_m);
        let (v0, (_, phi, _)) = (self.law.reference_velocity_m_per_s, at.line());
        let (behind_rate, rest) = rates.0.split_at_mut(phi.len());
        let (state_rate, work_w) = rest.split_at_mut(phi.len());
        for (rate, v) in behind_rate.iter_mut().zip(velocity) {
            *rate = v - outside.drive_m_per_s;
        }
        let nodes = state_rate.iter_mut().zip(phi).zip(velocity.iter().zip(slip_m));
        match self.law.evolution {
            Evolution::Ageing => kernels::age(state_rate, phi, velocity, slip_m, v0),
            Evolution::Slip => nodes.for_each(|((rate, phi), (v, slip_m))| {
                let ln_speed = if *v == 0.0 { 0.0 } else { libm::log(v.abs() / v0) };
                *rate = -v.abs() / slip_m * (phi + ln_speed);
            }),
            Evolution::Prz => unreachable!("refused in a medium"),
        }
        let of = [stress, velocity, &self.medium.prestress_pa, &self.weight].map(|of| &**of);
        let powers = kernels::powers(of, outside.drive_m_per_s, self.friction.radiation_pa_s_per_m);
        work_w.copy_from_slice(&powers.map(|power| self.medium.spacing_m * power));
    }

    fn tangential_force_n(&self, n: usize) -> f64 {
        self.friction_n(&self.field, n)
    }

    fn energy(&self, at: &Unknowns, _: &SliderState) -> Energy {
        let (w, _, [drive_work_j, friction_heat_j, radiated_j]) = at.line();
        let pulled_n =
            |n: usize| (self.field.stress[n] - self.medium.prestress_pa[n]) * self.medium.cell_m(n);
        Energy {
            drive_work_j: *drive_work_j,
            friction_heat_j: *friction_heat_j,
            radiated_j: Some(*radiated_j),
            elastic_j: w.iter().enumerate().map(|(n, w)| -0.5 * w * pulled_n(n)).sum(),
            ..Energy::default()
        }
    }

    fn friction_of(&self, at: &StepEnd<Line>, n: usize) -> [f64; 4] {
        let (medium, (_, phi, _), friction_n) =
            (&self.medium, at.at.line(), self.friction_n(&at.contacts, n));
        let law = RateAndState { critical_slip_m: medium.critical_slip_m[n], ..self.law };
        let theta_s = law.steady_theta_s(law.reference_velocity_m_per_s) * libm::exp(phi[n]);
        [
            friction_n,
            friction_n / (medium.normal_stress_pa[n] * medium.cell_m(n)),
            law.reference_coefficient + medium.evolution_effect[n] * phi[n],
            theta_s.min(f64::MAX),
        ]
    }
}
