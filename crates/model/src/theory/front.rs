//! The speed of a front in a uniformly prestressed chain with rigid contacts: theory.
//!
//! Units of this file: length `a` and time `sqrt(m / k)`, so speeds are relative to
//! `c = a sqrt(k / m)`, the chain's wave speed; forces `(mu_s - mu_d) p`, measured from `mu_d p`,
//! so that a block detaches at 1 and slides without friction; displacements `(mu_s - mu_d) p / k`.
//! Four parameters remain: `tau`, the prestress; `beta`, the damping `eta / sqrt(k m)`; `alpha`, the
//! radiation `E / sqrt(k m)`; and `gamma = K_n / k`, the stiffness of a stopped top drive.
//!
//! # Speed
//!
//! A steady front reaches each block a time `1 / v` after the previous one, and all blocks move
//! alike: `u(s)`, with the time `s` since detachment, obeys, with
//! `D u = u(s + 1/v) + u(s - 1/v) - 2 u(s)`,
//!
//! ```text
//! u'' = -gamma u - alpha u' + tau + D u + beta D u'  for s > 0,   u = 0 for s < 0,
//! tau + u(1/v) + beta u'(1/v) = 1:  the block ahead is pulled just hard enough.
//! ```
//!
//! The Laplace transform is `L(p) U(p) = tau / p - G(p)`, where
//! `L(p) = p^2 + alpha p + gamma + (1 + beta p) (2 - 2 cosh(p / v))` and `G` belongs to the force on blocks
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
//! **With radiation** the chain behind the front drifts at `tau / alpha` instead of accelerating, and fronts of
//! every speed occur, also slower than all waves. The divisor is then `Q = p^2 + alpha p + gamma`, so `M(0) = 1`
//! and, with both phases between 0 and `pi`,
//!
//! ```text
//! tau = exp(1/pi int_0^inf [arg L(i omega) - arg Q(i omega)] / omega d omega).
//! ```
//!
//! If `alpha beta = 1` and `gamma = 0`, `L = (1 + beta p) (alpha p + 2 - 2 cosh(p / v))`, and `v alpha` depends on
//! `tau` alone: it is that of the front without inertia, the limit for large `alpha`.
//!
//! The theory assumes that a block which slides goes on sliding. With `alpha` below 1 and little prestress blocks
//! come to rest behind the front, and it advances by fits or halts: below `tau` = 0.029, 0.044, 0.068, 0.107, 0.132,
//! 0.109, 0.033 for `alpha` = 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1 (chains of 300 blocks, transients included; from
//! `alpha` = 1.05 on for none tried). There the speed found here is that of no front. Small `tau` takes long to
//! become steady, some `1 / tau` blocks.
//!
//! # Slip and arrest
//!
//! Behind a steady pulse all blocks have slipped by the same `U` and are at rest, so the springs
//! between them are unstrained. Without damping no energy is lost: the work of the prestress,
//! `tau U`, is stored in the driving spring, `gamma U^2 / 2`, and `U = 2 tau / gamma`. The last
//! block to slip pulls the next one with `tau + U`; if that is below 1 the pulse stops: no pulse
//! propagates below `tau = gamma / (2 + gamma)`.
//!
//! Where friction falls over `d` it takes `d / 2` of the work: `tau U = gamma U^2 / 2 + d / 2`. This has no root for
//! `gamma d > tau^2`, and `tau + U >= 1` needs `1 - tau <= (1 + sqrt(1 - (2 + gamma) d)) / (2 + gamma)` unless
//! `d (1 + gamma)^2 >= gamma`.
//!
//! # Slow fronts
//!
//! If `tau n^2` is far below 1 the last of `n` sliding blocks starts only once the others are nearly in balance. When
//! block `j` joins, all `j` follow by 1, in the slowest mode `f_i = cos(pi (i - 1/2) / (2 j + 1))` of `j` damped
//! blocks before a stuck one, and block `j + 1` starts when all but `tau j` of the pull is made up:
//!
//! ```text
//! T = alpha sum_{j < n} ln(A_j / (j tau)) / (4 sin^2(pi / (4 j + 2))),   A_j = f_j sum f / sum f^2.
//! ```
//!
//! Before a stuck block the `n` blocks come to rest, without swinging, at
//! `sum u = (1 - tau) n (n + 1) / 2 + tau n (n + 1) (2 n + 1) / 6`.
//!
//! # Friction that falls over a slip
//!
//! All of this is for friction that falls at once. [`weakening`] has what is known of others.

