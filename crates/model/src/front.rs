//! The speed of a front in a uniformly prestressed chain with rigid contacts: theory.
//!
//! Units of this file: length `a` and time `sqrt(m / k)`, so speeds are relative to
//! `c = a sqrt(k / m)`, the chain's wave speed; forces `(mu_s - mu_d) p`, measured from `mu_d p`,
//! so that a block detaches at 1 and slides without friction; displacements `(mu_s - mu_d) p / k`.
//! Three parameters remain: `tau`, the prestress; `beta`, the damping `eta / sqrt(k m)`; and
//! `gamma = K_n / k`, the stiffness of a stopped top drive.
//!
//! # Speed
//!
//! A steady front reaches each block a time `1 / v` after the previous one, and all blocks move
//! alike: `u(s)`, with the time `s` since detachment, obeys, with
//! `D u = u(s + 1/v) + u(s - 1/v) - 2 u(s)`,
//!
//! ```text
//! u'' = -gamma u + tau + D u + beta D u'  for s > 0,   u = 0 for s < 0,
//! tau + u(1/v) + beta u'(1/v) = 1:  the block ahead is pulled just hard enough.
//! ```
//!
//! The Laplace transform is `L(p) U(p) = tau / p - G(p)`, where
//! `L(p) = p^2 + gamma + (1 + beta p) (2 - 2 cosh(p / v))` and `G` belongs to the force on blocks
//! that are still stuck. Wiener and Hopf's method splits `L = (p^2 + 2 delta p + Omega^2) M_+ M_-`
//! into factors without zeros or poles to the right and left of the imaginary axis, respectively,
//! that tend to 1 at infinity. Both sides of the equation, divided by `M_-`, are then one entire
//! function that vanishes at infinity, which leaves `tau = M_-(0)` at `s = 0`. With the phase `phi`
//! of `M = M_+ M_-` on the imaginary axis,
//!
//! ```text
//! tau = sqrt(M(0)) exp(1/pi int_0^inf phi(omega) / omega d omega).
//! ```
//!
//! Without damping the phase is zero. Then `tau = sqrt(1 - 1/v^2)` for a free slider, which is
//! `v = 1 / sqrt(1 - tau^2)`, the result of Amundsen et al., Phys. Rev. E 92, 032406 (2015); and
//! `tau = sqrt(gamma) / omega` under a stopped top drive, where `omega = v kappa` is the wave with
//! the phase speed of the front, `omega^2 = gamma + 4 sin^2(kappa / 2)`. With `beta = 1` on a free
//! slider the integral is elementary as well: `v = 1 / (1 - tau)`.
//!
//! Under a stopped top drive blocks re-attach behind the front. The theory neglects that: it cannot
//! affect a front faster than every wave, and otherwise hardly matters only while a pulse is longer
//! than a few blocks.
//!
//! # Slip and arrest
//!
//! Behind a steady pulse all blocks have slipped by the same `U` and are at rest, so the springs
//! between them are unstrained. Without damping no energy is lost: the work of the prestress,
//! `tau U`, is stored in the driving spring, `gamma U^2 / 2`, and `U = 2 tau / gamma`. The last
//! block to slip pulls the next one with `tau + U`; if that is below 1 the pulse stops: no pulse
//! propagates below `tau = gamma / (2 + gamma)`.

use std::f64::consts::PI;

use crate::plan::Plan;

/// The parameters of a front's speed; all dimensionless, defined above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Front {
    /// `tau`: prestress minus sliding friction, over static minus sliding friction.
    pub prestress: f64,
    /// `beta = eta / sqrt(k m)`.
    pub relative_damping: f64,
    /// `gamma = K_n / k` of a stopped top drive; 0 without drive.
    pub top_stiffness: f64,
}

/// `tau` of a block, counted from 0: its prestress minus sliding friction, over static minus
/// sliding friction; None where both frictions are equal.
pub fn relative_prestress(plan: &Plan, block: usize) -> Option<f64> {
    let friction = &plan.friction;
    let dynamic_n = friction.dynamic_friction_n[block];
    let weakening_n = friction.static_threshold_n[block] - dynamic_n;
    let prestress_n = plan.prestress_n.get(block).copied().unwrap_or(0.0);
    (weakening_n > 0.0).then(|| (prestress_n - dynamic_n) / weakening_n)
}

