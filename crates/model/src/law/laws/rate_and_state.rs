//! Rate-and-state friction (Dieterich 1979, Ruina 1983): strength depends on the velocity and on a state,
//! and changes over a slip of the length `D_c`.
//!
//! In the form of the SEAS benchmarks (Erickson et al. 2020), a contact that bears `p` feels
//!
//! `F(V, psi) = p a asinh[(V / 2 V_0) exp(psi / a)]`, with `psi = f_0 + b ln(V_0 theta / D_c)`,
//!
//! which is odd in `V` and has the limits `p (f_0 + a ln(V / V_0) + b ln(V_0 theta / D_c))` at velocities far
//! above `V_0 exp(-psi / a)`, and 0 at rest. The state evolves by
//!
//! - ageing: `psi' = (b V_0 / D_c) [exp((f_0 - psi) / b) - |V| / V_0]`, that is `theta' = 1 - |V| theta / D_c`;
//! - slip: `psi' = -(|V| / D_c) [psi - f_0 + b ln(|V| / V_0)]`, 0 at rest;
//! - prz (Perrin, Rice and Zheng, J. Mech. Phys. Solids 43, 1461, 1995), with `2 D_c` in place of `D_c` in `psi`:
//!   `psi' = (b V_0 / 2 D_c) [exp((f_0 - psi) / b) - (V / V_0)^2 exp((psi - f_0) / b)]`, that is
//!   `theta' = 1 - (V theta / 2 D_c)^2`.
//!
//! Sliding backwards wears contacts as well, hence `|V|`. In steady sliding `theta` is `D_c / |V|`, by prz twice that, and
//! the coefficient is `f_0 + (a - b) ln(V / V_0)`. The load enters `F` at its present value; the state does not depend on it.

use crate::law::{ContactLaw, Sliding, Turn};
use crate::scenario::Scenario;
use crate::scenario::choices::words;

/// Most `psi / a`. From 708 on `e^(-psi / a)` has no longer all digits, and from 745 on it is 0: a block that turns back
/// would do so at once.
pub const MOST_STATE: f64 = 700.0;

words! {
    /// How the state of rate-and-state friction evolves.
    Evolution {
        /// Contacts at rest strengthen: `theta' = 1 - |V| theta / D_c` (Dieterich).
        Ageing = "ageing",
        /// The state changes by slip alone: `theta' = -(|V| theta / D_c) ln(|V| theta / D_c)` (Ruina).
        Slip = "slip",
        /// Contacts at rest strengthen, and wear by the square of slip: `theta' = 1 - (V theta / 2 D_c)^2` (Perrin, Rice
        /// and Zheng).
        Prz = "prz",
    }
}

/// The numbers of the law that all contacts share; `b` may differ from contact to contact
/// ([`crate::Friction::evolution_effects`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateAndState {
    /// `a`: by how much friction, over the load, rises with the logarithm of the velocity.
    pub direct_effect: f64,
    /// `b` without offsets: by how much it falls with that of the velocity of the past.
    pub evolution_effect: f64,
    /// `D_c`: the slip over which the state changes, m.
    pub critical_slip_m: f64,
    /// `V_0`, at which steady friction over the load is `f_0`, m/s.
    pub reference_velocity_m_per_s: f64,
    /// `f_0`.
    pub reference_coefficient: f64,
    /// How the state evolves.
    pub evolution: Evolution,
    /// Whether blocks have inertia. Without it, forces balance at every time (quasi-dynamic), and
    /// `radiation_kg_per_s` is above 0.
    pub inertia: bool,
    /// `E`, of the force `-E v` on each block, kg/s.
    pub radiation_kg_per_s: f64,
    /// `x`: a loaded start begins at the velocity `V_l e^x`, with `V_l` that of the drive at the start.
    pub initial_kick: f64,
    /// `V_th`: a block slides from where its speed rises above this to where it falls below half of it, m/s.
    pub event_speed_m_per_s: f64,
    /// Relative error that the solver accepts in a step.
    pub tolerance: f64,
}

/// Threshold of event speeds without a key, over the velocity of the drive: the largest one at most, and that at the
/// start at least.
pub const EVENT_SPEED_RATIO: f64 = 10.0;

/// That threshold between the two, over the speed `a p / (E + sqrt(m kappa))` at which inertia or radiation bears a change
/// of friction by `a p`.
pub(crate) const EVENT_SPEED_SHARE: f64 = 0.1;