use std::f64::consts::PI;

use super::weakening;
use crate::plan::Plan;

/// The parameters of a front's speed; all dimensionless, defined above.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Front {
    /// `tau`: prestress minus sliding friction, over static minus sliding friction.
    pub prestress: f64,
    /// `beta = eta / sqrt(k m)`.
    pub relative_damping: f64,
    /// `gamma = K_n / k` of a stopped top drive; 0 without drive.
    pub top_stiffness: f64,
    /// `alpha = E / sqrt(k m)` of radiation; 0 without.
    pub relative_radiation: f64,
    /// `d = D_c k / ((mu_s - mu_d) p)`; 0 where friction falls at once.
    pub weakening_slip: f64,
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
    /// does not apply: for slabs, ends that are not free, contacts that are not rigid or weaken with velocity or in pieces,
    /// and a drive that moves or does not act on all blocks alike.
    pub fn of(plan: &Plan, block: usize) -> Option<Front> {
        if !plan.has_theory() || plan.has_contact_courses() {
            return None;
        }
        let (held, law) = (plan.drive.stiffness_n_per_m(plan.blocks), plan.friction.law);
        let even = held.iter().all(|stiffness| (stiffness - held[0]).abs() <= 1e-12 * held[0]);
        // On the whole the fall has the slope 1, and a steeper piece if it has several.
        let is_linear = law.weakening().is_some_and(|fall| fall.steepest() == 1.0);
        let plain_friction = law.holds() && (law.affine().is_some() || is_linear);
        if !plain_friction || !even || plan.drive.velocity_m_per_s != 0.0 || plan.drive.course.is_some() {
            return None;
        }
        Some(Front::with_prestress(plan, block, relative_prestress(plan, block)?))
    }

    /// The front of a plan at a block, counted from 0, under a prestress, if its drive is held.
    pub fn with_prestress(plan: &Plan, block: usize, prestress: f64) -> Front {
        let k = plan.elastic.stiffness_n_per_m;
        let held = plan.drive.stiffness_n_per_m(plan.blocks);
        let impedance_kg_per_s = (k * plan.block_mass_kg).sqrt();
        Front {
            prestress,
            relative_damping: plan.elastic.damping_kg_per_s / impedance_kg_per_s,
            // Of a drive from the side, no block but the first has a spring.
            top_stiffness: held.iter().copied().fold(f64::INFINITY, f64::min) / k,
            relative_radiation: plan.friction.law.radiation_kg_per_s() / impedance_kg_per_s,
            weakening_slip: k / weakening::weakening_n_per_m(plan, block),
        }
    }

    /// Whether theory has its speed: where friction falls over a slip, only with radiation, without dampers and drive.
    pub fn has_speed(&self) -> bool {
        let radiates_alone =
            self.relative_radiation > 0.0 && self.relative_damping + self.top_stiffness == 0.0;
        self.weakening_slip == 0.0 || radiates_alone
    }

    /// The speed of a steady front over the chain's wave speed. None if the prestress is not
    /// between 0 and 1, or, under a stopped top drive, drives no front faster than [`Front::slowest`];
    /// and where friction falls over a slip, unless there is radiation, and neither dampers nor a drive.
    pub fn speed_over_c(&self) -> Option<f64> {
        let (mut low, mut high) = (self.slowest(), 1e3);
        if self.relative_radiation > 0.0 {
            // Half the speed at which the drift behind the front strains a spring by 1.
            let drift = f64::min(0.5 * self.prestress / self.relative_radiation, 0.5);
            // The closed form of friction that falls over a slip is cheap enough for any start.
            low = if self.weakening_slip > 0.0 { 1e-9 } else { drift };
        }
        let range = self.prestress_at(low)..self.prestress_at(high);
        if !self.has_speed() || !range.contains(&self.prestress) {
            return None;
        }
        // The prestress rises with speed. Bisected to the precision of the integral.
        while high / low > 1.0 + 1e-9 {
            let middle = (low * high).sqrt();
            if self.prestress_at(middle) < self.prestress {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some((low * high).sqrt())
    }

    /// The slip behind a steady pulse without damping, in `(mu_s - mu_d) p / k`; None without a
    /// stopped top drive, and where friction falls over a slip that leaves no pulse.
    pub fn pulse_slip(&self) -> Option<f64> {
        let &Front { prestress: tau, top_stiffness: gamma, weakening_slip: d, .. } = self;
        let square = tau * tau - gamma * d;
        // Without d the root is exactly tau.
        (gamma > 0.0 && square >= 0.0).then(|| (tau + square.sqrt().copysign(tau)) / gamma)
    }

    /// The time, over `sqrt(m / k)`, that a slow front takes from block 1 to block `blocks`; None without radiation, with
    /// a drive or dampers, where friction falls over a slip, and where `tau n^2` is too large: where a block would start
    /// before the one behind it.
    pub fn slow_duration(&self, blocks: usize) -> Option<f64> {
        let duration = |j: usize| {
            let f = |i: usize| libm::cos(PI * (i as f64 - 0.5) / (2 * j + 1) as f64);
            let (sum, square) = (1..=j).map(f).fold((0.0, 0.0), |(sum, square), f| (sum + f, square + f * f));
            let half = libm::sin(PI / (4 * j + 2) as f64);
            let logarithm = libm::log(f(j) * sum / square / (j as f64 * self.prestress));
            (logarithm > 0.0).then(|| logarithm / (4.0 * half * half))
        };
        let alpha = self.relative_radiation;
        let others = [self.top_stiffness, self.relative_damping, self.weakening_slip];
        if alpha == 0.0 || self.prestress <= 0.0 || others.iter().any(|other| *other > 0.0) {
            return None;
        }
        (1..blocks).map(duration).sum::<Option<f64>>().map(|sum| alpha * sum)
    }

    /// The sum of all slip, in `(mu_s - mu_d) p / k`, of `blocks` blocks that rest in balance before a stuck
    /// one; None with a drive, and where friction falls over a slip.
    pub fn static_slip_sum(&self, blocks: usize) -> Option<f64> {
        let (n, tau) = (blocks as f64, self.prestress);
        let sum = || n * (n + 1.0) * ((1.0 - tau) / 2.0 + tau * (2.0 * n + 1.0) / 6.0);
        (self.top_stiffness + self.weakening_slip == 0.0).then(sum)
    }

    /// The prestress below which no pulse propagates, without damping; 0 without a stopped top
    /// drive.
    pub fn arrest_prestress(&self) -> f64 {
        let &Front { top_stiffness: gamma, weakening_slip: d, .. } = self;
        if d == 0.0 {
            gamma / (2.0 + gamma)
        } else if d * (1.0 + gamma) * (1.0 + gamma) < gamma {
            1.0 - (1.0 + (1.0 - (2.0 + gamma) * d).sqrt()) / (2.0 + gamma)
        } else {
            (gamma * d).sqrt()
        }
    }

    /// Prestress and speed over `c` of fronts that differ from this one in their prestress alone, up to the speed
    /// `fastest`, both ascending. The curve begins at [`Front::slowest`] or, where damping makes slower fronts
    /// need more prestress, at the minimum of the prestress. For fronts that [have a speed](Front::has_speed).
    pub fn curve(&self, fastest: f64) -> Vec<(f64, f64)> {
        const POINTS: u32 = 120;
        let top = weakening::fastest(self.relative_radiation, self.weakening_slip);
        let fastest = if self.weakening_slip > 0.0 { fastest.min(top) } else { fastest };
        let slowest = self.slowest();
        let mut points: Vec<(f64, f64)> = (0..=POINTS)
            .map(|n| {
                // Denser where the prestress changes fastest with speed.
                let share = f64::from(n) / f64::from(POINTS);
                let speed = slowest + (fastest - slowest) * share * share;
                (self.prestress_at(speed), speed)
            })
            .collect();
        let rising = points.windows(2).rposition(|pair| pair[1].0 <= pair[0].0).map_or(0, |last| last + 1);
        points.drain(..rising);
        points
    }

    /// The slowest front that the theory describes, over `c`: at the wave speed in a free slider; under a
    /// stopped top drive, the front whose wave alternates from block to block. With radiation there is none, and
    /// curves begin here.
    pub fn slowest(&self) -> f64 {
        match (self.relative_radiation > 0.0, self.top_stiffness) {
            (true, _) => 2e-3,
            // Slightly more, since zero prestress belongs to the wave speed.
            (false, 0.0) => 1.0 + 1e-9,
            (false, gamma) => (gamma + 4.0).sqrt() / PI,
        }
    }

    /// The prestress that drives a front at this speed over `c`: above 0 with radiation, otherwise at least
    /// [`Front::slowest`]. Where friction falls over a slip, that with radiation alone.
    pub fn prestress_at(&self, speed: f64) -> f64 {
        match (self.weakening_slip, self.relative_radiation > 0.0) {
            (d, _) if d > 0.0 => weakening::radiating_prestress(speed, self.relative_radiation, d),
            (_, true) => radiating_prestress_at(speed, self),
            (_, false) => prestress_at(speed, self.relative_damping, self.top_stiffness),
        }
    }
}

/// `4 sin^2(omega / 2v)`: what `2 - 2 cosh(p / v)` is on the imaginary axis.
fn curvature_at(omega: f64, speed: f64) -> f64 {
    let sine = libm::sin(omega / (2.0 * speed));
    4.0 * sine * sine
}

/// [`Front::prestress_at`] with radiation.
fn radiating_prestress_at(speed: f64, front: &Front) -> f64 {
    /// Points of the integral over frequencies beyond the resolved ones, and how far they reach.
    const POINTS: u32 = 1000;
    const REACH: f64 = 1e3;
    let &Front { relative_damping: beta, top_stiffness: gamma, relative_radiation: alpha, .. } = front;
    let of_divisor = |omega: f64| libm::atan2(alpha * omega, gamma - omega * omega);
    let phase = |omega: f64| {
        let curved = curvature_at(omega, speed);
        libm::atan2(omega * (alpha + beta * curved), gamma + curved - omega * omega) - of_divisor(omega)
    };
    // Over a period of `omega / v = theta`, `L = A - B cos theta` with slowly changing `A` and `B`, and the mean of
    // `ln L` is that of `((root(A - B) + root(A + B)) / 2)^2`. Phases are even in `theta`, so that what periods that
    // begin at 0 leave out is of the order `(v / omega)^2` of the phase.
    let mean_phase = |omega: f64| {
        let root = |curved: f64| {
            let (re, im) = (gamma + curved - omega * omega, omega * (alpha + beta * curved));
            let (size, half) = (libm::hypot(re, im).sqrt(), 0.5 * libm::atan2(im, re));
            [size * libm::cos(half), size * libm::sin(half)]
        };
        let [[a, b], [c, d]] = [root(0.0), root(4.0)];
        2.0 * libm::atan2(b + d, a + c) - of_divisor(omega)
    };
    let beyond = |end: f64| {
        let last = REACH * end.max(alpha).max(1.0);
        let step = libm::log(last / end) / f64::from(POINTS);
        simpson(POINTS, step, |n| mean_phase(end * libm::exp(step * n))) - 2.0 * beta / last
    };
    // Phases have steps of the width `alpha`.
    let finer = if alpha < 0.3 { 8 } else { 2 };
    libm::exp(over_frequencies(&phase, speed, finer, &beyond) / PI)
}

/// [`Front::prestress_at`] without radiation.
fn prestress_at(speed: f64, relative_damping: f64, top_stiffness: f64) -> f64 {
    let (beta, gamma) = (relative_damping, top_stiffness);
    let curvature = |omega: f64| curvature_at(omega, speed);
    if gamma == 0.0 {
        let undamped = (1.0 - 1.0 / (speed * speed)).sqrt();
        if beta == 0.0 {
            return undamped;
        }
        let phase = |omega: f64| {
            let share = curvature(omega) / (omega * omega);
            libm::atan2(-beta * omega * share, 1.0 - share)
        };
        return undamped * libm::exp(over_frequencies(&phase, speed, 1, &|end| -2.0 * beta / end) / PI);
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
    let rest = over_frequencies(&phase, speed, 1, &|end| (two_delta - 2.0 * beta) / end);
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

/// `int_0^inf phase(omega) / omega d omega` of a phase that vanishes at both ends, on grids `finer` by that factor.
/// `beyond` is the integral from a frequency, a whole number of periods of `sin^2(omega / 2v)`, to infinity: `tail`
/// over it, if the phase averaged over a period falls as `tail / omega`.
fn over_frequencies(phase: &dyn Fn(f64) -> f64, speed: f64, finer: u32, beyond: &dyn Fn(f64) -> f64) -> f64 {
    /// Start of the logarithmic grid; below, the phase is proportional to frequency.
    const FROM: f64 = 1e-9;
    /// The logarithmic grid covers one period, the others have the given number of pieces each;
    /// finer grids leave the sixth digit unchanged.
    const LOGARITHMIC: u32 = 3000;
    const PERIODS: u32 = 60;
    const PIECES: u32 = 48;
    let (logarithmic, pieces) = (LOGARITHMIC * finer, PIECES * finer);
    let period = 2.0 * PI * speed;
    let step = libm::log(period / FROM) / f64::from(logarithmic);
    let slow = simpson(logarithmic, step, |n| phase(FROM * libm::exp(step * n)));
    let piece = period / f64::from(pieces);
    let fast = simpson(PERIODS * pieces, piece, |n| {
        let omega = period + piece * n;
        phase(omega) / omega
    });
    let end = period * f64::from(1 + PERIODS);
    phase(FROM) + slow + fast + beyond(end)
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
        Front { prestress, relative_damping, top_stiffness, ..Front::default() }
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
            let curve = front(0.5, beta, gamma).curve(4.0);
            assert!(curve.is_sorted_by(|a, b| a.0 < b.0 && a.1 < b.1), "{beta} {gamma}");
            let (prestress, speed) = curve[curve.len() / 2];
            assert!(curve.len() > 100, "{beta} {gamma}: {} points", curve.len());
            let single = front(prestress, beta, gamma).speed_over_c().unwrap();
            assert!((single / speed - 1.0).abs() < 1e-8, "{beta} {gamma}: {single} {speed}");
        }
    }

    /// Times of an independent program, `fixtures/reference/fronts/moment-duration.csv`.
    #[test]
    fn slow_fronts_take_as_long_as_simulated_ones() {
        let slow =
            |prestress, n| Front { relative_radiation: 10.0, ..front(prestress, 0.0, 0.0) }.slow_duration(n);
        for (n, simulated) in [(2, 114.22), (4, 882.4), (8, 6096.14), (16, 40831.24), (32, 264220.92)] {
            let found = slow(1e-5, n).unwrap();
            assert!((found / simulated - 1.0).abs() < 0.008, "{n}: {found}");
        }
        assert_eq!(slow(1e-5, 1), Some(0.0));
        assert_eq!((slow(0.0, 8), front(0.1, 0.0, 0.0).slow_duration(8)), (None, None));
        // It would fall with n, from 80780 at 48 to -13662 at 64.
        assert!(slow(1e-3, 32).is_some());
        assert_eq!((slow(1e-3, 56), slow(1e-3, 64)), (None, None));
        for other in [front(1e-5, 0.1, 0.0), front(1e-5, 0.0, 0.1)] {
            assert_eq!(Front { relative_radiation: 10.0, ..other }.slow_duration(8), None, "{other:?}");
        }
        // Three blocks before a stuck one, of which each bears tau and block 1 bears 1: 1 + 2 + 3 and 6 + 5 + 3.
        assert_eq!(front(0.5, 0.0, 0.1).static_slip_sum(3), None);
        assert!((front(0.5, 0.0, 0.0).static_slip_sum(3).unwrap() - (0.5 * 6.0 + 0.5 * 14.0)).abs() < 1e-12);
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
        assert!((found.relative_damping - 0.2).abs() < 1e-12 && found.relative_radiation == 0.0, "{found:?}");
        // m = 12 kg or 0.012 kg over eleven blocks, by the parameter set.
        let radiating = with(&[&none[..], &["friction.radiation_kg_per_s=5"]].concat()).unwrap();
        let mass_kg = plan(&sets).block_mass_kg;
        assert!(
            (radiating.relative_radiation * (2.5e7 * mass_kg).sqrt() - 5.0).abs() < 1e-9,
            "{radiating:?}"
        );
        let weak = with(&[&none[..], &["friction.weakening_slip_m=1e-6"]].concat()).unwrap();
        assert!((weak.weakening_slip * 0.25 * (400.0 / 11.0) - 25.0).abs() < 1e-9, "{weak:?}");
        // k = 2.5e7 N/m on eleven blocks.
        let held = ["drive.kind=top", "drive.stiffness_n_per_m=1.375e8", "drive.velocity_m_per_s=0"];
        assert!((with(&held).unwrap().top_stiffness - 0.5).abs() < 1e-9);
        for other in [
            &["friction.law=interfacial-springs"][..],
            &["friction.law=interfacial-springs", "friction.weakening_slip_m=1e-6"],
            &[
                "friction.weakening_slip_m=1e-6",
                "friction.weakening_fractions=[0.5]",
                "friction.weakening_shares=[0.4]",
            ],
            &["friction.law=velocity-weakening", "friction.weakening_velocity_m_per_s=0.1"],
            &["drive.velocity_m_per_s=1e-4"],
            &["drive.stiffness_n_per_m=1e5"],
            &["friction.dynamic_coefficient=0.7"],
        ] {
            assert_eq!(with(&[none, other].concat()), None, "{other:?}");
        }
    }
}
