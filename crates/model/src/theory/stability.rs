//! Linear stability of steady sliding by rate-and-state friction: Ruina (1983), Rice and Ruina (1983) with inertia and
//! damping.
//!
//! A mode of a block or a chain that slides steadily at `V` has the stiffness `kappa`, the damping `eta` and, per
//! block, the mass `m` and the load `p`. With `theta = D_c / V` both laws of the state linearise alike, to the cubic
//!
//! `m s^3 + (m V / D_c + a p / V + eta) s^2 + (kappa - k_0 + eta V / D_c) s + kappa V / D_c = 0`,
//!
//! where `k_0 = (b - a) p / D_c`. By Routh and Hurwitz two of its roots have a positive real part if and only if
//! `kappa < k_c`, and none otherwise, with
//!
//! `k_c = (k_0 - eta V / D_c) [1 + (m V / D_c) / (a p / V + eta)]`.
//!
//! In a uniform chain of `N` blocks with free ends and the same `K_n` on each, mode `j` from 0 to `N - 1` has
//! `kappa = K_n + 4 k sin^2(q a / 2)` and `eta = E + 4 eta_v sin^2(q a / 2)` with `q a = pi j / N`.

use serde::Serialize;

use crate::law::rate_and_state::RateAndState;
use crate::plan::Plan;

/// Fewest blocks in the nucleation length; below it blocks fail one by one, and numbers depend on their size.
pub const FEWEST_NUCLEATION_BLOCKS: f64 = 3.0;

/// The stability of steady sliding at the velocity of the drive, of a chain with the mean load, `b` and driving spring
/// of its blocks, and the length over which slip nucleates.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Stability {
    /// Number of modes: of blocks.
    pub modes: u32,
    /// Number of modes that grow; 0 if steady sliding is stable.
    pub unstable_modes: u32,
    /// The stiffness per block below which a block that slides alone is unstable, `k_c` without viscosity, N/m; below 0
    /// if it never is.
    pub critical_stiffness_n_per_m: f64,
    /// The nucleation length `sqrt(k D_c / (b p))` in blocks, the shortest of all blocks; `None` for a single block.
    pub nucleation_blocks: Option<f64>,
}

impl RateAndState {
    /// The coefficients of the cubic, from that of `s^3` on: of a mode of the stiffness `kappa`, the mass `m` (0 without
    /// inertia), the load `normal_load_n`, the evolution effect `b` and the damping `eta`.
    pub fn cubic(
        &self,
        velocity_m_per_s: f64,
        stiffness_n_per_m: f64,
        normal_load_n: f64,
        b: f64,
        mass_kg: f64,
        damping_kg_per_s: f64,
    ) -> [f64; 4] {
        let rate_per_s = velocity_m_per_s / self.critical_slip_m;
        let weakening_n_per_m = (b - self.direct_effect) * normal_load_n / self.critical_slip_m;
        [
            mass_kg,
            mass_kg * rate_per_s + self.direct_effect * normal_load_n / velocity_m_per_s + damping_kg_per_s,
            stiffness_n_per_m - weakening_n_per_m + damping_kg_per_s * rate_per_s,
            stiffness_n_per_m * rate_per_s,
        ]
    }

    /// `k_c`, N/m: steady sliding at a velocity is unstable where the stiffness is below, of a block of mass `m` (0
    /// without inertia) that bears `normal_load_n`, with the evolution effect `b` and the damping `eta`. Below 0 where
    /// no spring is unstable.
    pub fn critical_stiffness_n_per_m(
        &self,
        velocity_m_per_s: f64,
        normal_load_n: f64,
        b: f64,
        mass_kg: f64,
        damping_kg_per_s: f64,
    ) -> f64 {
        let [_, slowing_kg_per_s, linear_n_per_m, _] =
            self.cubic(velocity_m_per_s, 0.0, normal_load_n, b, 0.0, damping_kg_per_s);
        let rate_per_s = velocity_m_per_s / self.critical_slip_m;
        -linear_n_per_m * (1.0 + mass_kg * rate_per_s / slowing_kg_per_s)
    }
}