/// That threshold on a fault line in a medium, as in the SEAS benchmarks.
pub(crate) const EVENT_SPEED_IN_MEDIUM_M_PER_S: f64 = 1e-3;

/// From this `l` on, `asinh(e^l)` is `l + ln 2` to `e^(-2 l) / 4 < 2e-18`, less than rounding.
const LARGE: f64 = 20.0;

/// `asinh(e^l)`, for any `l`.
pub fn asinh_of_exp(l: f64) -> f64 {
    if l > LARGE { l + std::f64::consts::LN_2 } else { libm::asinh(libm::exp(l)) }
}

impl RateAndState {
    /// The state `psi` in steady sliding at a velocity, with the evolution effect `b`: `f_0 - b ln(|V| / V_0)`.
    pub fn steady_state(&self, b: f64, velocity_m_per_s: f64) -> f64 {
        self.reference_coefficient - b * libm::log(velocity_m_per_s.abs() / self.reference_velocity_m_per_s)
    }

    /// `theta` in steady sliding at a velocity, s.
    pub fn steady_theta_s(&self, velocity_m_per_s: f64) -> f64 {
        let slips = if self.evolution == Evolution::Prz { 2.0 } else { 1.0 };
        slips * self.critical_slip_m / velocity_m_per_s.abs()
    }

    /// The state `psi` of a `theta`, with the evolution effect `b`.
    pub fn state_of_theta(&self, b: f64, theta_s: f64) -> f64 {
        let steady_s = self.steady_theta_s(self.reference_velocity_m_per_s);
        self.reference_coefficient + b * libm::log(theta_s / steady_s)
    }

    /// The `theta` of a state, s.
    pub fn theta_s(&self, b: f64, state: f64) -> f64 {
        let steady_s = self.steady_theta_s(self.reference_velocity_m_per_s);
        steady_s * libm::exp((state - self.reference_coefficient) / b)
    }

    /// Friction over the normal load, of the sign of the velocity: `a asinh[(V / 2 V_0) exp(psi / a)]`.
    /// `exp(psi / a)` is of the order of `e^60` and is never formed.
    pub fn coefficient(&self, velocity_m_per_s: f64, state: f64) -> f64 {
        let a = self.direct_effect;
        let l = libm::log(velocity_m_per_s.abs() / (2.0 * self.reference_velocity_m_per_s)) + state / a;
        (a * asinh_of_exp(l)).copysign(velocity_m_per_s)
    }

    /// `psi'`, 1/s, with the evolution effect `b`, and its derivatives by the speed, 1/m, and by the state, 1/s.
    /// `ln_speed` is `ln(|V| / V_0)`, which only the slip law asks for.
    pub fn evolution(
        &self,
        b: f64,
        speed_m_per_s: f64,
        ln_speed: impl FnOnce() -> f64,
        state: f64,
    ) -> [f64; 3] {
        let (slip_m, above) = (self.critical_slip_m, state - self.reference_coefficient);
        match self.evolution {
            Evolution::Ageing => {
                let healing_m_per_s = self.reference_velocity_m_per_s * libm::exp(-above / b);
                [b * (healing_m_per_s - speed_m_per_s) / slip_m, -b / slip_m, -healing_m_per_s / slip_m]
            }
            Evolution::Slip if speed_m_per_s > 0.0 => {
                let beyond = above + b * ln_speed();
                [-speed_m_per_s * beyond / slip_m, -(beyond + b) / slip_m, -speed_m_per_s / slip_m]
            }
            Evolution::Slip => [0.0; 3],
            Evolution::Prz => {
                let healing_m_per_s = self.reference_velocity_m_per_s * libm::exp(-above / b);
                let speeds = speed_m_per_s / healing_m_per_s;
                let wear_m_per_s = speeds * speed_m_per_s;
                [
                    0.5 * b * (healing_m_per_s - wear_m_per_s) / slip_m,
                    -b * speeds / slip_m,
                    -0.5 * (healing_m_per_s + wear_m_per_s) / slip_m,
                ]
            }
        }
    }

    /// `psi'` at a velocity, 1/s.
    #[cfg(test)]
    pub(crate) fn state_rate_per_s(&self, b: f64, velocity_m_per_s: f64, state: f64) -> f64 {
        let speed_m_per_s = velocity_m_per_s.abs();
        let ln_speed = || libm::log(speed_m_per_s / self.reference_velocity_m_per_s);
        self.evolution(b, speed_m_per_s, ln_speed, state)[0]
    }
}

