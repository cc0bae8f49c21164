//! The chain before its first step.

use crate::Scenario;
use crate::plan::Springs;

/// Displacements from the grid, velocities and friction springs at step 0; all
/// blocks are stuck. One value per block.
#[derive(Debug, Clone, PartialEq)]
pub struct InitialState {
    /// `u_n`.
    pub displacement_m: Vec<f64>,
    /// `v_n`.
    pub velocity_m_per_s: Vec<f64>,
    /// `u_stick,n`.
    pub stick_position_m: Vec<f64>,
}

pub(crate) fn state(scenario: &Scenario, springs: &Springs, normal_load_n: &[f64]) -> InitialState {
    let blocks = normal_load_n.len();
    let k = springs.stiffness_n_per_m;
    let tau0 = shear_profile(scenario.initial_shear.beta, normal_load_n, springs.spacing_m);

    // Displacements whose spring forces are the profile, from u_1 = 0.
    let mut u = vec![0.0; blocks];
    u[1] = tau0[0] / k;
    for n in 2..blocks {
        u[n] = 2.0 * u[n - 1] - u[n - 2] + tau0[n - 1] / k;
    }

    // Each friction spring balances what its neighbours pull.
    let stick_position_m = (0..blocks)
        .map(|n| u[n] - k * neighbour_pull(&u, n) / springs.interfacial_stiffness_n_per_m)
        .collect();

    let amplitude = scenario.initial_velocity.amplitude_m_per_s;
    let mode = f64::from(scenario.initial_velocity.mode);
    let velocity_m_per_s = (0..blocks)
        .map(|n| {
            if amplitude == 0.0 {
                return 0.0;
            }
            let phase = std::f64::consts::PI * mode * (n as f64 + 0.5) / blocks as f64;
            amplitude * libm::cos(phase)
        })
        .collect();
    InitialState { displacement_m: u, velocity_m_per_s, stick_position_m }
}

/// `tau0_n = beta p_n (2 x_n / L - 1)` (5.50) at `x_n = (n - 1) a`.
pub fn shear_profile(beta: f64, normal_load_n: &[f64], spacing_m: f64) -> Vec<f64> {
    let length_m = spacing_m * (normal_load_n.len() - 1) as f64;
    normal_load_n
        .iter()
        .enumerate()
        .map(|(n, p)| beta * p * (2.0 * (n as f64 * spacing_m) / length_m - 1.0))
        .collect()
}

/// `u_{n+1} - 2 u_n + u_{n-1}` with free ends (5.6), n from 0.
pub fn neighbour_pull(u: &[f64], n: usize) -> f64 {
    let left = if n > 0 { u[n - 1] - u[n] } else { 0.0 };
    let right = if n + 1 < u.len() { u[n + 1] - u[n] } else { 0.0 };
    left + right
}

#[cfg(test)]
mod tests {
    use crate::{Plan, Scenario, ScenarioSource};

    #[test]
    fn springs_hold_the_profile_of_5_50() {
        let source = ScenarioSource::new("test", "initial_shear.beta = 0.45\nslider.blocks = 11");
        let plan = Plan::new(&Scenario::resolve(&source).unwrap());
        let p = 400.0 / 11.0;
        for n in 0..11 {
            let tau = plan.stiffness_n_per_m * super::neighbour_pull(&plan.initial.displacement_m, n);
            let expected = 0.45 * p * (2.0 * n as f64 / 10.0 - 1.0);
            assert!((tau - expected).abs() < 1e-9, "block {}: {tau} against {expected}", n + 1);
            let spring = plan.friction.interfacial_stiffness_n_per_m
                * (plan.initial.displacement_m[n] - plan.initial.stick_position_m[n]);
            assert!((spring - expected).abs() < 1e-6, "block {}: {spring} against {expected}", n + 1);
        }
        assert_eq!(plan.initial.displacement_m[0], 0.0);
    }
}