impl Front {
    /// The front of a plan, with the prestress of one block, counted from 0. None where the theory
    /// does not apply: for slabs, contacts that are not rigid or weaken with velocity, and a drive
    /// that moves or does not act on all blocks alike.
    pub fn of(plan: &Plan, block: usize) -> Option<Front> {
        if !plan.elastic.has_theory() {
            return None;
        }
        let k = plan.elastic.stiffness_n_per_m();
        let held = plan.drive.stiffness_n_per_m(plan.blocks);
        let even = held.iter().all(|stiffness| (stiffness - held[0]).abs() <= 1e-12 * held[0]);
        let plain_friction = plan.friction.law.holds() && plan.friction.law.affine().is_some();
        if !plain_friction || !even || plan.drive.velocity_m_per_s != 0.0 {
            return None;
        }
        Some(Front {
            prestress: relative_prestress(plan, block)?,
            relative_damping: plan.elastic.damping_kg_per_s() / (k * plan.block_mass_kg).sqrt(),
            top_stiffness: held[0] / k,
        })
    }

    /// The speed of a steady front over the chain's wave speed. None if the prestress is not
    /// between 0 and 1, or, under a stopped top drive, drives no front faster than [`slowest`].
    pub fn speed_over_c(&self) -> Option<f64> {
        let prestress_at = |speed: f64| prestress_at(speed, self.relative_damping, self.top_stiffness);
        let (mut low, mut high) = (slowest(self.top_stiffness), 1e3);
        if !(prestress_at(low)..prestress_at(high)).contains(&self.prestress) {
            return None;
        }
        // The prestress rises with speed. Bisected to the precision of the integral.
        while high / low > 1.0 + 1e-9 {
            let middle = (low * high).sqrt();
            if prestress_at(middle) < self.prestress {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some((low * high).sqrt())
    }

    /// The slip behind a steady pulse without damping, in `(mu_s - mu_d) p / k`; None without a
    /// stopped top drive.
    pub fn pulse_slip(&self) -> Option<f64> {
        (self.top_stiffness > 0.0).then(|| 2.0 * self.prestress / self.top_stiffness)
    }

    /// The prestress below which no pulse propagates, without damping; 0 without a stopped top
    /// drive.
    pub fn arrest_prestress(&self) -> f64 {
        self.top_stiffness / (2.0 + self.top_stiffness)
    }
}

/// Prestress and speed over `c` of fronts with this damping and stopped top drive, up to the speed
/// `fastest`, both ascending. The curve begins at [`slowest`] or, where damping makes slower fronts
/// need more prestress, at the minimum of the prestress.
pub fn curve(relative_damping: f64, top_stiffness: f64, fastest: f64) -> Vec<(f64, f64)> {
    const POINTS: u32 = 120;
    let slowest = slowest(top_stiffness);
    let mut points: Vec<(f64, f64)> = (0..=POINTS)
        .map(|n| {
            // Denser where the prestress changes fastest with speed.
            let share = f64::from(n) / f64::from(POINTS);
            let speed = slowest + (fastest - slowest) * share * share;
            (prestress_at(speed, relative_damping, top_stiffness), speed)
        })
        .collect();
    let rising = points.windows(2).rposition(|pair| pair[1].0 <= pair[0].0).map_or(0, |last| last + 1);
    points.drain(..rising);
    points
}

/// The slowest front that the theory describes, over `c`: at the wave speed in a free slider; under a
/// stopped top drive, the front whose wave alternates from block to block.
pub fn slowest(top_stiffness: f64) -> f64 {
    // Slightly more, since zero prestress belongs to the wave speed.
    if top_stiffness == 0.0 { 1.0 + 1e-9 } else { (top_stiffness + 4.0).sqrt() / PI }
}

/// The prestress that drives a front at this speed over `c`, at least [`slowest`].
pub fn prestress_at(speed: f64, relative_damping: f64, top_stiffness: f64) -> f64 {
    let (beta, gamma) = (relative_damping, top_stiffness);
    let curvature = |omega: f64| {
        let sine = libm::sin(omega / (2.0 * speed));
        4.0 * sine * sine
    };
    if gamma == 0.0 {
        let undamped = (1.0 - 1.0 / (speed * speed)).sqrt();
        if beta == 0.0 {
            return undamped;
        }
        let phase = |omega: f64| {
            let share = curvature(omega) / (omega * omega);
            libm::atan2(-beta * omega * share, 1.0 - share)
        };
        return undamped * libm::exp(over_frequencies(&phase, speed, -2.0 * beta) / PI);
    }
    let omega = undamped_wave(gamma, &curvature);
    if beta == 0.0 {
        return gamma.sqrt() / omega;
    }
    // The pair of zeros that damping moves off the axis is integrated analytically, to first order;
    // only the rest of the phase is integrated numerically.
    let slope = 2.0 * omega - 2.0 / speed * libm::sin(omega / speed);
    let two_delta = 2.0 * beta * omega * curvature(omega) / slope;
    let phase = |at: f64| {
        let curved = curvature(at);
        libm::atan2(beta * at * curved, gamma + curved - at * at)
            - libm::atan2(two_delta * at, omega * omega - at * at)
    };
    let rest = over_frequencies(&phase, speed, two_delta - 2.0 * beta);
    gamma.sqrt() / omega * libm::exp(rest / PI)
}

/// The frequency of the wave `omega = v kappa` with `omega^2 = gamma + 4 sin^2(kappa / 2)`.
fn undamped_wave(gamma: f64, curvature: &dyn Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (gamma.sqrt(), (gamma + 4.0).sqrt());
    for _ in 0..100 {
        let middle = (low + high) / 2.0;
        if middle * middle < gamma + curvature(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    (low + high) / 2.0
}

/// `int_0^inf phase(omega) / omega d omega` of a phase that vanishes at both ends: at infinity as
/// `tail / omega`, times `sin^2(omega / 2v)` averaged over its period.
fn over_frequencies(phase: &dyn Fn(f64) -> f64, speed: f64, tail: f64) -> f64 {
    /// Start of the logarithmic grid; below, the phase is proportional to frequency.
    const FROM: f64 = 1e-9;
    /// The logarithmic grid covers one period, the others have the given number of pieces each;
    /// finer grids leave the sixth digit unchanged.
    const LOGARITHMIC: u32 = 3000;
    const PERIODS: u32 = 60;
    const PIECES: u32 = 48;
    let period = 2.0 * PI * speed;
    let step = libm::log(period / FROM) / f64::from(LOGARITHMIC);
    let slow = simpson(LOGARITHMIC, step, |n| phase(FROM * libm::exp(step * n)));
    let piece = period / f64::from(PIECES);
    let fast = simpson(PERIODS * PIECES, piece, |n| {
        let omega = period + piece * n;
        phase(omega) / omega
    });
    let end = period * f64::from(1 + PERIODS);
    phase(FROM) + slow + fast + tail / end
}

/// Simpson's rule over an even number of steps.
fn simpson(count: u32, step: f64, of: impl Fn(f64) -> f64) -> f64 {
    let weight = |n: u32| match n {
        0 => 1.0,
        n if n == count => 1.0,
        n if n % 2 == 1 => 4.0,
        _ => 2.0,
    };
    (0..=count).map(|n| weight(n) * of(f64::from(n))).sum::<f64>() * step / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(sets: &[&str]) -> Plan {
        Plan::new(&crate::resolve("default", sets).unwrap())
    }

    fn front(prestress: f64, relative_damping: f64, top_stiffness: f64) -> Front {
        Front { prestress, relative_damping, top_stiffness }
    }

    #[test]
    fn without_damping_it_is_the_closed_form() {
        for tau in [0.1f64, 0.3, 0.6, 0.9, 0.99] {
            let speed = front(tau, 0.0, 0.0).speed_over_c().unwrap();
            assert!((speed * (1.0 - tau * tau).sqrt() - 1.0).abs() < 1e-8, "{tau}: {speed}");
        }
    }

    #[test]
    fn critical_damping_has_a_closed_form_too() {
        for tau in [0.05, 0.2, 0.5, 0.8] {
            let speed = front(tau, 1.0, 0.0).speed_over_c().unwrap();
            assert!((speed * (1.0 - tau) - 1.0).abs() < 2e-6, "{tau}: {speed}");
        }
    }

    /// The whole phase in the integral, on a grid fine enough for the step in it.
    #[test]
    fn the_zeros_near_the_axis_are_taken_out_of_the_integral_as_they_should() {
        let (gamma, beta) = (0.65, 0.2);
        for speed in [0.9, 1.2, 2.0] {
            let curvature = |omega: f64| 4.0 * (omega / (2.0 * speed)).sin().powi(2);
            let phase = |omega: f64| {
                (beta * omega * curvature(omega)).atan2(gamma + curvature(omega) - omega * omega)
                    - 2.0 * omega.atan()
            };
            let (count, from, to) = (400_000, 1e-6f64, 1e4f64);
            let step = (to / from).ln() / f64::from(count);
            let integral = simpson(count, step, |n| phase(from * (step * n).exp())) + (2.0 - 2.0 * beta) / to;
            let direct = gamma.sqrt() * (integral / PI).exp();
            let ours = prestress_at(speed, beta, gamma);
            assert!((ours / direct - 1.0).abs() < 2e-5, "v = {speed}: {ours} {direct}");
        }
    }

    #[test]
    fn a_soft_top_drive_and_a_little_damping_change_little() {
        let bare = front(0.6, 0.0, 0.0).speed_over_c().unwrap();
        assert!((front(0.6, 0.0, 1e-6).speed_over_c().unwrap() / bare - 1.0).abs() < 1e-5);
        assert!((front(0.6, 1e-6, 0.0).speed_over_c().unwrap() / bare - 1.0).abs() < 1e-5);
        let held = front(0.8, 0.0, 0.65).speed_over_c().unwrap();
        assert!((front(0.8, 1e-6, 0.65).speed_over_c().unwrap() / held - 1.0).abs() < 1e-5);
    }

    #[test]
    fn damping_speeds_a_front_up_and_a_held_drive_slows_it_down() {
        let speed = |beta, gamma| front(0.7, beta, gamma).speed_over_c().unwrap();
        assert!(speed(0.0, 0.0) < speed(0.1, 0.0) && speed(0.1, 0.0) < speed(1.0, 0.0));
        assert!(speed(0.0, 0.65) < speed(0.0, 0.0) && speed(0.0, 0.65) < speed(0.01, 0.65));
        // Waves of more than one block at a time need sqrt(gamma / (4 + gamma)) = 0.374.
        assert_eq!(front(0.37, 0.0, 0.65).speed_over_c(), None);
        assert!(front(0.38, 0.0, 0.65).speed_over_c().is_some());
        assert_eq!(front(1.0, 0.0, 0.0).speed_over_c(), None);
        assert_eq!(front(0.0, 0.0, 0.0).speed_over_c(), None);
    }

    #[test]
    fn a_curve_rises_and_holds_single_speeds() {
        for (beta, gamma) in [(0.0, 0.0), (0.3, 0.0), (0.01, 0.65)] {
            let curve = curve(beta, gamma, 4.0);
            assert!(curve.is_sorted_by(|a, b| a.0 < b.0 && a.1 < b.1), "{beta} {gamma}");
            let (prestress, speed) = curve[curve.len() / 2];
            assert!(curve.len() > 100, "{beta} {gamma}: {} points", curve.len());
            let single = front(prestress, beta, gamma).speed_over_c().unwrap();
            assert!((single / speed - 1.0).abs() < 1e-8, "{beta} {gamma}: {single} {speed}");
        }
    }

    #[test]
    fn pulses_slip_and_end_as_worked_out_by_hand() {
        let pulse = front(0.6, 0.0, 0.65);
        assert!((pulse.pulse_slip().unwrap() - 1.846_153_846_153_846).abs() < 1e-14);
        assert!((pulse.arrest_prestress() - 0.245_283_018_867_924_5).abs() < 1e-15);
        // There a slipped block pulls the next one exactly at its threshold.
        let last = Front { prestress: pulse.arrest_prestress(), ..pulse };
        assert!((last.prestress + last.pulse_slip().unwrap() - 1.0).abs() < 1e-14);
        assert_eq!(front(0.6, 0.0, 0.0).pulse_slip(), None);
    }

    #[test]
    fn it_is_read_off_a_plan_where_it_applies() {
        let sets =
            ["slider.blocks=11", "friction.law=rigid", "prestress.ratio=0.6", "slider.relative_damping=0.2"];
        let with = |more: &[&str]| Front::of(&plan(&[&sets, more].concat()), 5);
        let none = &["drive.stiffness_n_per_m=0", "drive.velocity_m_per_s=0"];
        let found = with(none).unwrap();
        // (0.6 - 0.45) / (0.7 - 0.45)
        assert!((found.prestress - 0.6).abs() < 1e-12 && found.top_stiffness == 0.0, "{found:?}");
        assert!((found.relative_damping - 0.2).abs() < 1e-12, "{found:?}");
        // k = 2.5e7 N/m on eleven blocks.
        let held = ["drive.kind=top", "drive.stiffness_n_per_m=1.375e8", "drive.velocity_m_per_s=0"];
        assert!((with(&held).unwrap().top_stiffness - 0.5).abs() < 1e-9);
        for other in [
            &["friction.law=interfacial-springs"][..],
            &["friction.law=velocity-weakening", "friction.weakening_velocity_m_per_s=0.1"],
            &["drive.velocity_m_per_s=1e-4"],
            &["drive.stiffness_n_per_m=1e5"],
            &["friction.dynamic_coefficient=0.7"],
        ] {
            assert_eq!(with(&[none, other].concat()), None, "{other:?}");
        }
    }
}