/// No contact of this law ever sticks, and no solver that takes steps of equal length can run it: friction over
/// velocity is as large as `1e15 / s` times the mass. The adaptive solver computes it, without these functions, so
/// here a contact is free.
impl ContactLaw for RateAndState {
    const STICKS: bool = false;
    const KEYS: &'static [&'static str] = &[
        "friction.direct_effect",
        "friction.evolution_effect",
        "friction.evolution_offsets",
        "friction.critical_slip_m",
        "friction.reference_velocity_m_per_s",
        "friction.reference_coefficient",
        "friction.evolution",
        "friction.inertia",
        "friction.radiation_kg_per_s",
        "friction.initial_kick",
        "friction.initial_velocity_m_per_s",
        "friction.initial_velocities_m_per_s",
        "friction.initial_theta_s",
        "friction.initial_thetas_s",
        "friction.initial_csv",
        "prestress.swing_ratio",
        "prestress.swing_period_s",
        "prestress.swing_from_s",
        "friction.event_speed_m_per_s",
        "time.tolerance",
    ];

    fn of(scenario: &Scenario) -> RateAndState {
        let friction = &scenario.friction;
        RateAndState {
            direct_effect: friction.direct_effect,
            evolution_effect: friction.evolution_effect,
            critical_slip_m: friction.critical_slip_m,
            reference_velocity_m_per_s: friction.reference_velocity_m_per_s,
            reference_coefficient: friction.reference_coefficient,
            evolution: friction.evolution,
            inertia: friction.inertia,
            radiation_kg_per_s: friction.radiation_kg_per_s,
            initial_kick: friction.initial_kick,
            event_speed_m_per_s: match friction.event_speed_m_per_s {
                0.0 => scenario.default_event_speed_m_per_s(),
                given_m_per_s => given_m_per_s,
            },
            tolerance: scenario.time.tolerance,
        }
    }

    #[inline(always)]
    fn drag_n(&self, _: &Sliding<'_>) -> [f64; 1] {
        [0.0]
    }

    #[inline(always)]
    fn re_attaches(&self, _: &Turn) -> bool {
        false
    }

    fn radiation_kg_per_s(&self) -> f64 {
        self.radiation_kg_per_s
    }
}

#[cfg(test)]
mod tests {
    use super::{Evolution, RateAndState};
    use crate::resolve;

    fn law(sets: &[&str]) -> RateAndState {
        let all = [&["friction.law=rate-and-state"], sets].concat();
        let scenario = resolve("default", &all).unwrap_or_else(|error| panic!("{error}"));
        scenario.contact_law().rate_and_state().expect("it is this law")
    }

    /// Velocities and states `theta` over the steady one at that velocity.
    const CASES: [(f64, f64); 7] =
        [(1e-12, 1.0), (1e-9, 40.0), (1e-6, 1.0), (1e-4, 0.01), (0.3, 1.0), (0.3, 1e-5), (-1e-4, 3.0)];

    #[test]
    fn friction_is_the_logarithm_of_older_laws_where_they_are_known() {
        let law = law(&[]);
        let (a, b, dc_m, v0) = (0.01, 0.015, 1e-6, 1e-6);
        for (velocity, ratio) in CASES {
            let theta_s = ratio * dc_m / f64::abs(velocity);
            let state = 0.6 + b * (v0 * theta_s / dc_m).ln();
            let older = 0.6 + a * (velocity.abs() / v0).ln() + b * (v0 * theta_s / dc_m).ln();
            let found = law.coefficient(velocity, state);
            assert!((found.abs() / older - 1.0).abs() < 1e-14, "{velocity}: {found} {older}");
            assert!(found.signum() == velocity.signum());
        }
        assert_eq!([law.coefficient(0.0, 0.6), law.coefficient(0.0, -0.6)], [0.0; 2]);
        // Near rest it is odd and linear: a (V / 2 V_0) e^(psi / a).
        let slow = law.coefficient(-1e-40, 0.6) / (-0.01 * 0.5e-34 * 60.0_f64.exp());
        assert!((slow - 1.0).abs() < 1e-13, "{slow}");
        // Where the two forms of asinh meet.
        let at = |l: f64| law.coefficient(2e-6 * (l - 30.0).exp(), 0.3);
        let rise = (at(20.0 + 1e-9) - at(20.0 - 1e-9)) / 0.01;
        assert!(
            (rise - 2e-9).abs() < 1e-13 && (at(20.0) / 0.01 - 20.0 - 2.0_f64.ln()).abs() < 1e-13,
            "{rise}"
        );
    }