impl Stability {
    /// That of a plan; `None` by other laws, and in a medium.
    pub fn of(plan: &Plan) -> Option<Stability> {
        if plan.medium.is_some() {
            return None;
        }
        let law = plan.friction.law.rate_and_state()?;
        let effects = &plan.friction.evolution_effects;
        let count = plan.blocks as f64;
        let load_n = plan.normal_load_n.iter().sum::<f64>() / count;
        let b = effects.iter().sum::<f64>() / count;
        let drive_n_per_m =
            plan.drive.springs.iter().map(|spring| spring.stiffness_n_per_m).sum::<f64>() / count;
        let (k, eta) = (plan.elastic.stiffness_n_per_m, plan.elastic.damping_kg_per_s);
        let mass_kg = if law.inertia { plan.block_mass_kg } else { 0.0 };
        let velocity_m_per_s = plan.drive.velocity_m_per_s;
        let critical_n_per_m = |damping_kg_per_s: f64| {
            law.critical_stiffness_n_per_m(velocity_m_per_s, load_n, b, mass_kg, damping_kg_per_s)
        };
        let grows = |mode: &usize| {
            let half = libm::sin(0.5 * std::f64::consts::PI * *mode as f64 / count);
            let bent = 4.0 * half * half;
            drive_n_per_m + k * bent < critical_n_per_m(law.radiation_kg_per_s + eta * bent)
        };
        let weakest = |(b, p): (&f64, &f64)| b * p;
        let most_n = effects.iter().zip(&plan.normal_load_n).map(weakest).fold(0.0, f64::max);
        Some(Stability {
            modes: plan.blocks as u32,
            unstable_modes: (0..plan.blocks).filter(grows).count() as u32,
            critical_stiffness_n_per_m: critical_n_per_m(law.radiation_kg_per_s),
            nucleation_blocks: (plan.blocks > 1).then(|| (k * law.critical_slip_m / most_n).sqrt()),
        })
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::Stability;
    use crate::Plan;
    use crate::law::rate_and_state::RateAndState;
    use crate::resolve;

    fn plan(name: &str, sets: &[&str]) -> Plan {
        Plan::new(&resolve(name, sets).unwrap_or_else(|error| panic!("{error}")))
    }

    fn law(plan: &Plan) -> RateAndState {
        plan.friction.law.rate_and_state().expect("it is this law")
    }

    /// Found from the eigenvalues of the nonlinear equations, by another program.
    #[test]
    fn the_critical_stiffness_is_that_of_eigenvalues() {
        let path =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/reference/laws/rsf-stability.csv");
        let text = std::fs::read_to_string(path).unwrap();
        let mut count = 0;
        for line in text.lines().skip(1) {
            let numbers: Vec<f64> = line.split(',').skip(2).map(|cell| cell.parse().unwrap()).collect();
            let [a, b, dc_m, p_n, m_kg, eta, v, k_c, ..] = numbers[..] else { panic!("{line}") };
            let law =
                RateAndState { direct_effect: a, critical_slip_m: dc_m, ..law(&plan("spring-slider", &[])) };
            let found = law.critical_stiffness_n_per_m(v, p_n, b, m_kg, eta);
            assert!((found / k_c - 1.0).abs() < 2e-9, "{found}: {line}");
            count += 1;
        }
        assert_eq!(count, 10);
    }

    /// The number of eigenvalues with a positive real part, from the trace of the sign of the matrix (Roberts 1980):
    /// `X <- (c X + (c X)^-1) / 2`, scaled by `c = sqrt(|X^-1| / |X|)` while that matters.
    fn unstable(mut x: Vec<Vec<f64>>) -> usize {
        let size = |x: &[Vec<f64>]| x.iter().flatten().map(|cell| cell * cell).sum::<f64>().sqrt();
        let n = x.len();
        for _ in 0..200 {
            let inverse = inverse(x.clone());
            let ratio = (size(&inverse) / size(&x)).sqrt();
            let scale = if (ratio - 1.0).abs() < 0.01 { 1.0 } else { ratio };
            let mut change = 0.0_f64;
            for (row, inverse) in x.iter_mut().zip(&inverse) {
                for (cell, inverse) in row.iter_mut().zip(inverse) {
                    let next = 0.5 * (scale * *cell + inverse / scale);
                    change = change.max((next - *cell).abs());
                    *cell = next;
                }
            }
            if change < 1e-9 * size(&x) {
                let trace: f64 = (0..n).map(|i| x[i][i]).sum();
                assert!((trace - trace.round()).abs() < 1e-3, "a sign has whole numbers: {trace}");
                return ((n as f64 + trace.round()) / 2.0) as usize;
            }
        }
        panic!("no convergence");
    }

    /// By Gauss and Jordan, with the largest pivot of each column.
    fn inverse(mut x: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        let n = x.len();
        let mut y: Vec<Vec<f64>> =
            (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect();
        for i in 0..n {
            let pivot = (i..n).max_by(|a, b| x[*a][i].abs().total_cmp(&x[*b][i].abs())).unwrap();
            x.swap(i, pivot);
            y.swap(i, pivot);
            let by = 1.0 / x[i][i];
            [&mut x[i], &mut y[i]].into_iter().flatten().for_each(|cell| *cell *= by);
            let (row_x, row_y) = (x[i].clone(), y[i].clone());
            for j in (0..n).filter(|j| *j != i) {
                let by = x[j][i];
                for c in 0..n {
                    x[j][c] -= by * row_x[c];
                    y[j][c] -= by * row_y[c];
                }
            }
        }
        y
    }

    /// The Jacobian, by differences, of the equations of motion around steady sliding. Units: `D_c`, `D_c / V`, `a`.
    fn jacobian(plan: &Plan) -> Vec<Vec<f64>> {
        let (law, n) = (law(plan), plan.blocks);
        let (dc_m, v_m_per_s) = (law.critical_slip_m, plan.drive.velocity_m_per_s);
        let (b, springs) = (&plan.friction.evolution_effects, &plan.drive.springs);
        let rates =
            |y: &[f64]| -> Vec<f64> {
                let u: Vec<f64> = y[..n].iter().map(|u| u * dc_m).collect();
                let v: Vec<f64> = y[n..2 * n].iter().map(|v| v * v_m_per_s).collect();
                let mut out = y[n..2 * n].to_vec();
                let mut pull: Vec<f64> = (0..n).map(|i| plan.elastic.pull_n(&u, &v, i)).collect();
                springs
                    .iter()
                    .for_each(|spring| pull[spring.block] -= spring.stiffness_n_per_m * u[spring.block]);
                let state = |i: usize| y[2 * n + i] * law.direct_effect + law.steady_state(b[i], v_m_per_s);
                for i in 0..n {
                    let friction_n = plan.normal_load_n[i] * law.coefficient(v[i], state(i));
                    let force_n = pull[i] - friction_n - law.radiation_kg_per_s * v[i];
                    out.push(force_n / plan.block_mass_kg * dc_m / (v_m_per_s * v_m_per_s));
                }
                out.extend((0..n).map(|i| {
                    law.state_rate_per_s(b[i], v[i], state(i)) * dc_m / v_m_per_s / law.direct_effect
                }));
                out
            };
        const STEP: f64 = 1e-5;
        let at = [vec![0.0; n], vec![1.0; n], vec![0.0; n]].concat();
        let columns: Vec<Vec<f64>> = (0..3 * n)
            .map(|j| {
                let moved = |by: f64| {
                    let mut y = at.clone();
                    y[j] += by;
                    rates(&y)
                };
                moved(STEP).iter().zip(moved(-STEP)).map(|(a, b)| (a - b) / (2.0 * STEP)).collect()
            })
            .collect();
        (0..3 * n).map(|i| columns.iter().map(|column| column[i]).collect()).collect()
    }

    #[test]
    fn as_many_modes_grow_as_pairs_of_eigenvalues_do() {
        let mut counts = [0; 9];
        let mut cases = 0;
        for evolution in ["ageing", "slip", "prz"] {
            for mass_kg in [0.012, 12.0, 1000.0] {
                for modulus_pa in [2e6, 1e7, 1e8] {
                    for drive_n_per_m in [0.3e6, 1.2e6, 1.9e6, 4.4e6] {
                        for [damping, radiation] in [[0.0, 0.0], [0.1, 0.0], [0.01, 300.0]] {
                            let plan = plan(
                                "default",
                                &[
                                    "friction.law=rate-and-state",
                                    "slider.blocks=8",
                                    "drive.kind=top",
                                    &format!("friction.evolution={evolution}"),
                                    &format!("slider.mass_kg={mass_kg}"),
                                    &format!("slider.youngs_modulus_pa={modulus_pa}"),
                                    &format!("drive.stiffness_n_per_m={drive_n_per_m}"),
                                    &format!("slider.relative_damping={damping}"),
                                    &format!("friction.radiation_kg_per_s={radiation}"),
                                ],
                            );
                            let found = Stability::of(&plan).expect("it is this law");
                            let pairs = unstable(jacobian(&plan));
                            assert_eq!(
                                2 * found.unstable_modes as usize,
                                pairs,
                                "{evolution} {mass_kg} {modulus_pa} {drive_n_per_m} {damping} {radiation}"
                            );
                            counts[found.unstable_modes as usize] += 1;
                            cases += 1;
                        }
                    }
                }
            }
        }
        assert_eq!(cases, 324);
        assert!(counts.iter().filter(|count| **count > 0).count() >= 7, "{counts:?}");
    }

    #[test]
    fn a_nucleation_length_is_the_shortest_of_all_blocks() {
        // sqrt(k D_c / (b p)) = sqrt(2e7 2e-6 / (b 25)), with the largest b.
        let chain = Stability::of(&plan("rate-and-state", &[])).expect("it is this law");
        let expected = (40.0_f64 / (25.0 * (0.02 + 0.001_981_214_711_389_740_8))).sqrt();
        let found = chain.nucleation_blocks.expect("there are several blocks");
        assert!((found / expected - 1.0).abs() < 1e-9, "{found}");
        assert_eq!((chain.modes, chain.unstable_modes), (16, 1));
        let slider = Stability::of(&plan("spring-slider", &[])).expect("it is this law");
        assert_eq!((slider.modes, slider.unstable_modes, slider.nucleation_blocks), (1, 1, None));
        // k_0 = (b - a) p / D_c = 2.5e9, less eta V / D_c.
        let expected = 2.5e9 - 2e9 / 6000.0;
        assert!((slider.critical_stiffness_n_per_m / expected - 1.0).abs() < 1e-12, "{slider:?}");
        assert_eq!(Stability::of(&plan("default", &[])), None);
        // Steady friction that rises with velocity is stable at any stiffness.
        let creeps = Stability::of(&plan("spring-slider", &["friction.evolution_effect=0.009"])).unwrap();
        assert!(creeps.unstable_modes == 0 && creeps.critical_stiffness_n_per_m < 0.0, "{creeps:?}");
    }
}