    #[test]
    fn the_state_changes_as_theta_does() {
        for (law, of_theta) in [
            (law(&[]), (|x| 1.0 - x) as fn(f64) -> f64),
            (law(&["friction.evolution=slip"]), |x: f64| -x * x.ln()),
            // Of half of theta.
            (law(&["friction.evolution=prz"]), |x| 0.5 * (1.0 - x * x)),
        ] {
            for (velocity, ratio) in CASES {
                for b in [0.005, 0.015] {
                    let theta_s = ratio * 1e-6 / f64::abs(velocity);
                    let state = 0.6 + b * theta_s.ln();
                    let rate = law.state_rate_per_s(b, velocity, state);
                    let (expected, scale) = (b * of_theta(ratio) / theta_s, b / theta_s);
                    assert!(
                        (rate - expected).abs() < 1e-12 * scale.max(expected.abs()),
                        "{velocity}: {rate} {expected}"
                    );
                    let steady = law.steady_state(b, velocity);
                    assert!(
                        law.state_rate_per_s(b, velocity, steady).abs() < 1e-12 * b * velocity.abs() / 1e-6
                    );
                }
            }
        }
        // At rest contacts strengthen by the one law alone.
        assert_eq!(law(&["friction.evolution=slip"]).state_rate_per_s(0.015, 0.0, 0.7), 0.0);
        let (ageing, theta_s) = (law(&[]), 25.0_f64);
        let rate = ageing.state_rate_per_s(0.015, 0.0, 0.6 + 0.015 * theta_s.ln());
        assert!((rate * theta_s / 0.015 - 1.0).abs() < 1e-12, "{rate}");
        assert_eq!(ageing.evolution, Evolution::Ageing);
    }

    #[test]
    fn a_key_of_0_is_an_event_speed_of_ten_times_the_drive_unless_a_part_of_it_is_far_faster() {
        let m_per_s = |sets: &[&str]| law(sets).event_speed_m_per_s;
        assert!((m_per_s(&["drive.velocity_m_per_s=2e-5"]) / 2e-4 - 1.0).abs() < 1e-15);
        let course = |fastest: &str| {
            let course = format!("drive.course_m_per_s=[1e-6,1e-6,{fastest}]");
            let slow = ["drive.velocity_m_per_s=1e-6", "drive.course_s=[1,2,2]", &*course];
            [4, 1].map(|blocks| m_per_s(&[&slow[..], &[&*format!("slider.blocks={blocks}")]].concat()))
        };
        assert_eq!(course("-1e-5"), [10.0 * 1e-5; 2]);
        // a p / sqrt(m (K / N + 2 k)), of a single block a p / sqrt(m K).
        let plan = crate::Plan::new(&resolve("default", &["slider.blocks=4"]).unwrap());
        let (k, drive_n_per_m) = (plan.elastic.stiffness_n_per_m, plan.drive.springs[0].stiffness_n_per_m);
        let load_n = plan.total_normal_load_n;
        let four = 0.01 * load_n / 4.0 / (plan.block_mass_kg * (0.25 * drive_n_per_m + 2.0 * k)).sqrt();
        let one = 0.01 * load_n / (4.0 * plan.block_mass_kg * drive_n_per_m).sqrt();
        for (found, dynamic) in course("10").into_iter().zip([four, one]) {
            assert!((found / (0.1 * dynamic) - 1.0).abs() < 1e-12, "{found} {dynamic}");
        }
        // A free start counts as the drive does, and where that rests it decides alone; a constant drive keeps its own.
        let free = "friction.initial_velocity_m_per_s=1e-5";
        assert!((m_per_s(&["drive.velocity_m_per_s=2e-5", free]) / 2e-4 - 1.0).abs() < 1e-15);
        let v0 = |speed: &str| m_per_s(&["drive.velocity_m_per_s=0", &*speed.replace('V', "friction.initial_velocity_m_per_s")]);
        let dynamic = v0("V=1e-9");
        assert!(dynamic > 1e-5 && v0("V=2e-9") == dynamic);
        assert!((v0("V=10") / 100.0 - 1.0).abs() < 1e-15);
        assert_eq!(m_per_s(&["friction.event_speed_m_per_s=0.01"]), 0.01);
        assert_eq!(law(&["time.tolerance=1e-9"]).tolerance, 1e-9);
    }
}
